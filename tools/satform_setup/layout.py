# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Paths of the set-up, and the stamps that mark finished parts."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple


class Layout(NamedTuple):
    """The paths of one copy of the project.

    Attributes:
        root: absolute path of the project's folder.
    """

    root: Path

    @property
    def launcher(self) -> Path:
        """The script people type; its file also carries the lock, which then needs none of its own."""
        return self.root / "tools" / "satform"

    @property
    def requirements(self) -> Path:
        """The pinned packages."""
        return self.root / "requirements.txt"

    @property
    def docs_requirements(self) -> Path:
        """The pinned packages of the documentation site."""
        return self.root / "requirements-docs.txt"

    @property
    def venv(self) -> Path:
        """The virtual environment."""
        return self.root / ".venv"

    @property
    def python(self) -> Path:
        """The virtual environment's Python."""
        return self.venv / "bin" / "python"

    @property
    def venv_stamp(self) -> Path:
        """Written when the virtual environment is finished."""
        return self.venv / "complete.json"

    @property
    def docs_packages(self) -> Path:
        """Packages of the documentation site: beside the environment, so that they change nothing in it."""
        return self.venv / "docs"

    @property
    def docs_stamp(self) -> Path:
        """Written when the packages of the documentation site are installed."""
        return self.docs_packages / "complete.json"

    @property
    def log(self) -> Path:
        """What pip and colcon printed."""
        return self.venv / "setup.log"

    @property
    def workspace(self) -> Path:
        """The colcon workspace."""
        return self.root / "ros_ws"

    @property
    def sources(self) -> Path:
        """The ROS packages."""
        return self.workspace / "src"

    @property
    def wheels_packages(self) -> Path:
        """ROS packages that the wheels lack and an installed ROS has."""
        return self.workspace / "wheels"

    @property
    def build(self) -> Path:
        """What colcon works in."""
        return self.workspace / "build"

    @property
    def install(self) -> Path:
        """The built packages, merged into one prefix."""
        return self.workspace / "install"

    @property
    def install_stamp(self) -> Path:
        """Written when all packages are built."""
        return self.install / "complete.json"

    @property
    def wheels_fix(self) -> Path:
        """CMake code that mends the exported targets of the wheels."""
        return self.workspace / "ros_wheels_fix.cmake"


def read_stamp(path: Path) -> dict[str, Any]:
    """Contents of a stamp; empty if there is none or it cannot be read, so a broken one counts as none."""
    try:
        stamp = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return stamp if isinstance(stamp, dict) else {}


def write_stamp(path: Path, stamp: dict[str, Any]) -> None:
    """Write a stamp so that a reader finds either the whole of it or none, even after a power cut."""
    draft = path.with_suffix(".draft")
    with draft.open("w", encoding="utf-8") as file:
        json.dump(stamp, file, indent=1, sort_keys=True)
        file.flush()
        os.fsync(file.fileno())
    draft.replace(path)


def digest(parts: Iterable[bytes]) -> str:
    """One hash of several byte strings; their boundaries count."""
    total = hashlib.blake2b(digest_size=16)
    for part in parts:
        total.update(b"%d:" % len(part))
        total.update(part)
    return total.hexdigest()


def folder_digest(folder: Path) -> str:
    """Hash of the names and contents of all source files below a folder; times do not count."""
    return digest(part for path in _source_files(str(folder)) for part in _described(path, len(str(folder))))


def _described(path: str, skip: int) -> tuple[bytes, bytes]:
    with open(path, "rb") as file:  # noqa: PTH123 - Path.open costs a third of a start
        return os.fsencode(path[skip:]), file.read()


def _source_files(folder: str) -> Iterator[str]:
    with os.scandir(folder) as entries:
        ordered = sorted(entries, key=lambda entry: entry.name)
    for entry in ordered:
        if entry.name.startswith((".", "__pycache__")) or entry.name.endswith((".pyc", ".egg-info")):
            continue
        if entry.is_dir():
            yield from _source_files(entry.path)
        elif entry.is_file():
            yield entry.path
