# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""YAML text as plain data, with the line of each value: the one reader of files, settings and parameters."""

import functools
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, ReusedAnchorWarning
from ruamel.yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent, NodeEvent
from ruamel.yaml.parser import RoundTripParser

from satform.common.spec import FieldPath
from satform.scenario.errors import Problem, ScenarioError
from satform.scenario.yaml_events import LinedDict, LinedList, UnusualError, read_usual

MAXIMUM_VALUES = 100_000
"""Keys, values, lists and mappings altogether, aliases expanded: a tenth of a millisecond each."""

MAXIMUM_DEPTH = 30
"""Levels of lists and mappings within each other, aliases expanded."""

_SHORT_TEXT = 20_000
"""Characters of a text whose tree is small enough to be kept; nothing changes a tree."""

_LARGEST_INTEGER = 2**64
"""In magnitude; nothing in a scenario is a larger whole number, and Python refuses to print the largest."""


def read_tree(text: str, file: str) -> Any:
    """The tree of a YAML text: mappings and lists that know their lines.

    Aliases and merge keys are expanded; what they expand to counts towards the limits.

    Args:
        text: YAML 1.2.
        file: the name to use in messages.

    Returns:
        The tree, which is not to be changed.

    Raises:
        ScenarioError: the text is not YAML, or expands to more than is allowed.
    """
    return _read(text, file) if len(text) > _SHORT_TEXT else _read_once(text, file)


def read_mapping(text: str, file: str, what: str) -> Mapping[str, Any]:
    """The tree of a YAML text that has to be a mapping of fields; as `read_tree`.

    Args:
        text: YAML 1.2.
        file: the name to use in messages.
        what: what the message says that it has to be, with some of its fields.

    Raises:
        ScenarioError: the text is not YAML, expands to more than is allowed, or is no mapping.
    """
    tree = read_tree(text, file)
    if isinstance(tree, Mapping):
        return tree
    written = "nothing" if tree is None else "a list" if isinstance(tree, list) else found(tree)
    raise ScenarioError([Problem(file, 1, "", f"{what}; found {written}")])


def read_value(text: str, source: str) -> Any:
    """One value as people type it, with the rules of a scenario file: `1e3`, `[1, 2.5e-1, 3]`, `true`.

    Args:
        text: the value as YAML 1.2.
        source: where it was typed, for messages.

    Returns:
        Plain data.

    Raises:
        ScenarioError: the text is not YAML.
    """
    return plain(read_tree(text, source))


@functools.lru_cache(maxsize=64)
def _read_once(text: str, file: str) -> Any:
    """The tree of a text that was read before, as by a campaign, whose runs differ in a few settings."""
    return _read(text, file)


def _read(text: str, file: str) -> Any:
    """The tree of a text: by the fast reader where it has the usual form."""
    try:
        return read_usual(text, MAXIMUM_VALUES, MAXIMUM_DEPTH)
    except UnusualError:
        return read_any(text, file)


def read_any(text: str, file: str) -> Any:
    """The tree of any text by the complete reader, which has a sentence about every error; as `read_tree`."""
    try:
        reader = YAML(typ="rt", pure=True)
        reader.Parser = functools.partial(_CheckedParser, file)
        with warnings.catch_warnings():
            # An alias means the latest anchor of its name, as YAML has it.
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


@dataclass
class _Open:
    """A list or mapping whose end has not been read.

    Attributes:
        anchor: its name; None when it has none.
        before: values that were counted before it.
        height: levels below it, so far.
    """

    anchor: str | None
    before: int
    height: int = 0


