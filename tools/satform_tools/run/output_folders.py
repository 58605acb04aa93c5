# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The output folder of a run: makes it, and names the files in it."""

import os
from datetime import UTC, datetime
from pathlib import Path

from satform_tools.errors import CommandError, sentence_of

RESULT = "result.json"
TRACE = "trace"

MOST_BYTES = 100_000_000
"""Size of the largest file of JSON that is read; that of 10 000 satellites has some megabytes."""


def make(out: Path | None, scenario: str) -> Path:
    """Make the folder of a run; an existing run is never touched.

    Args:
        out: requested folder; None for a new one in `runs` of the current folder.
        scenario: name of what is flown.

    Returns:
        The folder, empty.

    Raises:
        CommandError: the folder holds something already or cannot be made.
    """
    try:
        require_text(Path.cwd() if out is None else out.absolute())
        if out is None:
            return _new_folder(scenario)
        if out.exists() and (not out.is_dir() or any(out.iterdir())):
            raise CommandError(f"{out} already exists and is not an empty folder; name another with --out")
        out.mkdir(parents=True, exist_ok=True)
        # A folder that was there already may be one that cannot be written to.
        probe = out / RESULT
        probe.touch()
        probe.unlink()
    except (OSError, ValueError) as error:
        reason = sentence_of(error) if isinstance(error, OSError) else str(error)
        raise CommandError(f"the run's folder cannot be written: {reason}") from None
    return out


def require_text(folder: Path) -> None:
    """Check that the path of a folder is UTF-8 text, as ROS parameters and messages need.

    Raises:
        CommandError: it is not.
    """
    try:
        str(folder).encode()
    except UnicodeEncodeError as error:
        wrong = os.fsencode(str(folder)[error.start])[0]
        raise CommandError(
            f"{folder}: the path is not UTF-8 text (byte {wrong:#04x}), which ROS asks of all text; "
            "name another folder with --out"
        ) from None


def _new_folder(scenario: str) -> Path:
    moment = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    runs = Path.cwd() / "runs"
    runs.mkdir(exist_ok=True)
    number = 1
    while True:
        folder = runs / (f"{scenario}-{moment}" + (f"-{number}" if number > 1 else ""))
        try:
            folder.mkdir()
        except FileExistsError:
            number += 1
        else:
            return folder
