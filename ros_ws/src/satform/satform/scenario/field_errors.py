# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Error sentences of scenario fields: where in the file, what was found and what is allowed."""

import difflib
import json
from collections.abc import Mapping, Sequence
from typing import Any, get_args

from pydantic_core import ErrorDetails

from satform.common.angle_text import is_angle
from satform.common.spec import Complaint, FieldPath, Plugin, Spec, specs
from satform.scenario.errors import Problem
from satform.scenario.renamed import RENAMED_FIELDS, RENAMED_VALUES
from satform.scenario.yaml_reader import line_of

_NOT_A_MAPPING = {"model_type", "model_attributes_type", "dict_type"}
_NOT_A_LIST = {"tuple_type", "list_type"}
A_NUMBER = "should be a number"
A_LIST = "should be a list, such as [x, y, z]"
_NAME_RULE = "lower case letters, digits and underscores, a letter first, at most 40 of them"


def problems(
    details: ErrorDetails,
    model: type[Spec],
    data: Any,
    tree: Any,
    file: str,
    changes: Mapping[FieldPath, str],
) -> list[Problem]:
    """What one finding of the model's check means for the person who wrote the file.

    Args:
        details: the finding.
        model: that was checked.
        data: the scenario as plain data.
        tree: the same with the lines on which its parts stand; None where it comes from no file.
        file: name to use in messages.
        changes: where each setting laid over the file comes from, such as `--set seed=1`, by the path that it
            has changed.

    Returns:
        One problem; several when the finding is about how parts fit together; none when another
        finding says it already.
    """
    if _follows_from_others(details):
        return []
    if details["type"] == "inconsistent":
        complaints: Sequence[Complaint] = details["ctx"]["complaints"]
    else:
        path = _walk(details["loc"], data)
        complaints = [(path, _sentence(details, path, model, data))]
    return [_placed(path, sentence, tree, file, changes) for path, sentence in complaints]


def _follows_from_others(details: ErrorDetails) -> bool:
    """Whether a list is called too short only because none of its entries is right."""
    found = details["input"]
    return (
        details["type"] == "too_short"
        and isinstance(found, list | tuple)
        and len(found) >= details["ctx"]["min_length"]
    )


def coerced(data: Any, model: Any, tree: Any, file: str, changes: Mapping[FieldPath, str]) -> list[Problem]:
    """Values that were taken for something else than what was written: `true` or `"5"` for a number.

    Args:
        data: the scenario as plain data.
        model: the scenario that was made of it, as plain data.
        tree: as for `problems`.
        file: as for `problems`.
        changes: as for `problems`.

    Returns:
        A problem for each such value.
    """
    return [_placed(path, sentence, tree, file, changes) for path, sentence in _coerced(data, model, ())]


def _coerced(written: Any, taken: Any, path: FieldPath) -> list[Complaint]:
    if isinstance(written, dict) and isinstance(taken, dict):
        parts = [(key, written[key], taken[key]) for key in written if key in taken]
    elif isinstance(written, list) and isinstance(taken, list | tuple):
        parts = [(index, *pair) for index, pair in enumerate(zip(written, taken, strict=False))]
    else:
        # One number may stand for all axes.
        made = taken[0] if isinstance(taken, list | tuple) and taken else taken
        number = isinstance(made, int | float) and not isinstance(made, bool)
        wrong = number and isinstance(written, bool | str) and not is_angle(written)
        return [(path, f"found {shortened(written)}; it {A_NUMBER}")] if wrong else []
    return [found for key, old, new in parts for found in _coerced(old, new, (*path, key))]


def _placed(
    path: FieldPath, sentence: str, tree: Any, file: str, changes: Mapping[FieldPath, str]
) -> Problem:
    for changed, change in changes.items():
        laid_over = path[: len(changed)] == changed
        made_on_the_way = changed[: len(path)] == path and not _stands_in(path, tree)
        if laid_over or made_on_the_way:
            return Problem(change, None, dotted(path), sentence)
    return Problem(file, None if tree is None else line_of(path, tree), dotted(path), sentence)


