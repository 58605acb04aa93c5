# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The data of a campaign's scenario, into which the values of each case are written."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from satform.campaign.paths import Target
from satform.common.spec import FieldPath, Spec
from satform.files.named_file import FileSource, with_copies
from satform.scenario import Scenario


class CaseTemplate:
    """The data of a scenario, in which every dispersed field is present.

    Attributes:
        text: JSON.
        files: that the scenario names.
        paths: of the dispersed fields and of the seed, by the text of the path.
    """

    def __init__(self, base: Scenario, dispersed: Sequence[Target]) -> None:
        """Write a scenario out.

        Args:
            base: that all cases have, without any dispersion.
            dispersed: its fields that differ from case to case.
        """
        data, attached = json.loads(base.to_json()), base.files()
        for target in dispersed:
            attached |= _ensure_field(data, base, target.path)
        self.text = json.dumps(data)
        self.files = FileSource(Path(), attached, recorded=True)
        self.paths: dict[str, FieldPath] = {target.text: target.path for target in dispersed} | {
            "seed": ("seed",)
        }


def _ensure_field(data: Any, base: Scenario, path: FieldPath) -> dict[str, bytes]:
    """Write out all parts on the way to a field that the data leaves out; gives the files that they name."""
    files: dict[str, bytes] = {}
    node, own = data, base
    model: Any = own
    for depth, part in enumerate(path[:-1]):
        model = getattr(model, part) if isinstance(part, str) else model[part]
        if path[0] == "satellites" and depth == 1:
            # With what it takes from `satellite_defaults`.
            model = base.satellite(int(path[1]))
        inner = node[part] if isinstance(part, int) else node.get(part)
        if inner is None or (isinstance(model, tuple) and not isinstance(inner, list)):
            inner, found = _plain(model)
            files |= found
            node[part] = inner
        node = inner
    return files


def _plain(model: Any) -> tuple[Any, dict[str, bytes]]:
    """A part of a scenario as plain data, and the files that it names."""
    if isinstance(model, Spec):
        text, files = with_copies(model, exclude_unset=True)
        return json.loads(text), files
    plain, files = [], {}
    for entry in model:
        data, found = _plain(entry) if isinstance(entry, Spec | tuple) else (entry, {})
        plain.append(data)
        files |= found
    return plain, files
