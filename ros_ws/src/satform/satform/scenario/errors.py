# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What is wrong with a scenario: `ScenarioError` with a `Problem` for each thing found.

The sentences come from `yaml_reader` (YAML syntax and size), `field_errors` (fields, one by one) and
`model` (what does not fit together).
"""

from dataclasses import dataclass

from satform.common.printable_text import printable


@dataclass(frozen=True)
class Problem:
    """One thing wrong with a scenario.

    Attributes:
        file: where the scenario was read from, as the user named it.
        line: line of the field, counted from 1; None when the whole file is meant.
        field: dotted path of the field, empty for the whole file.
        sentence: what was found and what would be right.
    """

    file: str
    line: int | None
    field: str
    sentence: str

    def __str__(self) -> str:
        location = self.file if self.line is None else f"{self.file}:{self.line}"
        field = f"{self.field}: " if self.field else ""
        return printable(f"{location}: {field}{self.sentence}")


class ScenarioError(ValueError):
    """A scenario that cannot fly; `problems` holds everything that was found, not the first only."""

    def __init__(self, problems: list[Problem]) -> None:
        super().__init__("\n".join(str(problem) for problem in problems))
        self.problems = problems

    @property
    def first(self) -> str:
        """The first problem and how many there are besides, as one clause of a sentence."""
        more = len(self.problems) - 1
        return f"{self.problems[0]}{f', and {more} more' if more else ''}"

    def __reduce__(self) -> tuple[type["ScenarioError"], tuple[list[Problem]]]:
        """How it is pickled: by its problems, not by the text that is made of them."""
        return type(self), (self.problems,)
