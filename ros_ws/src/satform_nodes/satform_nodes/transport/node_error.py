# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The failure that ends a node in order: a sentence for the user, and the exit code."""


class NodeError(Exception):
    """A node that cannot go on; carries the sentence for the user and the exit code."""

    def __init__(self, sentence: str, code: int) -> None:
        super().__init__(sentence, code)
        self.code = code

    def __str__(self) -> str:
        return str(self.args[0])
