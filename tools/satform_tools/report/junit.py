# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""JUnit XML, which continuous integration servers read: one test suite with its test cases.

The document keeps to what the schemas of Apache Ant and of Jenkins' xUnit plug-in have in common: one root
`testsuite`, whose children are `properties`, the test cases, `system-out` and `system-err`, in this order.
"""

import platform
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from satform.files.durable_file import write_durably
from satform_tools.errors import CommandError, error_sentences, sentence_of

Outcome = Literal["passed", "failure", "error", "skipped"]

FLIGHT, FLIGHT_SUITE = "flight", "satform"
"""Of a run: the test case of the flight itself, and what the name of the suite begins with."""

FLIGHTS, CAMPAIGN_SUITE = "all cases are flown", "satform campaign"
"""The same of a campaign."""


@dataclass(frozen=True)
class Case:
    """A test case.

    Attributes:
        name: unique in its suite, by which a server follows it from run to run.
        outcome: `failure` for what was tested and is wrong, `error` for what could not be tested.
        message: one line about the outcome.
        kind: word for the kind of failure or error.
        text: more about it.
        seconds: of wall-clock time.
    """

    name: str
    outcome: Outcome = "passed"
    message: str = ""
    kind: str = ""
    text: str = ""
    seconds: float = 0.0


@dataclass(frozen=True)
class Suite:
    """Test cases that belong together.

    Attributes:
        name: of the suite.
        classname: of all its cases, under which a server groups them.
        cases: in order.
        properties: name and value of what the results depend on.
        seconds: of wall-clock time.
        output: what the command has printed, or the part that explains the results.
    """

    name: str
    classname: str
    cases: Sequence[Case]
    properties: Mapping[str, str] = field(default_factory=dict)
    seconds: float = 0.0
    output: str = ""


@contextmanager
def begun(file: Path | None, suite: str, subject: str, case: str) -> Iterator[None]:
    """Begin a file, and write to it the error that ends the block, if one does.

    Until it is replaced the file says that the command has not ended. So a file that cannot be written is
    found before anything starts, no result of an earlier command is taken for that of this one, and a command
    that was killed is an error.

    Args:
        file: to write; None for none.
        suite: what its name begins with.
        subject: scenario or campaign as the user named it.
        case: name of the test case that is an error.

    Raises:
        CommandError: the file cannot be written.
    """
    name = Path(subject).stem
    message = "the command has not ended: it is still running, or it was killed"
    write(Suite(f"{suite} {name}", name, [Case(case, "error", message, "unfinished")]), file)
    try:
        yield
    except Exception as error:
        sentences = error_sentences(error)
        if sentences:
            failed = Case(case, "error", sentences[0], "not started", "\n".join(sentences))
            write(Suite(f"{suite} {name}", name, [failed]), file)
        raise


def write(suite: Suite, file: Path | None) -> None:
    """Write a suite to a file, whose folder is made where there is none.

    Raises:
        CommandError: it cannot be written.
    """
    if file is None:
        return
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_durably(file, document(suite))
    except OSError as error:
        raise CommandError(f"the JUnit file cannot be written: {sentence_of(error)}") from None


def document(suite: Suite) -> bytes:
    """The XML of a suite, in UTF-8."""
    outcomes = [case.outcome for case in suite.cases]
    root = Element(
        "testsuite",
        name=_line(suite.name),
        timestamp=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S"),
        hostname=platform.node() or "localhost",
        tests=str(len(suite.cases)),
        failures=str(outcomes.count("failure")),
        errors=str(outcomes.count("error")),
        skipped=str(outcomes.count("skipped")),
        time=f"{suite.seconds:.3f}",
    )
    properties = SubElement(root, "properties")
    for name, value in suite.properties.items():
        SubElement(properties, "property", name=_line(name), value=_line(value))
    for case in suite.cases:
        _add_case(root, suite.classname, case)
    SubElement(root, "system-out").text = _characters(suite.output)
    SubElement(root, "system-err")
    indent(root, " ")
    text: bytes = tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _add_case(root: Element, classname: str, case: Case) -> None:
    entry = SubElement(
        root, "testcase", classname=_line(classname), name=_line(case.name), time=f"{case.seconds:.3f}"
    )
    if case.outcome == "passed":
        return
    details = SubElement(entry, case.outcome, message=_line(case.message))
    if case.outcome != "skipped":
        details.set("type", case.kind or case.outcome)
    details.text = _characters(case.text) or None


def _line(text: str) -> str:
    return " ".join(_characters(text).split())


def _characters(text: str) -> str:
    """Text without the control characters that XML does not have."""
    return "".join(sign if sign.isprintable() or sign == "\n" else " " for sign in text)
