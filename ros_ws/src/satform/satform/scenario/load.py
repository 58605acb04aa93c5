"""From a YAML file to a `Scenario`, or to all that is wrong with it."""

import difflib
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import ValidationError
from pydantic_core import ErrorDetails
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import AliasEvent

from satform.scenario.errors import Problem, ScenarioError
from satform.scenario.model import Scenario
from satform.spec import Plugin, Spec, specs

MAXIMUM_FILE_BYTES = 4_000_000
"""A larger scenario file is refused unread."""

Location = tuple[int | str, ...]


def load_scenario(path: str | Path, changes: Iterable[str] = ()) -> Scenario:
    """Read and check a scenario file.

    Args:
        path: the YAML file.
        changes: `key=value` settings laid over the file, with dotted keys and YAML values, for
            example `timing.step=1.0` or `satellites.0.arc_length=100.0`.

    Returns:
        The scenario, complete and consistent.

    Raises:
        ScenarioError: the file cannot be read or cannot fly; all problems at once.
    """
    file = str(path)
    try:
        size = Path(path).stat().st_size
        if size > MAXIMUM_FILE_BYTES:
            sentence = f"the file has {size} bytes; a scenario has at most {MAXIMUM_FILE_BYTES}"
            raise ScenarioError([Problem(file, None, "", sentence)])
        text = Path(path).read_bytes().decode()
    except OSError as error:
        raise ScenarioError([Problem(file, None, "", f"cannot be read: {error.strerror}")]) from None
    except UnicodeDecodeError as error:
        sentence = f"is not UTF-8 text: byte {error.object[error.start]:#04x} at offset {error.start}"
        raise ScenarioError([Problem(file, None, "", sentence)]) from None
    except ValueError:
        raise ScenarioError([Problem(file, None, "", "is not a possible file name")]) from None
    return parse_scenario(text, file, changes)


def parse_scenario(text: str, file: str = "<text>", changes: Iterable[str] = ()) -> Scenario:
    """Check the text of a scenario.

    Args:
        text: YAML 1.2.
        file: the name to use in messages.
        changes: as for `load_scenario`.

    Returns:
        The scenario, complete and consistent.

    Raises:
        ScenarioError: the text cannot fly; all problems at once.
    """
    tree = _read_yaml(text, file)
    data = _plain(tree)
    _apply_changes(data, changes)
    try:
        return Scenario.model_validate(data)
    except ValidationError as error:
        problems = [
            problem
            for details in error.errors(include_url=False)
            for problem in _problems(details, data, tree, file)
        ]
        raise ScenarioError(sorted(problems, key=lambda problem: problem.line or 0)) from None


def _read_yaml(text: str, file: str) -> Any:
    reader = YAML(typ="rt", pure=True)
    try:
        for event in reader.parse(text):
            if isinstance(event, AliasEvent):
                line = event.start_mark.line + 1
                sentence = "aliases (*name) are not used in scenarios; every_satellite holds what is shared"
                raise ScenarioError([Problem(file, line, "", sentence)])
        tree = reader.load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        sentence = f"is not YAML: {error.problem or error.context}"
        line = None if mark is None else mark.line + 1
        raise ScenarioError([Problem(file, line, "", sentence.replace("\n", " "))]) from None
    except (
        YAMLError,
        ValueError,
        RecursionError,
        TypeError,
        AttributeError,
        KeyError,
        NotImplementedError,
    ) as error:
        sentence = (
            f"is not YAML that can be read here: {str(error).splitlines()[0] if str(error) else error!r}"
        )
        raise ScenarioError([Problem(file, None, "", sentence)]) from None
    if not isinstance(tree, Mapping):
        found = "nothing" if tree is None else f"a {type(tree).__name__}"
        sentence = f"a scenario is a mapping of fields such as name, orbit, satellites; found {found}"
        raise ScenarioError([Problem(file, 1, "", sentence)])
    return tree


def _plain(node: Any) -> Any:
    """The YAML tree without its layout: dicts, lists, strings, plain numbers."""
    if isinstance(node, Mapping):
        return {str(key): _plain(value) for key, value in node.items()}
    if isinstance(node, list | tuple | set):
        return [_plain(value) for value in node]
    if isinstance(node, bool) or node is None:
        return node
    for plain in (int, float, str):
        if isinstance(node, plain):
            return plain(node)
    return str(node)


def _apply_changes(data: Any, changes: Iterable[str]) -> None:
    problems = []
    for change in changes:
        complaint = _apply_change(data, change)
        if complaint:
            problems.append(Problem(f"--set {change}", None, "", complaint))
    if problems:
        raise ScenarioError(problems)


