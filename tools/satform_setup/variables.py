# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Environment variables of the programs that run in the environment."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TypedDict

from satform_setup.layout import Layout
from satform_setup.ros_distribution import WHEELS, WHEELS_MARK

# Of another Python or another virtual environment.
_FOREIGN_PYTHON = ("PYTHONHOME", "PYTHONUSERBASE", "PYTHONPLATLIBDIR", "PYTHONEXECUTABLE", "VIRTUAL_ENV")
# Of other workspaces.
_FOREIGN_BUILD = ("COLCON_DEFAULTS_FILE", "COLCON_PREFIX_PATH", "COLCON_HOME", "CMAKE_GENERATOR")
# Of another ROS, or what would have CMake or the linker find other libraries than those of the wheels.
_FOREIGN_ROS = (
    "AMENT_CURRENT_PREFIX",
    "AMENT_PREFIX_PATH",
    "CMAKE_MODULE_PATH",
    "CMAKE_PREFIX_PATH",
    "CMAKE_TOOLCHAIN_FILE",
    "CONDA_PREFIX",
    "LD_LIBRARY_PATH",
    "PYTHONPATH",
    "RMW_IMPLEMENTATION",
    "ROS_DISTRO",
    "ROS_PACKAGE_PATH",
)


class Variables(TypedDict):
    """What is put in front of, and beside, the variables of the shell.

    Attributes:
        search: variable -> folders put in front of it.
        fixed: variable -> its value.
        default: variable -> its value if the shell has none.
    """

    search: dict[str, list[str]]
    fixed: dict[str, str]
    default: dict[str, str]


def shell_variables(ros: str, environment: Mapping[str, str]) -> dict[str, str]:
    """The shell's variables without those that would mix another environment into ours.

    Args:
        ros: where ROS comes from, see `find_ros`.
        environment: the shell's variables.

    Returns:
        Those that may stay.
    """
    foreign = {*_FOREIGN_PYTHON, *_FOREIGN_BUILD, *(_FOREIGN_ROS if ros == WHEELS else ())}
    kept = {name: value for name, value in environment.items() if name not in foreign}
    parts = _folders_with_parts(environment.get("PYTHONPATH", ""))
    if parts and "PYTHONPATH" in foreign:
        kept["PYTHONPATH"] = os.pathsep.join(parts)
    return kept


def _folders_with_parts(search: str) -> list[str]:
    """The folders of a search path that hold packages with parts for scenarios, by their entry points."""
    return [folder for folder in search.split(os.pathsep) if folder and _has_parts(Path(folder))]


def _has_parts(folder: Path) -> bool:
    if (folder / "satform").is_dir():
        return False  # Another satform, whose own entry points are not for this one.
    lists = (
        entries for kind in ("egg", "dist") for entries in folder.glob(f"*.{kind}-info/entry_points.txt")
    )
    return any("[satform." in entries.read_text(encoding="utf-8", errors="replace") for entries in lists)


def built_variables(layout: Layout, ros: str) -> Variables:
    """Work out the variables of programs that use the built workspace.

    Args:
        layout: paths of the project.
        ros: where ROS comes from, see `find_ros`.

    Returns:
        Additions to the shell's variables.
    """
    packages = sorted(layout.install.glob("lib/python3*/site-packages"))
    packages += sorted(layout.install.glob("local/lib/python3*/dist-packages"))
    variables = base_variables(layout, ros)
    search = variables["search"]
    # From the tree, so that a change of the command line needs no build.
    search["PYTHONPATH"] = [str(layout.root / "tools"), *map(str, packages)]
    search.setdefault("AMENT_PREFIX_PATH", []).insert(0, str(layout.install))
    # rosidl loads the messages' type support by library name alone.
    search.setdefault("LD_LIBRARY_PATH", []).insert(0, str(layout.install / "lib"))
    return variables


def base_variables(layout: Layout, ros: str) -> Variables:
    """Work out the variables of programs that use the virtual environment alone, as the build does.

    Args:
        layout: paths of the project.
        ros: where ROS comes from, see `find_ros`.

    Returns:
        Additions to the shell's variables.
    """
    return environment_variables(layout.venv, ros)


def environment_variables(venv: Path, ros: str) -> Variables:
    """Work out the variables of programs that use a virtual environment.

    Args:
        venv: its folder.
        ros: where ROS comes from, see `find_ros`.

    Returns:
        Additions to the shell's variables.
    """
    variables = Variables(
        search={"PATH": [str(venv / "bin")]},
        fixed={"VIRTUAL_ENV": str(venv), "PYTHONNOUSERSITE": "1"},
        # Our arrays have three columns and our processes share few cores: threads of a BLAS only take turns.
        default=dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
    )
    if ros == WHEELS:
        libraries = sorted(venv.glob("lib/python3*/site-packages/ros_*.libs"))
        variables["search"]["LD_LIBRARY_PATH"] = [str(venv / "lib"), *map(str, libraries)]
        variables["search"]["AMENT_PREFIX_PATH"] = [str(venv)]
        # Without the mark the wheels start every Python twice, to set the library path; we have set it.
        variables["fixed"][WHEELS_MARK] = "1"
        # The only middleware among the wheels; a shell may ask for another.
        variables["fixed"]["RMW_IMPLEMENTATION"] = "rmw_fastrtps_cpp"
    return variables


def applied(variables: Variables, shell: Mapping[str, str]) -> dict[str, str]:
    """Put our variables over those of the shell.

    Args:
        variables: additions.
        shell: variables from `shell_variables`.

    Returns:
        All the variables of a program.
    """
    result = {**variables["default"], **shell, **variables["fixed"]}
    for name, folders in variables["search"].items():
        old = shell.get(name, "")
        result[name] = os.pathsep.join([*folders, *([old] if old else [])])
    return result
