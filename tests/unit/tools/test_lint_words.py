# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The word list finds its words in names and sentences, and not within other words."""

import ast
import importlib.util
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[3] / "tools" / "lint" / "words.py"
SPEC = importlib.util.spec_from_file_location("words", SCRIPT)
assert SPEC is not None
assert SPEC.loader is not None
words = importlib.util.module_from_spec(SPEC)
sys.modules["words"] = words
SPEC.loader.exec_module(words)


@pytest.mark.parametrize(
    ("name", "term"),
    [
        ("say_status", "publish, send"),
        ("SpeakerList", "sender, publisher"),
        ("heardBefore", "subscribe, receive"),
        ("_LIARS", "Byzantine"),
        ("lap", "period, revolution"),
        ("overlap", ""),
        ("wording", ""),
        ("essay", ""),
        ("placement", ""),
        ("early_end", ""),
    ],
)
def test_a_word_of_the_list_is_found_as_a_part_of_a_name_only(name: str, term: str) -> None:
    assert words.in_name(name) == term


def test_names_are_those_of_classes_functions_arguments_and_attributes() -> None:
    module = ast.parse(
        """
LIMIT: int = 3
class Ears:
    field: float = 0.0
    def hear(self, word, *, told=None):
        local = word
        self.voice = local
"""
    )
    found = dict(words.names_of_module(module))
    assert found.keys() == {"LIMIT", "Ears", "field", "hear", "self", "word", "told", "voice"}
    assert (found["Ears"], found["voice"]) == (3, 7)


def test_comments_and_strings_of_python_are_read_and_its_code_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.py").write_text(
        'hears = 1  # first\ntext = """second\nthird"""\nshown = f"fourth {hears}"\n'
    )
    monkeypatch.setattr(words, "ROOT", tmp_path)
    text = "\n".join(f"{number}:{line}" for line, number in words.sentences("a.py"))
    for number, word in ((1, "first"), (2, "second"), (3, "third"), (4, "fourth")):
        assert any(line.startswith(f"{number}:") and word in line for line in text.splitlines())
    assert not any(line.startswith("1:") and "hears" in line for line in text.splitlines())


def test_every_allowed_name_has_a_reason_and_a_word_of_the_list() -> None:
    for name, reason in words.ALLOWED_NAMES.items():
        assert reason
        assert set(words.words_of(name)) & words.INSTEAD.keys(), f"{name} needs no permission"


def test_every_word_allowed_in_a_file_has_a_reason_and_is_there() -> None:
    for path, (allowed, reason) in words.ALLOWED_WORDS.items():
        assert reason
        text = " ".join(line for line, _ in words.sentences(path)).lower()
        missing = {word for word in allowed if f'"{word}"' not in text}
        assert not missing, f"{path} needs no permission for {missing}"
