# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Lint step: names of the code and sentences of the docs use the terms of ROS 2 and GNC engineers.

Names are those of modules, classes, functions, arguments, attributes, message fields, scenario files,
command-line options and entry points of production code, split at underscores and capital letters. Sentences
are those of the docs, of scenarios, of comments and of strings in production code. Each finding gives the
file, the line, the word and the term to use instead.
"""

import ast
import io
import re
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

TERMS = {
    "publish, send": (
        "say",
        "says",
        "said",
        "saying",
        "speak",
        "speaks",
        "spoken",
        "tell",
        "tells",
        "telling",
    ),
    "subscribe, receive": ("hear", "hears", "heard", "hearing", "listen", "listens", "listening"),
    "sender, publisher": ("speaker", "speakers", "voice"),
    "receiver, subscriber": ("listener", "listeners", "ear", "ears", "hearsay"),
    "received, measured": ("told",),
    "estimated, validated": ("believe", "believes", "believed"),
    "message": ("word",),
    "membership manager": ("muster",),
    "batched": ("abreast",),
    "process server": ("nursery",),
    "orphaned processes": ("leftover", "leftovers"),
    "stored, retained": ("kept",),
    "Byzantine": ("liar", "liars", "lying"),
    "period, revolution": ("lap", "laps"),
    "nominal motion": ("circulation",),
    "index, row, position": ("place", "places"),
    "applied, measured": ("given",),
    "timeout": ("patience", "farewell", "silence"),
    "observer": ("looker", "whoever", "onlooker"),
    "event": ("happening", "happenings"),
    "saturated": ("clipped",),
    "below minimum impulse": ("withheld",),
    "propellant depleted": ("starved",),
    "unauthorised": ("stranger", "strangers"),
    "short-period variation, spread": ("swing", "swings"),
    "acceleration, coupling term": ("pull", "pulls", "pulled", "push", "pushes", "pushed"),
    "rate, speed": ("pace", "paces"),
    "fraction, ratio": ("share", "shares"),
    "range, extent": ("reach",),
    "raise": ("lift", "lifts", "lifted"),
}
"""Term to use -> words that it replaces."""

INSTEAD = {word: term for term, words in TERMS.items() for word in words}

ALLOWED_NAMES: dict[str, str] = {}
"""Names that contain a word of the list, each with its reason."""

_LIBRARY = "ros_ws/src/satform/satform"

ALLOWED_WORDS: dict[str, tuple[frozenset[str], str]] = {
    f"{_LIBRARY}/scenario/renamed.py": (
        frozenset({"circulation", "speaker", "listener", "liar"}),
        "former names of the scenario format, answered with the present ones",
    ),
    f"{_LIBRARY}/bag/earlier_versions.py": (
        frozenset({"listeners", "speakers", "clipped", "withheld", "starved"}),
        "fields of messages in bags of earlier versions",
    ),
    f"{_LIBRARY}/record/quantities.py": (
        frozenset({"clipped", "withheld", "starved"}),
        "labels that enter the state hash, so that equal flights keep their hash",
    ),
}
"""Words that the sentences of a file may use, with the reason."""

AMBIGUOUS = frozenset(
    {
        "say",
        "says",
        "saying",
        "said",
        "tell",
        "telling",
        "tells",
        "told",
        "word",
        "kept",
        "place",
        "places",
        "given",
    }
    | {"listen", "listens", "listening", "silence", "voice", "patience", "stranger", "strangers", "leftover"}
    | {
        "pull",
        "pulls",
        "pulled",
        "push",
        "pushes",
        "pushed",
        "share",
        "shares",
        "reach",
        "lift",
        "lifts",
        "lifted",
    }
)
"""Words of the list that sentences use in their ordinary meaning, too."""

_NAME_PARTS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_PROSE_WORDS = re.compile(
    rf"\b({'|'.join(sorted(set(INSTEAD) - AMBIGUOUS, key=len, reverse=True))})\b", re.IGNORECASE
)
_MESSAGE_FIELD = re.compile(r"^[A-Za-z][\w/\[\]<>=]*\s+(\w+)")
_ENTRY_POINT = re.compile(r'^\s*"?([a-z_]+)"?\s*=\s*"?[\w.]+:\w+')


@dataclass(frozen=True)
class Finding:
    """A word of the list.

    Attributes:
        file: path from the project's folder.
        line: from 1.
        found: name or word.
        term: to use instead.
    """

    file: str
    line: int
    found: str
    term: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.found}: use {self.term}"


def tracked(*patterns: str) -> list[str]:
    """Paths of the files under version control that match patterns of git."""
    command = ["git", "ls-files", "--", *(f":(glob){pattern}" for pattern in patterns)]
    output = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [path for path in output.splitlines() if (ROOT / path).is_file()]


def words_of(name: str) -> list[str]:
    """The words of a name, split at underscores and capital letters, in small letters."""
    return [part.lower() for part in _NAME_PARTS.findall(name)]


def in_name(name: str) -> str:
    """The term to use instead of a word in a name; empty where there is none or the name is allowed."""
    if name in ALLOWED_NAMES:
        return ""
    return next((INSTEAD[word] for word in words_of(name) if word in INSTEAD), "")


def names_of_module(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Names that a module defines outside of function bodies, arguments and attributes included."""
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                yield node.name, node.lineno
            case ast.arg():
                yield node.arg, node.lineno
            case ast.Attribute(ctx=ast.Store()):
                yield node.attr, node.lineno
        if isinstance(node, ast.Module | ast.ClassDef):
            yield from _assigned(node.body)


