# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Anything at all as a scenario: the loader answers with a scenario or sentences, soon, in little memory.

What it accepts is then shown and advised on, which has to succeed too. Some two hundred examples, always
the same, are tried with the other tests, so that what is mended stays so; ten thousand others, in a
quarter of an hour, by `SATFORM_FUZZ=10000 ./tools/satform test tests/fuzz/test_scenario_fuzz.py`.
"""

import copy
import json
import math
import os
import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flights import SCENARIOS
from satform.scenario import Scenario, ScenarioError, load_scenario, parse_scenario
from satform.scenario.text_file import MAXIMUM_PROBLEMS
from satform.scenario.yaml_reader import plain, read_tree
from satform_tools import console
from satform_tools.check import warnings
from satform_tools.describe import scenario as describe_scenario

ASKED = int(os.environ.get("SATFORM_FUZZ", "0"))
FILES = sorted(SCENARIOS.glob("*.yaml"))
DATA = [plain(read_tree(file.read_text(), str(file))) for file in FILES]
BYTES = [file.read_bytes() for file in FILES]

SECONDS = 120
"""After which an example counts as a hang, on however loaded a machine."""
MEMORY = 2_000_000_000
"""Bytes that an example may take in addition."""


def examples(usual: int, share: float) -> settings:
    """How many examples a test tries: so many, or its share of those that were asked for."""
    return settings(
        max_examples=max(1, round(ASKED * share)) if ASKED else usual,
        derandomize=not ASKED,
        database=None,
        deadline=None,
        print_blob=True,
        suppress_health_check=list(HealthCheck),
    )


class Raw(str):
    """Text that goes into the file as it is."""

    __slots__ = ()


@contextmanager
def bounded() -> Iterator[None]:
    """Ends what hangs or takes gigabytes with an exception that no code is meant to catch."""

    def hangs(_number: int, _frame: object) -> None:
        raise KeyboardInterrupt(f"no answer within {SECONDS} s")

    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    handler = signal.signal(signal.SIGALRM, hangs)
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, before[1]))
    signal.alarm(SECONDS)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, handler)
        resource.setrlimit(resource.RLIMIT_AS, before)


def judge(read: Any) -> None:
    """Fail unless what `read` gives is sentences, or a scenario that can be shown."""
    refused: ScenarioError | None = None
    with bounded():
        try:
            scenario: Scenario = read()
        except ScenarioError as error:
            refused = error
        else:
            warnings(scenario)
            json.loads(console.to_json(describe_scenario.describe(scenario)))
            assert parse_scenario(scenario.to_json()).digest() == scenario.digest()
    if refused is not None:
        assert 0 < len(refused.problems) <= MAXIMUM_PROBLEMS + 1
        assert all(problem.sentence.strip() for problem in refused.problems)
        assert len(str(refused)) < 1_000_000


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


def scenario_text(data: dict[str, Any]) -> str:
    return "".join(f"{written(key)}: {written(value)}\n" for key, value in data.items())


def places(node: Any) -> list[tuple[Any, Any]]:
    """Every place of a tree: a dict or list and the key or index in it."""
    keys = list(node) if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
    return [place for key in keys for place in [(node, key), *places(node[key])]]


def nested(depth: int) -> Raw:
    return Raw("[" * depth + "]" * depth)


def laughs(levels: int) -> Raw:
    """Lists of aliases of lists of aliases."""
    lines = ["&a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"&a{level} [{', '.join([f'*a{level - 1}'] * 9)}]" for level in range(1, levels)]
    return Raw(f"[{', '.join(lines)}]")


KINDS = sorted({str(node["kind"]) for data in DATA for node, key in places(data) if key == "kind"})
FIELDS = sorted({str(key) for data in DATA for node, key in places(data) if isinstance(node, dict)})
EXTREME = [0.0, -0.0, 5e-324, 1e-308, 1e-300, 1e-160, 1e-30, 1e-15, 1e-9, 1e-6, 0.5, 1.0, 2.0, 3600.0]
EXTREME += [1e6, 1e9, 9.9e14, 1e15, 1e16, 1e160, 1.7e308, math.inf, math.nan]
RAW = r"""
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
RAW += ["0x" + "f" * 5000, "9" * 5000, "1" + "0" * 400, "'" + "é" * 9000 + "'", "'\x85'", "\u2028"]
NUMBERS = st.one_of(
    st.sampled_from(EXTREME).flatmap(lambda number: st.sampled_from([number, -number])),
    st.floats(),
    st.integers(-(2**70), 2**70),
    st.integers(-3, 12),
)
VALUES = st.one_of(
    NUMBERS,
    st.none(),
    st.booleans(),
    st.sampled_from(KINDS),
    st.sampled_from(FIELDS),
    st.text(max_size=30),
    st.sampled_from(RAW).map(Raw),
    st.integers(1, 3000).map(nested),
    st.integers(2, 40).map(laughs),
    st.lists(NUMBERS, max_size=5),
    st.just([]),
    st.just({}),
    st.sampled_from(KINDS).map(lambda kind: {"kind": kind}),
    st.integers(0, 300).map(lambda count: [0.0] * count),
)