class _CheckedParser(RoundTripParser):
    """Refuses while reading what would expand to too much, before anything is built of it.

    The size and the height of everything that has an anchor are kept when it ends, so that an alias adds
    what it stands for in constant time, however much that is.
    """

    def __init__(self, file: str, loader: YAML) -> None:
        super().__init__(loader=loader)
        self._file = file
        self._values = 0
        self._open: list[_Open] = []
        self._named: dict[str, tuple[int, int]] = {}

    def get_event(self) -> Any:
        event = super().get_event()
        sentence = self._counted(event) or self._beyond()
        if sentence:
            raise ScenarioError([Problem(self._file, event.start_mark.line + 1, "", sentence)])
        return event

    def _counted(self, event: Any) -> str:
        """Count what an event adds; gives what is wrong with it, empty when nothing is."""
        if isinstance(event, CollectionEndEvent):
            ended = self._open.pop()
            self._record_depth(ended.height + 1)
            if ended.anchor is not None:
                self._named[ended.anchor] = (self._values - ended.before, ended.height + 1)
        elif isinstance(event, AliasEvent):
            if any(outer.anchor == event.anchor for outer in self._open):
                return f"the alias *{event.anchor} stands within what it stands for, without an end"
            values, height = self._named.get(event.anchor, (1, 0))
            self._values += values
            self._record_depth(height)
        elif isinstance(event, NodeEvent):
            if isinstance(event, CollectionStartEvent):
                self._open.append(_Open(event.anchor, self._values))
            elif event.anchor is not None:
                self._named[event.anchor] = (1, 0)
            self._values += 1
        return ""

    def _record_depth(self, height: int) -> None:
        if self._open:
            self._open[-1].height = max(self._open[-1].height, height)

    def _beyond(self) -> str:
        """Which limit has been passed, in words; empty when none has."""
        if len(self._open) + (self._open[-1].height if self._open else 0) > MAXIMUM_DEPTH:
            return f"is nested more than {MAXIMUM_DEPTH} levels deep"
        if self._values > MAXIMUM_VALUES:
            return f"there are more than {MAXIMUM_VALUES} values; a scenario has fewer"
        return ""


def line_of(path: FieldPath, tree: Any) -> int | None:
    """Line of the innermost part of a path that stands in a tree, counted from 1.

    Args:
        path: of keys and places in lists.
        tree: from `read_tree`. What an alias or a merge key brings has the line where it is written.
    """
    line: int | None = 1
    node = tree
    for part in path:
        try:
            line = _line_in(node, part) or line
            node = node[part]
        except (KeyError, IndexError, TypeError, AttributeError):
            break
    return line


def _line_in(node: Any, part: int | str) -> int | None:
    """Line of a key or an entry; None where the node has none of that name."""
    if isinstance(node, LinedDict):
        return node.lines[str(part)] + 1 if part in node.lines else None
    if isinstance(node, LinedList):
        return node.lines[part] + 1 if isinstance(part, int) else None
    if not isinstance(node, Mapping):
        return int(node.lc.item(part)[0]) + 1
    try:
        return int(node.lc.key(part)[0]) + 1  # type: ignore[attr-defined]
    except KeyError:
        merged = (_line_in(other, part) for other in getattr(node, "merge", ()) if part in other)
        return next(merged, None)


def plain(node: Any) -> Any:
    """The YAML tree without its layout: dicts, lists, strings, plain numbers; nothing is shared."""
    if isinstance(node, Mapping):
        return {_text(str(key)): plain(value) for key, value in node.items()}
    if isinstance(node, list | tuple | set):
        return [plain(value) for value in node]
    if isinstance(node, bool) or node is None:
        return node
    if isinstance(node, int) and abs(node) > _LARGEST_INTEGER:
        return float(node) if abs(node) < 10**300 else math.copysign(math.inf, 1 if node > 0 else -1)
    for kind in (int, float):
        if isinstance(node, kind):
            return kind(node)
    return _text(str(node))


def _text(text: str) -> str:
    r"""Text that can be written down: escapes such as \ud800 stand for halves of a character only."""
    if text.isascii():
        return text
    return text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")


def found(value: Any) -> str:
    """A value as messages show it, shortened."""
    # Python does not print the largest numbers.
    text = str(plain(value))
    return repr(text if len(text) <= 60 else text[:57] + "...")