def _assigned(body: list[ast.stmt]) -> Iterator[tuple[str, int]]:
    """Names that the statements of a module or class assign."""
    for statement in body:
        if isinstance(statement, ast.Assign | ast.AnnAssign):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            parts = (part for target in targets for part in ast.walk(target))
            yield from ((part.id, part.lineno) for part in parts if isinstance(part, ast.Name))


def names(path: str) -> Iterator[tuple[str, int]]:
    """Names that a file of production code defines, with their lines."""
    text = (ROOT / path).read_text(encoding="utf-8")
    yield Path(path).stem, 1
    if path.endswith(".py"):
        yield from names_of_module(ast.parse(text))
        for number, line in enumerate(text.splitlines(), 1):
            yield from ((option, number) for option in re.findall(r'"--([a-z-]+)[="/ ]', line))
    elif path.endswith((".msg", ".srv")):
        for number, line in enumerate(text.splitlines(), 1):
            field = _MESSAGE_FIELD.match(line)
            if field:
                yield field[1], number
    elif path.endswith((".toml", ".cfg")):
        for number, line in enumerate(text.splitlines(), 1):
            entry = _ENTRY_POINT.match(line)
            if entry:
                yield entry[1], number


def sentences(path: str) -> Iterator[tuple[str, int]]:
    """Text for people in a file, line by line: of Python its strings and comments, else all of it."""
    text = (ROOT / path).read_text(encoding="utf-8")
    if not path.endswith(".py"):
        yield from ((line, number) for number, line in enumerate(text.splitlines(), 1))
        return
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in (tokenize.STRING, tokenize.COMMENT, getattr(tokenize, "FSTRING_MIDDLE", -1)):
            for offset, line in enumerate(token.string.splitlines()):
                yield line, token.start[0] + offset


PRODUCTION = ("ros_ws/src/*/*/**/*.py", "tools/**/*.py")
DEFINITIONS = (
    "ros_ws/src/**/*.msg",
    "ros_ws/src/**/*.srv",
    "ros_ws/src/*/pyproject.toml",
    "ros_ws/src/*/setup.cfg",
)
SCENARIOS = ("scenarios/*.yaml",)
PAGES = ("docs/**/*.md", "README.md", "ros_ws/src/*/README.md", "docker/README.md")
NOT_READ = ("docs/changelog.md",)
"""Pages without this check: the changelog names what was renamed."""


def findings() -> list[Finding]:
    """All words of the list in names and sentences of the project."""
    here = Path(__file__).resolve().relative_to(ROOT).as_posix()
    found = []
    for path in tracked(*PRODUCTION, *DEFINITIONS, *SCENARIOS):
        if path != here:
            found += [
                Finding(path, line, name, term) for name, line in names(path) if (term := in_name(name))
            ]
    for path in tracked(*PRODUCTION, *DEFINITIONS, *SCENARIOS, *PAGES):
        if path not in (here, *NOT_READ):
            allowed, _ = ALLOWED_WORDS.get(path, (frozenset(), ""))
            found += [
                Finding(path, line, word, INSTEAD[word.lower()])
                for text, line in sentences(path)
                for word in _PROSE_WORDS.findall(text)
                if word.lower() not in allowed
            ]
    return found


def main() -> int:
    """Print all findings; the exit code is 1 where there are some."""
    found = findings()
    for finding in found:
        print(finding)
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