@st.composite
def changed_scenarios(draw: st.DrawFn) -> str:
    """The text of a shipped scenario after a few changes to its data."""
    data = copy.deepcopy(draw(st.sampled_from(DATA)))
    # What makes a scenario hang is looked for, not how long a flight may be worth its time.
    for _ in range(draw(st.integers(1, 4))):
        everywhere = places(data)
        node, key = everywhere[draw(st.integers(0, len(everywhere) - 1))]
        change = draw(
            st.sampled_from(["number", "number", "value", "value", "graft", "drop", "add", "repeat", "key"])
        )
        if change == "number":
            numbers = [
                (n, k) for n, k in everywhere if isinstance(n[k], int | float) and not isinstance(n[k], bool)
            ]
            if numbers:
                node, key = numbers[draw(st.integers(0, len(numbers) - 1))]
                node[key] = draw(NUMBERS)
        elif change == "value":
            node[key] = draw(VALUES)
        elif change == "graft":
            other = draw(st.sampled_from(DATA))
            same = [n[k] for n, k in places(other) if k == key] or [other]
            node[key] = copy.deepcopy(draw(st.sampled_from(same)))
        elif change == "drop":
            del node[key]
        elif change == "add" and isinstance(node, dict):
            node[
                draw(st.one_of(st.sampled_from(FIELDS), st.text(max_size=9), st.sampled_from(RAW).map(Raw)))
            ] = draw(VALUES)
        elif change == "repeat" and isinstance(node, list):
            node.extend(copy.deepcopy(node[key]) for _ in range(draw(st.integers(1, 30))))
        elif change == "key" and isinstance(node, dict):
            node[draw(st.sampled_from(RAW).map(Raw))] = node.pop(key)
    return scenario_text(data)


SNIPPETS = [
    b"\x00",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"\xc3",
    b"\xed\xa0\x80",
    b"\t",
    b"\r",
    b"\x85",
    b"&a ",
    b"*a ",
    b"!!x ",
]
SNIPPETS += [
    b"---\n",
    b"...\n",
    b"%YAML 1.1\n",
    b"%TAG ! tag:x\n",
    b"<<: ",
    b"? ",
    b"- " * 60,
    b"[" * 4000,
    b"{a: " * 40,
]
SNIPPETS += [
    b"9" * 6000,
    b"0x" + b"f" * 6000,
    b"1e999",
    b"x" * 100_000,
    b" " * 50_000,
    b"#" * 50_000,
    b"\n" * 5000,
    b"'",
    b'"',
]
SNIPPETS += [
    b": ",
    b"|\n",
    b">\n",
    b"\xe2\x80\xa8",
    b"\xf4\x90\x80\x80",
    b"{",
    b"]",
    b",",
    b"@",
    b"`",
    b"a: " * 50,
]


@st.composite
def broken_bytes(draw: st.DrawFn) -> bytes:
    """A shipped file with some of its bytes flipped, cut, doubled or replaced."""
    text = bytearray(draw(st.sampled_from(BYTES)))
    for _ in range(draw(st.integers(1, 6))):
        place = draw(st.integers(0, max(0, len(text) - 1)))
        change = draw(st.sampled_from(["flip", "cut", "insert", "random", "truncate", "double"]))
        if change == "flip" and text:
            text[place] ^= 1 << draw(st.integers(0, 7))
        elif change == "cut":
            del text[place : place + draw(st.integers(1, 200))]
        elif change == "insert":
            text[place:place] = draw(st.sampled_from(SNIPPETS))
        elif change == "random":
            text[place : place + 8] = draw(st.binary(max_size=20))
        elif change == "truncate":
            del text[place:]
        else:
            text[place:place] = text[place : place + 300]
    return bytes(text)


@examples(100, 0.5)
@given(changed_scenarios())
def test_a_scenario_changed_anyhow_is_read_or_refused_in_sentences(text: str) -> None:
    judge(lambda: parse_scenario(text))


@examples(60, 0.35)
@given(broken_bytes())
def test_a_file_damaged_anyhow_is_read_or_refused_in_sentences(
    tmp_path_factory: pytest.TempPathFactory, content: bytes
) -> None:
    file = tmp_path_factory.getbasetemp() / "damaged.yaml"
    file.write_bytes(content)
    judge(lambda: load_scenario(file))


@examples(40, 0.1)
@given(
    st.sampled_from(FILES),
    st.one_of(
        st.text(max_size=40),
        st.tuples(
            st.lists(
                st.one_of(st.sampled_from(FIELDS), st.integers(-1, 9).map(str), st.text(max_size=3)),
                max_size=4,
            ),
            VALUES,
        ).map(lambda parts: f"{'.'.join(parts[0])}={written(parts[1])}"),
    ),
)
def test_a_setting_of_any_kind_is_laid_over_or_refused_in_sentences(file: Path, change: str) -> None:
    judge(lambda: load_scenario(file, [change]))


@examples(30, 0.05)
@given(
    st.one_of(
        st.binary(max_size=300), st.text(max_size=300).map(lambda text: text.encode("utf-8", "surrogatepass"))
    )
)
def test_bytes_of_any_kind_are_refused_in_sentences(
    tmp_path_factory: pytest.TempPathFactory, content: bytes
) -> None:
    file = tmp_path_factory.getbasetemp() / "any.yaml"
    file.write_bytes(content)
    judge(lambda: load_scenario(file))
