# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Damaged YAML: the data of a whole file with changed numbers, values, keys and structure, written anew."""

import copy
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from random import Random
from typing import Any

Place = tuple[Any, Any]
"""A dict or list, and the key or index in it."""


class Raw(str):
    """Text that goes into the file as it is."""

    __slots__ = ()


EXTREME = (0.0, -0.0, 5e-324, 1e-308, 1e-300, 1e-160, 1e-30, 1e-15, 1e-9, 1e-6, 0.5, 1.0, 2.0, 3600.0)
EXTREME += (1e6, 1e9, 9.9e14, 1e15, 1e16, 1e160, 1.7e308, math.inf, math.nan)

_LINES = r"""
1e999
-1e999
0o777
1_000
+.inf
~
2001-99-99
2001-01-01
2001-01-01T00:00:00Z
=
<<
yes
!!int x
!!float 1.0
!!str 1
!!null x
! 1
!!python/object/apply:os.system [ls]
!!binary QUFB
!!binary =
!!set {a, b}
!!omap [a: 1]
!x y
&a 1
*a
*unknown
&a [*a]
{<<: {a: 1}}
{<<: [{a: 1}, {a: 2}]}
{<<: 1}
{a: 1, a: 2}
{1: a, '1': b}
{? [a] : b}
{? {a: b} : c}
{null: 1}
{.nan: 1}
{true: 1}
!!timestamp x
!!map [a]
!!seq {a: b}
!!bool 7
!!pairs [a: 1, a: 2]
!!python/tuple [1]
"\ud800"
"\x00"
"\U0010ffff"
| text
%YAML 1.1
- 1
? a
1:30
0b11
0777
""".strip().splitlines()
_LONG = ("0x" + "f" * 5000, "9" * 5000, "1" + "0" * 400, "'" + "é" * 9000 + "'", "'\x85'", "\u2028")
RAW = tuple(map(Raw, (*_LINES, *_LONG)))
"""Scalars, tags, aliases and keys at which readers of YAML differ."""

