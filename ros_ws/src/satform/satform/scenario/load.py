"""From a YAML file to a `Scenario`, or to all that is wrong with it."""

import functools
import math
import warnings
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, ReusedAnchorWarning
from ruamel.yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent, NodeEvent
from ruamel.yaml.parser import RoundTripParser

from satform.scenario.errors import Problem, ScenarioError
from satform.scenario.model import Scenario
from satform.scenario.sentences import Path as FieldPath
from satform.scenario.sentences import coerced, problems
from satform.scenario.shortened import beyond_the_end, left_out, within_the_end

MAXIMUM_FILE_BYTES = 2_000_000
"""A larger scenario file is refused unread; half a megabyte holds a thousand satellites."""

MAXIMUM_VALUES = 100_000
"""Keys, values, lists and mappings altogether: a tenth of a millisecond each."""

MAXIMUM_DEPTH = 30
"""Levels of lists and mappings within each other."""

MAXIMUM_PROBLEMS = 200
"""Said at once; nobody reads more before mending these."""

_SHORT_TEXT = 20_000
"""Characters of a text whose tree is small enough to be kept; nothing changes a tree."""

_LARGEST_INTEGER = 2**64
"""In magnitude; nothing in a scenario is a larger whole number, and Python refuses to print the largest."""


def load_scenario(
    path: str | Path, changes: Iterable[str] = (), remark: Callable[[str], None] | None = None
) -> Scenario:
    """Read and check a scenario file.

    Args:
        path: the YAML file.
        changes: `key=value` settings laid over the file, with dotted keys and YAML values, for
            example `timing.step=1.0` or `satellites.0.arc_length=100.0`. Where they shorten the
            flight, what the file expects, breaks or changes beyond its new end is left out.
        remark: called with a sentence about what was left out.

    Returns:
        The scenario, complete and consistent.

    Raises:
        ScenarioError: the file cannot be read or cannot fly; all problems at once.
    """
    file = str(path)
    try:
        size = Path(path).stat().st_size
        if size > MAXIMUM_FILE_BYTES:
            raise ScenarioError([Problem(file, None, "", _too_large(size))])
        text = Path(path).read_bytes().decode()
    except OSError as error:
        raise ScenarioError([Problem(file, None, "", f"cannot be read: {error.strerror}")]) from None
    except UnicodeDecodeError as error:
        sentence = f"is not UTF-8 text: byte {error.object[error.start]:#04x} at offset {error.start}"
        raise ScenarioError([Problem(file, None, "", sentence)]) from None
    except ValueError:
        raise ScenarioError([Problem(file, None, "", "is not a possible file name")]) from None
    return parse_scenario(text, file, changes, remark)


def parse_scenario(
    text: str,
    file: str = "<text>",
    changes: Iterable[str] = (),
    remark: Callable[[str], None] | None = None,
) -> Scenario:
    """Check the text of a scenario.

    Args:
        text: YAML 1.2.
        file: the name to use in messages.
        changes: as for `load_scenario`.
        remark: as for `load_scenario`.

    Returns:
        The scenario, complete and consistent.

    Raises:
        ScenarioError: the text cannot fly; all problems at once.
    """
    if len(text) > MAXIMUM_FILE_BYTES:
        raise ScenarioError([Problem(file, None, "", _too_large(len(text)))])
    tree = _read_yaml(text, file) if len(text) > _SHORT_TEXT else _read_once(text, file)
    if not isinstance(tree, Mapping):
        what = "nothing" if tree is None else "a list" if isinstance(tree, list) else _found(tree)
        sentence = f"a scenario is a mapping of fields such as name, orbit, satellites; found {what}"
        raise ScenarioError([Problem(file, 1, "", sentence)])
    data = _plain(tree)
    written = _plain(tree)
    changed = _apply_changes(data, changes)
    beyond = beyond_the_end(written, data, changed)
    flown = within_the_end(data, beyond)
    scenario, found = _checked(flown, tree, file, changed)
    if found and beyond:
        # Found once more in the whole, where every problem has the place that the file gives it.
        outside = {f"{field}[{place}]" for field, places in beyond.items() for place in places}
        _, every = _checked(data, tree, file, changed)
        found = [problem for problem in every if not problem.field.startswith(tuple(outside))] or found
    if scenario is None or found:
        raise ScenarioError(_first(sorted(found, key=lambda problem: problem.line or 0)))
    if remark is not None:
        for sentence in left_out(beyond):
            remark(sentence)
    return scenario


def _too_large(size: int) -> str:
    return f"the file has {size} bytes; a scenario has at most {MAXIMUM_FILE_BYTES}"


def _first(found: list[Problem]) -> list[Problem]:
    left = len(found) - MAXIMUM_PROBLEMS
    if left <= 0:
        return found
    more = Problem(found[0].file, None, "", f"and {left} more; mend these first")
    return [*found[:MAXIMUM_PROBLEMS], more]


def _checked(
    data: Any, tree: Any, file: str, changed: Mapping[FieldPath, str]
) -> tuple[Scenario | None, list[Problem]]:
    """The scenario, unless the model refuses it, and all that is wrong."""
    try:
        scenario = Scenario.model_validate(data)
    except ValidationError as error:
        every = error.errors(include_url=False)
        return None, [
            problem for details in every for problem in problems(details, data, tree, file, changed)
        ]
    return scenario, coerced(data, scenario.model_dump(exclude_unset=True), tree, file, changed)


