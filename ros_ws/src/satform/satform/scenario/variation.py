# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A scenario with some of its fields set to other values, checked like a file."""

import json
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from satform.common.spec import Spec
from satform.files.named_file import FileSource, with_copies
from satform.scenario.checking import checked
from satform.scenario.errors import ScenarioError
from satform.scenario.field_errors import problems
from satform.scenario.overrides import apply_values
from satform.scenario.truncation import beyond_the_end, within_the_end

_Model = TypeVar("_Model", bound=Spec)


def varied(model: type[_Model], text: str, files: Mapping[str, bytes], changes: Mapping[str, Any]) -> _Model:
    """A scenario with changed fields.

    Args:
        model: class of the scenario.
        text: the scenario as JSON.
        files: content of the files that it names, by name.
        changes: new values by the path of a field; for paths see `satform.scenario.overrides.set_value`.
            A value is a number, text, a specification, or a list or mapping of these.

    Returns:
        The changed scenario. Where the flight became shorter, what is expected, breaks or changes beyond its
        new end is left out, as with `--set`.

    Raises:
        ScenarioError: a path leads nowhere, or the changed scenario cannot fly; all problems at once.
    """
    attached = dict(files)
    data = json.loads(text)
    written = deepcopy(data)
    changed = apply_values(data, {path: _plain(value, attached) for path, value in changes.items()})
    flown = within_the_end(data, beyond_the_end(written, data, changed))
    made, found = checked(
        model,
        flown,
        None,
        str(data.get("name", "scenario")),
        changed,
        FileSource(Path(), attached, recorded=True),
    )
    if made is None or found:
        raise ScenarioError(found)
    return made


def refusal(model: type[Spec], fields: Mapping[str, Any], details: list[Any]) -> ScenarioError:
    """The error of a scenario that was built in Python and cannot fly.

    Args:
        model: class of the scenario.
        fields: that it was built with.
        details: what pydantic found.
    """
    data = _plain(fields, {})
    name = model.__name__
    return ScenarioError(
        [problem for found in details for problem in problems(found, model, data, None, name, {})]
    )


def _plain(value: Any, files: dict[str, bytes]) -> Any:
    """A value as plain data; files that specifications in it name are added to `files`."""
    if isinstance(value, Spec):
        text, copies = with_copies(value, exclude_unset=True)
        files.update(copies)
        return json.loads(text)
    if isinstance(value, Mapping):
        return {str(key): _plain(part, files) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part, files) for part in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return value