SNIPPETS = (b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\xc3", b"\xed\xa0\x80", b"\t", b"\r", b"\x85", b"&a ")
SNIPPETS += (
    b"*a ",
    b"!!x ",
    b"---\n",
    b"...\n",
    b"%YAML 1.1\n",
    b"%TAG ! tag:x\n",
    b"<<: ",
    b"? ",
    b"- " * 60,
)
SNIPPETS += (b"[" * 4000, b"{a: " * 40, b"9" * 6000, b"0x" + b"f" * 6000, b"1e999", b"x" * 100_000)
SNIPPETS += (b" " * 50_000, b"#" * 50_000, b"\n" * 5000, b"'", b'"', b": ", b"|\n", b">\n", b"\xe2\x80\xa8")
SNIPPETS += (b"\xf4\x90\x80\x80", b"{", b"]", b",", b"@", b"`", b"a: " * 50)
"""Bytes that mean something in YAML, or too much of them."""


def written(value: Any) -> str:
    """A value as YAML on one line."""
    if isinstance(value, Raw):
        return value
    if isinstance(value, dict):
        return "{" + ", ".join(f"{written(key)}: {written(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(written, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    if value is None or isinstance(value, bool | int | float):
        return json.dumps(value)
    return json.dumps(str(value))


def yaml_text(data: dict[str, Any]) -> bytes:
    """A mapping as YAML, a line for each of its fields."""
    text = "".join(f"{written(key)}: {written(value)}\n" for key, value in data.items())
    return text.encode("utf-8", "surrogatepass")


def places(node: Any) -> list[Place]:
    """Every place of a tree."""
    keys = list(node) if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
    return [place for key in keys for place in [(node, key), *places(node[key])]]


def nested(depth: int) -> Raw:
    """Lists in lists."""
    return Raw("[" * depth + "]" * depth)


def aliases(levels: int) -> Raw:
    """Lists of aliases of lists of aliases: nine to the power of the levels."""
    lines = ["&a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"&a{level} [{', '.join([f'*a{level - 1}'] * 9)}]" for level in range(1, levels)]
    return Raw(f"[{', '.join(lines)}]")


def text(draw: Random, most: int) -> str:
    """Text of any characters."""
    limit = draw.choice((0x7F, 0xFF, 0x2FFF, 0x10FFFF))
    return "".join(chr(draw.randint(1, limit)) for _ in range(draw.randint(0, most)))


def number(draw: Random) -> float:
    """A number, mostly an extreme one."""
    match draw.randrange(4):
        case 0 | 1:
            return draw.choice(EXTREME) * draw.choice((1, -1))
        case 2:
            return draw.randint(-3, 12)
        case _:
            return draw.choice((draw.uniform(-1e6, 1e6), draw.randint(-(2**70), 2**70)))


@dataclass(frozen=True)
class Damage:
    """What trees of one kind of file are changed with.

    Attributes:
        data: trees of whole files.
        kinds: values of their fields `kind`.
        fields: names of their fields.
    """

    data: Sequence[dict[str, Any]]
    kinds: tuple[str, ...]
    fields: tuple[str, ...]

    @classmethod
    def of(cls, data: Iterable[dict[str, Any]]) -> "Damage":
        """With the kinds and fields of some files."""
        found = list(data)
        everywhere = [place for tree in found for place in places(tree)]
        kinds = {str(node[key]) for node, key in everywhere if key == "kind"}
        fields = {str(key) for node, key in everywhere if isinstance(node, dict)}
        return cls(found, tuple(sorted(kinds)) or ("x",), tuple(sorted(fields)) or ("x",))

    def value(self, draw: Random) -> Any:
        """A value of any kind."""
        simple = (None, True, False, [], {}, draw.choice(self.kinds), draw.choice(self.fields))
        match draw.randrange(9):
            case 0 | 1:
                return number(draw)
            case 2 | 3:
                return draw.choice(simple)
            case 4:
                return draw.choice(RAW)
            case 5:
                return text(draw, 30)
            case 6:
                return draw.choice((nested(draw.randint(1, 3000)), aliases(draw.randint(2, 40))))
            case 7:
                return draw.choice(
                    ([number(draw) for _ in range(draw.randrange(6))], [0.0] * draw.randrange(300))
                )
            case _:
                return {"kind": draw.choice(self.kinds)}

    def changed(self, draw: Random, tree: dict[str, Any]) -> dict[str, Any]:
        """A copy of a tree after a few changes."""
        data = copy.deepcopy(tree)
        for _ in range(draw.choice((1, 1, 1, 2, 4))):
            everywhere = places(data)
            if not everywhere:
                break
            self._change(draw, everywhere)
        return data

    def _change(self, draw: Random, everywhere: list[Place]) -> None:
        node, key = draw.choice(everywhere)
        match draw.randrange(9):
            case 0 | 1:
                node, key = draw.choice([place for place in everywhere if _is_number(place)] or [(node, key)])
                node[key] = number(draw)
            case 2 | 3:
                node[key] = self.value(draw)
            case 4:
                node[key] = self._graft(draw, key)
            case 5:
                del node[key]
            case 6 if isinstance(node, dict):
                node[draw.choice((draw.choice(self.fields), text(draw, 9), draw.choice(RAW)))] = self.value(
                    draw
                )
            case 7 if isinstance(node, list):
                node.extend(copy.deepcopy(node[key]) for _ in range(draw.randint(1, 30)))
            case _ if isinstance(node, dict):
                node[draw.choice(RAW)] = node.pop(key)
            case _:
                node.pop(key)

    def _graft(self, draw: Random, key: Any) -> Any:
        """A value that another file has under the same name."""
        other = draw.choice(self.data)
        same = [node[own] for node, own in places(other) if own == key] or [other]
        return copy.deepcopy(draw.choice(same))

    def setting(self, draw: Random) -> str:
        """A change as `--set` takes it."""
        if draw.random() < 0.3:
            return text(draw, 40)
        parts = (draw.choice(self.fields), str(draw.randint(-1, 9)), text(draw, 3))
        path = ".".join(draw.choice(parts) for _ in range(draw.randrange(5)))
        return f"{path}={written(self.value(draw))}"


def _is_number(place: Place) -> bool:
    node, key = place
    return isinstance(node[key], int | float) and not isinstance(node[key], bool)
