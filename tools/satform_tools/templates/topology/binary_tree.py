# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A communication graph in which every satellite but the first receives from one other."""

from typing import Annotated, Literal

from pydantic import Field

from satform.consensus.graph import Graph, TopologySpec


class BinaryTreeSpec(TopologySpec):
    kind: Literal["binary_tree"] = "binary_tree"
    branches: Annotated[int, Field(ge=1)] = 2
    """Number of satellites that receive from one satellite, at most."""

    def build(self, count: int) -> Graph:
        receivers = list(range(1, count))
        return Graph.of_edges(count, receivers, [(index - 1) // self.branches for index in receivers])
