# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The usual YAML of scenario files, read by libyaml: some twenty times as fast as by a reader in Python.

PyYAML gives the events of libyaml with their lines. Only what means the same in YAML 1.1, which libyaml
reads, and in YAML 1.2 is understood here: no anchors, aliases, merge keys, tags or directives, and plain
scalars that are text, decimal numbers, dates, booleans or null. Whatever else stands in a text, errors among
it, is left to the complete reader.
"""

import re
from collections.abc import Mapping
from datetime import datetime
from typing import Any

import yaml

try:
    from yaml.cyaml import CParser
except ImportError:  # a PyYAML that was built without libyaml
    CParser = None

CONSTANTS: Mapping[str, bool | None] = {
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys(("null", "Null", "NULL", "~", ""), None),
}
"""What plain scalars stand for that are no text and no number."""

_INTEGER = re.compile(r"[-+]?(?:0|[1-9][0-9]*)")
_FLOAT = re.compile(r"[-+]?[0-9]+(?:\.[0-9]*(?:[eE][-+]?[0-9]+)?|[eE][-+]?[0-9]+)")
_TEXT = re.compile(r"[A-Za-z_/(]")
"""The beginning of plain scalars that are text, unless they are constants."""
_NO_NUMBER = re.compile(r"[-+0-9].*[^-+0-9.:_ \ta-fA-FinITNoOxXtTzZ]")
"""Plain scalars with a character that is in no number, date or time: text, such as an angle with its unit."""

_UNLIKE = re.compile("[\t\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\ufeff\ud800-\udfff]")
"""Characters that YAML 1.1 and 1.2, or two readers of them, take differently."""

_DATE = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2}Z")
"""The usual form of a date, which is handed on as text."""


class UnusualError(Exception):
    """The text has something that is left to the complete reader."""


class LinedDict(dict[str, Any]):
    """A mapping that knows the line of each of its keys.

    Attributes:
        lines: key -> line, counted from 0.
    """

    __slots__ = ("lines",)

    def __init__(self) -> None:
        super().__init__()
        self.lines: dict[str, int] = {}


class LinedList(list[Any]):
    """A list that knows the line of each of its entries.

    Attributes:
        lines: counted from 0.
    """

    __slots__ = ("lines",)

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[int] = []


def read_usual(text: str, maximum_values: int, maximum_depth: int) -> Any:
    """The tree of a text of the usual form.

    Args:
        text: YAML.
        maximum_values: keys, values, lists and mappings altogether.
        maximum_depth: levels of lists and mappings within each other.

    Returns:
        Of lists, mappings and plain data; every list and mapping knows its lines.

    Raises:
        UnusualError: the text has another form, passes a limit, or is not YAML.
    """
    if _UNLIKE.search(text) or CParser is None:
        raise UnusualError
    try:
        return _Reader(text, maximum_values, maximum_depth).document()
    except (yaml.YAMLError, ValueError) as error:
        raise UnusualError from error


class _Reader:
    """Builds a tree from the events of one document."""

    def __init__(self, text: str, maximum_values: int, maximum_depth: int) -> None:
        self._next = CParser(text).get_event
        self._values = maximum_values
        self._depth = maximum_depth

    def document(self) -> Any:
        """The tree of the only document."""
        self._expect(yaml.StreamStartEvent)
        start = self._expect(yaml.DocumentStartEvent)
        if start.version is not None or start.tags:
            raise UnusualError
        tree = self._node(self._next(), 0)
        self._expect(yaml.DocumentEndEvent)
        self._expect(yaml.StreamEndEvent)
        return tree

    def _expect(self, kind: type) -> Any:
        event = self._next()
        if type(event) is not kind:
            raise UnusualError
        return event

    def _node(self, event: Any, depth: int) -> Any:
        """What begins with an event, read to its end."""
        self._values -= 1
        if self._values < 0 or depth > self._depth or getattr(event, "anchor", "none") is not None:
            raise UnusualError
        if event.tag is not None:
            raise UnusualError
        if type(event) is yaml.ScalarEvent:
            return _scalar(event)
        if depth == self._depth:
            raise UnusualError
        return self._mapping(depth) if type(event) is yaml.MappingStartEvent else self._list(depth)

    def _mapping(self, depth: int) -> LinedDict:
        found = LinedDict()
        while type(event := self._next()) is not yaml.MappingEndEvent:
            key = self._node(event, depth + 1)
            # A key twice is an error, and one that is no text, a date too, is none of a field.
            if type(key) is not str or key != event.value or key in found:
                raise UnusualError
            found.lines[key] = event.start_mark.line
            found[key] = self._node(self._next(), depth + 1)
        return found

    def _list(self, depth: int) -> LinedList:
        found = LinedList()
        while type(event := self._next()) is not yaml.SequenceEndEvent:
            found.lines.append(event.start_mark.line)
            found.append(self._node(event, depth + 1))
        return found


def _scalar(event: Any) -> Any:
    """What a scalar means in YAML 1.2."""
    text: str = event.value
    if not event.implicit[0]:
        # In quotes, or a block of text.
        return text
    if text in CONSTANTS:
        return CONSTANTS[text]
    if _TEXT.match(text) or _NO_NUMBER.match(text):
        return text
    if _INTEGER.fullmatch(text):
        return int(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _DATE.fullmatch(text):
        return datetime.fromisoformat(text).isoformat()
    raise UnusualError