def _stands_in(path: FieldPath, tree: Any) -> bool:
    """Whether the file itself has something at a path."""
    node = tree
    for part in path:
        try:
            node = node[part]
        except (KeyError, IndexError, TypeError):
            return False
    return True


def _walk(location: FieldPath, data: Any) -> FieldPath:
    """The path in the file of pydantic's location, without the union tags that it contains."""
    path: list[int | str] = []
    node = data
    for index, part in enumerate(location):
        last = index == len(location) - 1
        if isinstance(node, dict) and part not in node and (part == node.get("kind") or not last):
            continue
        path.append(part)
        node = _child(node, part)
    return tuple(path)


def _child(node: Any, part: int | str) -> Any:
    if isinstance(node, dict):
        return node.get(str(part))
    if isinstance(node, list) and isinstance(part, int) and part < len(node):
        return node[part]
    return None


def dotted(path: FieldPath) -> str:
    """The path of a field as messages print it."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else (f".{part}" if text else part)
    return text


def _sentence(details: ErrorDetails, path: FieldPath, model: type[Spec] | None, data: Any) -> str:
    kind, found = details["type"], details["input"]
    context = details.get("ctx", {})
    if kind == "extra_forbidden":
        names = sorted(_field_names(path[:-1], model, data))
        return f"there is no such field{nearest(str(path[-1]), names, RENAMED_FIELDS)}"
    if kind == "missing":
        return _missing(path, found)
    if kind == "union_tag_not_found" or kind in _NOT_A_MAPPING:
        return _no_mapping(kind, found, _kinds(path, model, data))
    if kind == "union_tag_invalid":
        tag = str(context.get("tag"))
        return f"there is no kind {_quoted(tag)}{nearest(tag, _kinds(path, model, data))}"
    if kind == "literal_error" and isinstance(found, str):
        return f"found {_quoted(found)}{nearest(found, _options(str(context['expected'])))}"
    if kind == "value_error":
        return details["msg"].removeprefix("Value error, ")
    return f"found {shortened(found)}; it {_rule(details, context)}"


def _quoted(text: str) -> str:
    """A text of a file in quotes, shortened."""
    return repr(text if len(text) <= 60 else f"{text[:57]}...")


def _missing(path: FieldPath, found: Any) -> str:
    if isinstance(path[-1], int):
        return f"is missing: there are {len(found)} of them, more are needed"
    return "is missing"


def _no_mapping(kind: str, found: Any, kinds: Sequence[str]) -> str:
    choice = f" with `kind:` one of {', '.join(kinds)}" if kinds else ""
    if kind == "union_tag_not_found":
        return f"needs a `kind:`, one of {', '.join(kinds)}" if kinds else "needs a `kind:`"
    return f"found {shortened(found)}; it should be a mapping of fields{choice}"


def _rule(details: ErrorDetails, context: Mapping[str, Any]) -> str:
    """What is allowed, to follow `it`."""
    kind = details["type"]
    if kind in _NOT_A_LIST:
        return A_LIST
    if kind == "too_short":
        return f"has {context['actual_length']} entries, but needs at least {context['min_length']}"
    if kind == "too_long":
        return f"has more than the {context['max_length']} entries that are allowed"
    if kind == "string_pattern_mismatch":
        return f"should consist of {_NAME_RULE}"
    if kind == "int_parsing_size":
        return "is too large for a whole number"
    if kind in {"float_parsing", "int_parsing", "float_type", "int_type"}:
        return "should be a whole number" if kind.startswith("int") else A_NUMBER
    return details["msg"].removeprefix("Input ").removeprefix("String ")


def _options(expected: str) -> list[str]:
    return [option.strip("' ") for option in expected.replace(" or ", ", ").split(", ")]


def nearest(name: str, candidates: Sequence[str], renamed: Mapping[str, str] = RENAMED_VALUES) -> str:
    """The end of a sentence about an unknown name: what was meant, and what is allowed.

    Args:
        name: that was found.
        candidates: that are allowed.
        renamed: names of earlier versions, by what each is called now.
    """
    now = renamed.get(name)
    if now in candidates:
        return f"; since version 0.2.0 it is called {now}"
    close = difflib.get_close_matches(name, candidates, n=1, cutoff=0.6)
    allowed = ", ".join(candidates)
    return f"; did you mean {close[0]}? Allowed: {allowed}" if close else f"; allowed: {allowed}"


def field_sentence(details: ErrorDetails, model: type[Spec] | None = None, data: Any = None) -> str:
    """What a check of one field found, in the words of a scenario's errors: where, what, and what is allowed.

    Args:
        details: the finding, of a specification that is checked by itself.
        model: of the specification, from which the sentence lists what is allowed; None where it is unknown.
        data: the mapping that was checked; needed with `model`.

    Returns:
        The sentence alone where the finding is about the whole specification.
    """
    path = tuple(details["loc"])
    if model is not None:
        path = _walk(path, data)
    sentence = _sentence(details, path, model, data or {})
    return f"{dotted(path)}: {sentence}" if path else sentence


def shortened(value: Any) -> str:
    """A value as messages show it."""
    try:
        text = json.dumps(value, ensure_ascii=False)
    except (TypeError, ValueError):
        text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _field_names(path: FieldPath, root: type[Spec] | None, data: Any) -> set[str]:
    """Names of the fields allowed at a path, for the nearest spelling."""
    annotation, node = _annotation(path, root, data)
    model = _model_in(annotation, node.get("kind") if isinstance(node, dict) else None)
    return set() if model is None else set(model.model_fields)


def _kinds(path: FieldPath, root: type[Spec] | None, data: Any) -> list[str]:
    """Names of the kinds among which is chosen at a path; empty where there is nothing to choose."""
    annotation = _annotation(path, root, data)[0]
    plugin = _plugin_in(annotation)
    if plugin is not None:
        return sorted(specs(plugin.group))
    kinds = {kind for model in _models_in(annotation) for kind in _kinds_of(model)}
    return sorted(kinds) if len(kinds) > 1 else []


def _kinds_of(model: type[Spec]) -> tuple[str, ...]:
    """The kinds that a specification may have; a class may have several, and then no default."""
    field = model.model_fields.get("kind")
    kinds = () if field is None else get_args(field.annotation)
    return tuple(kind for kind in kinds if isinstance(kind, str))


def _annotation(path: FieldPath, root: type[Spec] | None, data: Any) -> tuple[Any, Any]:
    """What is declared at a path, and what was found there; None twice where nothing is declared."""
    annotation: Any = root
    node = data
    for part in path:
        if isinstance(part, str):
            model = _model_in(annotation, node.get("kind") if isinstance(node, dict) else None)
            if model is None or part not in model.model_fields:
                return None, None
            field = model.model_fields[part]
            annotation = (field.annotation, *field.metadata)
        node = _child(node, part)
    return annotation, node


def _plugin_in(annotation: Any) -> Plugin | None:
    """The plug-in somewhere in a field's annotation or metadata."""
    if isinstance(annotation, Plugin):
        return annotation
    parts = annotation if isinstance(annotation, tuple) else get_args(annotation)
    return next((found for part in parts if (found := _plugin_in(part)) is not None), None)


def _model_in(annotation: Any, kind: str | None) -> type[Spec] | None:
    """The model behind a field's annotation: its own class, or the plug-in of the kind found."""
    plugin = _plugin_in(annotation)
    if plugin is not None:
        known = specs(plugin.group)
        return next(iter(known.values())) if len(known) == 1 else known.get(kind or "")
    models = _models_in(annotation)
    chosen = [model for model in models if kind in _kinds_of(model)]
    return next(iter((*chosen, *models)), None)


def _models_in(annotation: Any) -> list[type[Spec]]:
    """The specifications that a field's annotation names, without those behind plug-ins, in its order."""
    parts = annotation if isinstance(annotation, tuple) else get_args(annotation)
    found = [model for part in parts for model in _models_in(part)]
    if not found and isinstance(annotation, type) and issubclass(annotation, Spec):
        return [annotation]
    return found
