# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Whatever the fast reader of YAML reads, the complete reader reads alike: values, their types, and lines."""

import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from satform.scenario.yaml_events import UnusualError, read_usual
from satform.scenario.yaml_reader import MAXIMUM_DEPTH, MAXIMUM_VALUES, line_of, plain, read_any

SCENARIOS = Path(__file__).resolve().parents[3] / "scenarios"
FILES = sorted(SCENARIOS.rglob("*.yaml"))

SCALARS = (
    *(
        "1",
        "-7",
        "+3",
        "0",
        "00",
        "010",
        "0o17",
        "0x1f",
        "1_000",
        "0b1",
        "1e3",
        "1.0e+3",
        "-2E-3",
        "1.",
        ".5",
    ),
    *(
        ".5e3",
        "+.5",
        "-.inf",
        ".nan",
        "1e",
        "e1",
        "1:30",
        "12:30:45",
        "99999999999999999999999",
        "1e400",
        "-",
    ),
    *(
        "true",
        "True",
        "tRUE",
        "yes",
        "off",
        "null",
        "~",
        "Null",
        "=",
        "<<",
        "NaN",
        "inf",
        "2024-01-01",
        "- 1",
    ),
    *(
        "2024-01-01T00:00:00Z",
        "2024-02-30T00:00:00Z",
        "2024-01-01 00:00:00",
        "2024-1-1T0:0:0Z",
        "90 deg",
        "1 %",
    ),
    *(
        "5 s: no",
        "a: b",
        "a #b",
        "a#b",
        "'it''s'",
        '"a\\tb"',
        '"\\ud800"',
        '"\\/"',
        "'",
        '"',
        "[1, 2",
        "{a: 1}",
    ),
    *(
        "{a:1}",
        "{a: }",
        "[a:b]",
        "[http://x]",
        "[,]",
        "[1,]",
        "{a, b}",
        "? a",
        "!!int 3",
        "!x",
        "&a 1",
        "*a",
        "@a",
    ),
    *(
        "`a",
        "%a",
        "|\n  a\n  b\n",
        ">-\n  a\n  b\n",
        "a\n  b",
        "é",
        "\u2028",
        "\x85",
        "a\tb",
        "\t",
        "",
        "{a: 1, a: 2}",
    ),
    *(
        "{1: a}",
        "{true: a}",
        "{[a]: b}",
        "[[[]]]",
        "(r - 1)**2",
        "-n**2*z",
        "+x",
        "1-2",
        "0-",
        "a,b",
        "1,2",
        "--- 1",
    ),
)


def fast(text: str) -> Any:
    return read_usual(text, MAXIMUM_VALUES, MAXIMUM_DEPTH)


def lines(tree: Any) -> dict[tuple[int | str, ...], int | None]:
    def below(node: Any, path: tuple[int | str, ...]) -> Iterator[tuple[int | str, ...]]:
        yield path
        pairs = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
        for key, value in pairs:
            yield from below(value, (*path, key))

    return {path: line_of(path, tree) for path in below(tree, ())}


def assert_read_alike(text: str) -> bool:
    """Whether the fast reader reads a text, which the complete one then reads alike."""
    try:
        tree = fast(text)
    except UnusualError:
        return False
    whole = read_any(text, "text")
    # Their texts tell types and signs of zero apart, too.
    assert repr(plain(tree)) == repr(plain(whole)), text
    assert lines(tree) == lines(whole), text
    return True


@pytest.mark.unmeasured
@pytest.mark.parametrize("part", range(4))
def test_shipped_files_are_of_the_usual_form(part: int) -> None:
    for file in FILES[part::4]:
        assert assert_read_alike(file.read_text(encoding="utf-8")), file.name


def test_scalars_and_flow_collections_are_read_alike_or_left_to_the_complete_reader() -> None:
    places = ("{}", "a: {}", "- {}", "a: [{}, 2]", "{{a: {}}}", "a:\n  b: {}\nc: 1", "{}: 1")
    read = [place.format(scalar) for place in places for scalar in SCALARS]
    usual = [text for text in read if assert_read_alike(text)]
    assert 0.4 * len(read) < len(usual) < 0.8 * len(read)


@pytest.mark.unmeasured
def test_damaged_files_are_read_alike_or_left_to_the_complete_reader() -> None:
    numbers = random.Random(1)
    signs = " \n:,-#'\"[]{}&*!|>?%@`~.0123456789eEtfn\t"
    short = sorted(FILES, key=lambda file: file.stat().st_size)[:4]
    usual = 0
    for file in short:
        text = file.read_text(encoding="utf-8")[:700]
        for _ in range(30):
            place, taken = numbers.randrange(len(text)), numbers.randrange(3)
            usual += assert_read_alike(text[:place] + numbers.choice(signs) + text[place + taken :])
    assert 20 < usual < 120


@pytest.mark.parametrize(
    "text",
    [
        "[" * (MAXIMUM_DEPTH + 1) + "]" * (MAXIMUM_DEPTH + 1),
        "[" * 1_000_000,
        "- 1\n" * (MAXIMUM_VALUES + 1),
        "--- 1\n--- 2\n",
        "%YAML 1.1\n--- off\n",
    ],
    ids=["deep", "bottomless", "long", "two documents", "directive"],
)
def test_what_is_beyond_the_limits_is_left_to_the_complete_reader(text: str) -> None:
    with pytest.raises(UnusualError):
        fast(text)


def test_the_deepest_text_that_is_allowed_is_read() -> None:
    assert assert_read_alike("[" * MAXIMUM_DEPTH + "]" * MAXIMUM_DEPTH)