def _apply_change(data: Any, change: str) -> str | None:
    key, equals, text = change.partition("=")
    if not equals or not key:
        return "is not of the form key=value, such as timing.step=1.0"
    try:
        value = _plain(YAML(typ="safe", pure=True).load(text))
    except (YAMLError, ValueError) as error:
        return f"the value {text!r} is not YAML: {str(error).splitlines()[0]}"
    *parents, last = key.split(".")
    node = data
    for depth, part in enumerate(parents):
        if isinstance(node, dict):
            node = node.setdefault(part, {})
        elif isinstance(node, list) and part.isdigit() and int(part) < len(node):
            node = node[int(part)]
        else:
            return f"there is no {'.'.join(parents[: depth + 1])} in the scenario"
    if isinstance(node, dict):
        node[last] = value
    elif isinstance(node, list) and last.isdigit() and int(last) < len(node):
        node[int(last)] = value
    else:
        return f"there is no {key} in the scenario"
    return None


def _problems(details: ErrorDetails, data: Any, tree: Any, file: str) -> list[Problem]:
    if details["type"] == "inconsistent":
        complaints = details["ctx"]["complaints"]
        return [Problem(file, _line(path, tree), _dotted(path), sentence) for path, sentence in complaints]
    path = _walk(details["loc"], data)
    return [Problem(file, _line(path, tree), _dotted(path), _sentence(details, path, data))]


def _walk(location: Location, data: Any) -> list[int | str]:
    """The path in the file of pydantic's location, without the union tags that it contains."""
    path: list[int | str] = []
    node = data
    for index, part in enumerate(location):
        last = index == len(location) - 1
        if isinstance(node, dict) and part not in node and (part == node.get("kind") or not last):
            continue
        path.append(part)
        node = _child(node, part)
    return path


def _child(node: Any, part: int | str) -> Any:
    if isinstance(node, dict):
        return node.get(str(part))
    if isinstance(node, list) and isinstance(part, int) and part < len(node):
        return node[part]
    return None


def _line(path: Sequence[int | str], tree: Any) -> int | None:
    """Line of the innermost part of the path that stands in the file, counted from 1."""
    line: int | None = 1
    node = tree
    for part in path:
        try:
            mark = node.lc.key(part) if isinstance(node, Mapping) else node.lc.item(part)  # type: ignore[attr-defined]
            line = mark[0] + 1
            node = node[part]
        except (KeyError, IndexError, TypeError, AttributeError):
            break
    return line


def _dotted(path: Sequence[int | str]) -> str:
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else (f".{part}" if text else part)
    return text


def _sentence(details: ErrorDetails, path: Sequence[int | str], data: Any) -> str:
    kind = details["type"]
    context = details.get("ctx", {})
    found = details["input"]
    if kind == "extra_forbidden":
        names = sorted(_field_names(path[:-1], data))
        return f"there is no such field{_nearest(str(path[-1]), names)}"
    if kind == "missing":
        return "is missing"
    if kind in {"union_tag_invalid", "union_tag_not_found"}:
        tags = [tag.strip().strip("'") for tag in str(context.get("expected_tags", "")).split(",")]
        if kind == "union_tag_not_found":
            known = ", ".join(tags) if context.get("expected_tags") else "one of those registered"
            return f"needs a `kind:` ({known})"
        return f"there is no kind {context.get('tag')!r}{_nearest(str(context.get('tag')), tags)}"
    message = details["msg"].removeprefix("Value error, ").removeprefix("Input ")
    if kind == "value_error":
        return message
    if kind == "literal_error" and isinstance(found, str):
        options = [
            option.strip("' ") for option in str(context["expected"]).replace(" or ", ", ").split(", ")
        ]
        return f"found {found!r}{_nearest(found, options)}"
    return f"found {_shortened(found)}; it {message}"


def _nearest(name: str, candidates: Sequence[str]) -> str:
    close = difflib.get_close_matches(name, candidates, n=1, cutoff=0.6)
    allowed = ", ".join(candidates)
    return f"; did you mean {close[0]}? Allowed: {allowed}" if close else f"; allowed: {allowed}"


def _shortened(value: Any) -> str:
    try:
        text = json.dumps(value)
    except (TypeError, ValueError):
        text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _field_names(path: Sequence[int | str], data: Any) -> set[str]:
    """Names of the fields allowed at a path, for the nearest spelling."""
    model: type[Spec] | None = Scenario
    annotation: tuple[Any, Sequence[Any]] = (Scenario, ())
    node = data
    for part in path:
        if isinstance(part, str):
            if model is None or part not in model.model_fields:
                return set()
            field = model.model_fields[part]
            annotation = (field.annotation, field.metadata)
        node = _child(node, part)
        model = _model_in(*annotation, node.get("kind") if isinstance(node, dict) else None)
    return set() if model is None else set(model.model_fields)


def _model_in(annotation: Any, metadata: Sequence[Any], kind: str | None) -> type[Spec] | None:
    """The model behind a field's annotation: its own class, or the plug-in of the kind found."""
    for item in (*metadata, *getattr(annotation, "__metadata__", ())):
        if isinstance(item, Plugin):
            return specs(item.group).get(kind or "")
    for argument in get_args(annotation):
        found = _model_in(argument, (), kind)
        if found is not None:
            return found
    return annotation if isinstance(annotation, type) and issubclass(annotation, Spec) else None
