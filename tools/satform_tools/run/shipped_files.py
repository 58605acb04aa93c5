# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Files of a folder by name, or any file by path; the nearest spelling in errors."""

import difflib
import sys
from pathlib import Path

from satform.files.bounded_file import is_file
from satform_tools.errors import CommandError

ROOT = Path(__file__).resolve().parents[3]
"""The project's folder."""

_IN_CHECKOUT = ROOT / "scenarios"

SCENARIOS = _IN_CHECKOUT if _IN_CHECKOUT.is_dir() else Path(sys.prefix) / "share" / "satform" / "scenarios"
"""Folder of the shipped scenarios: in the project's folder, or where a wheel has put them."""

_SUFFIXES = (".yaml", ".yml", ".json")


def require_checkout(what: str) -> None:
    """Check that there is a project's folder, with documentation and tests.

    Args:
        what: is done there, as the beginning of the sentence.

    Raises:
        CommandError: satform is installed as a wheel.
    """
    if not _IN_CHECKOUT.is_dir():
        raise CommandError(f"{what} in a copy of the project; this satform is installed as a wheel")


def names(folder: Path) -> list[str]:
    """Names of the YAML files of a folder, without ending."""
    return sorted(path.stem for path in folder.glob("*.yaml"))


def find(asked: str, folder: Path, what: str, otherwise: str) -> Path:
    """The file that a name or a path means.

    Args:
        asked: name of a file in the folder, or path of any file.
        folder: of the shipped files.
        what: the file describes, as text in an error.
        otherwise: what may be given in place of a name, as text in an error.

    Returns:
        The file; a path is returned whether or not there is such a file.

    Raises:
        CommandError: nothing of that name is known.
    """
    known = names(folder)
    if asked in known:
        return folder / f"{asked}.yaml"
    path = Path(asked)
    if path.suffix in _SUFFIXES or "/" in asked or is_file(path):
        return path
    close = difflib.get_close_matches(asked, known, n=1)
    meant = f"; did you mean {close[0]}?" if close else "."
    raise CommandError(f"there is no {what} {asked!r}{meant} Name one of {', '.join(known)}, {otherwise}")
