# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Makes and removes the virtual environment."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Mapping
from typing import Any

from satform_setup.errors import SetupError
from satform_setup.layout import Layout, digest, read_stamp, write_stamp
from satform_setup.ros_distribution import WHEELS, WHEELS_MARK
from satform_setup.variables import shell_variables

TYPE_CHECKING = False
if TYPE_CHECKING:
    from satform_setup.logged_process import Job


def wanted_venv(layout: Layout, ros: str) -> dict[str, Any]:
    """What the stamp of a virtual environment says if that environment fits.

    Args:
        layout: paths of the project; programs in the environment name its folder, so it cannot be moved.
        ros: where ROS comes from, see `find_ros`.

    Returns:
        The stamp.
    """
    return {
        "folder": str(layout.root),
        "Python": f"{sys.version_info[0]}.{sys.version_info[1]}",
        "requirements": digest([layout.requirements.read_bytes()]),
        "ROS": ros,
    }


def venv_fits(layout: Layout, ros: str) -> bool:
    """Whether a finished environment fits these requirements, this folder, this Python and this ROS."""
    return read_stamp(layout.venv_stamp) == wanted_venv(layout, ros) and os.access(layout.python, os.X_OK)


def rebuild_reason(stamp: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """Say why a virtual environment is made.

    Args:
        stamp: of the one that is there, empty if there is none.
        wanted: what the stamp should say.

    Returns:
        A clause.
    """
    changed = [name for name in wanted if stamp.get(name) != wanted[name]]
    if not stamp or not changed:
        return "making the environment of this folder"
    return f"making a new environment, since the old one was made for another {' and another '.join(changed)}"


def make_venv(job: Job) -> None:
    """Make the virtual environment where there is none.

    Args:
        job: the set-up.

    Raises:
        SetupError: venv or pip failed.
    """
    from satform_setup.installer import install_requirements  # noqa: PLC0415 - later starts do without
    from satform_setup.logged_process import Progress, run_logged  # noqa: PLC0415
    from satform_setup.ros_wheels_fix import fix_file_names  # noqa: PLC0415

    layout = job.layout
    layout.venv.mkdir()
    layout.log.touch()
    # The wheels of another environment that satform may have been started from must not restart Python.
    variables = shell_variables(WHEELS, job.environment) | {WHEELS_MARK: "1"}
    # Of an active virtual environment only the Python under it is used.
    python = str(getattr(sys, "_base_executable", "") or sys.executable)
    system = [] if job.ros == WHEELS else ["--system-site-packages"]
    command = [python, "-I", "-m", "venv", *system, str(layout.venv)]
    progress = Progress("virtual environment (5 s)")
    outcome = run_logged(job, command, variables, progress, layout.root)
    progress.end()
    if outcome.code:
        raise SetupError(f"{' '.join(command)} failed; its output: {layout.log}")
    install_requirements(job, variables)
    if job.ros == WHEELS:
        fix_file_names(layout)
    write_stamp(layout.venv_stamp, wanted_venv(layout, job.ros))


def remove_venv(layout: Layout) -> None:
    """Remove the virtual environment, its stamp first: what a crash leaves is never taken for a good one.

    Args:
        layout: paths of the project.

    Raises:
        SetupError: what stands in its place is not ours to remove.
    """
    venv = layout.venv
    layout.venv_stamp.unlink(missing_ok=True)
    if not os.path.lexists(venv):
        return
    if venv.is_symlink() or not venv.is_dir() or (any(venv.iterdir()) and not layout.log.exists()):
        raise SetupError(
            f"{venv} was not made by satform, which keeps its environment there; run: rm -r {venv}"
        )
    shutil.rmtree(venv)