@functools.lru_cache(maxsize=64)
def _read_once(text: str, file: str) -> Any:
    """The tree of a text that was read before, as by a campaign, whose runs differ in a few settings."""
    return _read_yaml(text, file)


def _read_yaml(text: str, file: str) -> Any:
    try:
        reader = YAML(typ="rt", pure=True)
        reader.Parser = functools.partial(_CheckedParser, file)
        with warnings.catch_warnings():
            # An anchor without aliases says nothing, given twice too.
            warnings.simplefilter("ignore", ReusedAnchorWarning)
            tree = reader.load(text)
    except ScenarioError:
        raise
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        words = error.problem or error.context or "it cannot be understood"
        # Only together with what was going on does "but found" mean something.
        words = f"{error.context}, {words}" if error.context and words.startswith("but ") else words
        sentence = f"is not YAML: {words}"
        line = None if mark is None else mark.line + 1
        raise ScenarioError([Problem(file, line, "", sentence.replace("\n", " "))]) from None
    except Exception as error:  # the reader was made by others, and anything may come of what it is given
        words = str(error).splitlines()[0] if str(error) else repr(error)
        sentence = f"is not YAML that can be read here: {words[:200]}"
        raise ScenarioError([Problem(file, None, "", sentence)]) from None
    return tree


class _CheckedParser(RoundTripParser):
    """Refuses on its way what would be slow to read, or would say one thing in two places."""

    def __init__(self, file: str, loader: YAML) -> None:
        super().__init__(loader=loader)
        self._file = file
        self._depth = 0
        self._values = 0

    def get_event(self) -> Any:
        event = super().get_event()
        self._depth += isinstance(event, CollectionStartEvent) - isinstance(event, CollectionEndEvent)
        self._values += isinstance(event, NodeEvent)
        sentence = None
        if isinstance(event, AliasEvent):
            sentence = "aliases (*name) are not used in scenarios; every_satellite holds what is shared"
        elif self._depth > MAXIMUM_DEPTH:
            sentence = f"is nested more than {MAXIMUM_DEPTH} levels deep"
        elif self._values > MAXIMUM_VALUES:
            sentence = f"there are more than {MAXIMUM_VALUES} values; a scenario has fewer"
        if sentence is not None:
            raise ScenarioError([Problem(self._file, event.start_mark.line + 1, "", sentence)])
        return event


def _found(value: Any) -> str:
    # Python does not print the largest numbers.
    text = str(_plain(value))
    return repr(text if len(text) <= 60 else text[:57] + "...")


def _plain(node: Any) -> Any:
    """The YAML tree without its layout: dicts, lists, strings, plain numbers."""
    if isinstance(node, Mapping):
        return {_text(str(key)): _plain(value) for key, value in node.items()}
    if isinstance(node, list | tuple | set):
        return [_plain(value) for value in node]
    if isinstance(node, bool) or node is None:
        return node
    if isinstance(node, int) and abs(node) > _LARGEST_INTEGER:
        return float(node) if abs(node) < 10**300 else math.copysign(math.inf, 1 if node > 0 else -1)
    for plain in (int, float):
        if isinstance(node, plain):
            return plain(node)
    return _text(str(node))


def _text(text: str) -> str:
    r"""Text that can be written down: escapes such as \ud800 stand for halves of a character only."""
    if text.isascii():
        return text
    return text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")


def _apply_changes(data: Any, changes: Iterable[str]) -> dict[FieldPath, str]:
    """Lay settings over a scenario's data; gives each setting by the path that it has changed."""
    changed: dict[FieldPath, str] = {}
    complaints = []
    for change in changes:
        outcome = _apply_change(data, change)
        if isinstance(outcome, str):
            complaints.append(Problem(f"--set {change}", None, "", outcome))
        else:
            changed[outcome] = change
    if complaints:
        raise ScenarioError(complaints)
    return changed


def _apply_change(data: Any, change: str) -> FieldPath | str:
    """The path that was changed, or why it could not be."""
    key, equals, text = change.partition("=")
    if not equals or not key:
        return "is not of the form key=value, such as timing.step=1.0"
    try:
        value = _plain(_read_yaml(text, f"--set {change}"))
    except ScenarioError as error:
        return f"the value {_found(text)}: {error.problems[0].sentence}"
    path: list[int | str] = []
    node = data
    *parents, last = key.split(".")
    for part in parents:
        step = _step(node, part)
        if step is None:
            return f"there is no {'.'.join(map(str, [*path, part]))} in the scenario"
        path.append(step)
        if isinstance(node, dict) and node.get(part) is None:
            node[part] = {}
        node = node[step]
    step = _step(node, last)
    if step is None:
        return f"there is no {key} in the scenario"
    node[step] = value
    return (*path, step)


def _step(node: Any, part: str) -> int | str | None:
    """The part of a dotted key as a key or index of a node; None where the node has no such place."""
    if isinstance(node, dict):
        return part
    # Digits of other scripts are digits too, and the longest numbers are refused by Python.
    number = isinstance(node, list) and part.isascii() and part.isdigit() and len(part) < 9
    if number and int(part) < len(node):
        return int(part)
    return None
