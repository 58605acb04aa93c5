# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What `check` finds as annotations at file and line: commands of GitHub Actions, or a SARIF log.

The formats are those of the workflow commands in GitHub's documentation, and SARIF 2.1.0 of OASIS.
"""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal
from urllib.parse import quote

from satform.scenario import Problem

SARIF_SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"

_RULES = {
    "error": ("invalid-file", "A file that cannot be flown: a value is not allowed, missing or unknown."),
    "warning": ("unwise-value", "A file that can be flown, but a value of it is probably a mistake."),
}


@dataclass(frozen=True)
class Annotation:
    """An error or a warning about a line of a file.

    Attributes:
        level: error or warning.
        path: of the file, absolute.
        problem: what was found.
    """

    level: Literal["error", "warning"]
    path: Path
    problem: Problem

    @property
    def text(self) -> str:
        """The sentence, with the field that it is about."""
        field, sentence = self.problem.field, self.problem.sentence
        return f"{field}: {sentence}" if field else sentence

    @property
    def line(self) -> int:
        """Line, from 1; the first where the whole file is meant."""
        return self.problem.line or 1


def github(annotations: Iterable[Annotation]) -> str:
    """Annotations as workflow commands, a line for each; GitHub shows them at the lines of a pull request."""
    return "".join(
        f"::{found.level} file={_property(_relative(found.path))},line={found.line},"
        f"title=satform check::{_escaped(found.text)}\n"
        for found in annotations
    )


def sarif(annotations: Iterable[Annotation], version: str, exit_code: int) -> dict[str, Any]:
    """Annotations as a SARIF 2.1.0 log.

    Args:
        annotations: errors and warnings.
        version: of satform.
        exit_code: of the command.
    """
    rules = [
        {
            "id": rule,
            "shortDescription": {"text": text},
            "defaultConfiguration": {"level": level},
        }
        for level, (rule, text) in _RULES.items()
    ]
    run = {
        "tool": {"driver": {"name": "satform", "version": version, "rules": rules}},
        "invocations": [{"executionSuccessful": True, "exitCode": exit_code}],
        "columnKind": "unicodeCodePoints",
        "results": [_result(found) for found in annotations],
    }
    return {"$schema": SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}


def _result(found: Annotation) -> dict[str, Any]:
    rules = list(_RULES)
    location: dict[str, Any] = {
        "physicalLocation": {"artifactLocation": _artifact(found.path), "region": {"startLine": found.line}}
    }
    if found.problem.field:
        location["logicalLocations"] = [{"fullyQualifiedName": found.problem.field}]
    return {
        "ruleId": _RULES[found.level][0],
        "ruleIndex": rules.index(found.level),
        "level": found.level,
        "message": {"text": found.text},
        "locations": [location],
    }


def _artifact(path: Path) -> dict[str, str]:
    relative = _relative(path)
    if Path(relative).is_absolute():
        return {"uri": path.as_uri()}
    return {"uri": quote(relative), "uriBaseId": "%SRCROOT%"}


def _relative(path: Path) -> str:
    """The path from the top of the repository that is checked; the whole path of a file elsewhere.

    GitHub names the top in a variable; elsewhere it is the working directory.
    """
    top = Path(os.environ.get("GITHUB_WORKSPACE") or Path.cwd())
    return path.relative_to(top).as_posix() if path.is_relative_to(top) else str(path)


def _escaped(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _escaped(text).replace(":", "%3A").replace(",", "%2C")
