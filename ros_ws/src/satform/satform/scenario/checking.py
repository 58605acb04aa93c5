# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""From plain data to a checked model, or to all that is wrong with it."""

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import ValidationError

from satform.common.spec import FieldPath, Spec
from satform.files.named_file import FileSource
from satform.scenario.errors import Problem
from satform.scenario.field_errors import coerced, problems

_Model = TypeVar("_Model", bound=Spec)


def checked(
    model: type[_Model],
    data: Any,
    tree: Any,
    file: str,
    changes: Mapping[FieldPath, str],
    files: FileSource | None,
) -> tuple[_Model | None, list[Problem]]:
    """Check plain data against a model.

    Args:
        model: to be made of it.
        data: plain data: dicts, lists, numbers and text.
        tree: the same with the lines on which its parts stand.
        file: name to use in messages.
        changes: where each setting laid over the file comes from, by the path that it has changed.
        files: where the files that it names are looked for.

    Returns:
        The model, or None where the check fails; and all that is wrong.
    """
    try:
        made = model.model_validate(data, context=files)
    except ValidationError as error:
        every = error.errors(include_url=False)
        return None, [
            problem for details in every for problem in problems(details, model, data, tree, file, changes)
        ]
    return made, coerced(data, made.model_dump(exclude_unset=True), tree, file, changes)
