# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Builds the ROS workspace: all of it at first, later what has changed."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from satform_setup.errors import SetupError, last_lines
from satform_setup.layout import Layout, digest, folder_digest, read_stamp, write_stamp
from satform_setup.ros_distribution import WHEELS
from satform_setup.variables import applied, base_variables, built_variables, shell_variables

TYPE_CHECKING = False
if TYPE_CHECKING:
    from satform_setup.logged_process import Job

# What a package is built from; what it needs only when it runs gives no reason to build it again.
_BUILD_DEPENDENCIES = (
    "depend",
    "build_depend",
    "build_export_depend",
    "buildtool_depend",
    "buildtool_export_depend",
)


class Package(NamedTuple):
    """One ROS package of the workspace.

    Attributes:
        name: its name.
        folder: where its sources are.
        needs: names of the packages it is built from.
    """

    name: str
    folder: Path
    needs: frozenset[str]


def package_folders(sources: Path) -> list[Path]:
    """The folders below `sources` that hold a ROS package, in order."""
    found = []
    for folder, subfolders, files in os.walk(sources, followlinks=True):
        if "COLCON_IGNORE" in files:
            subfolders.clear()
        elif "package.xml" in files:
            found.append(Path(folder))
            subfolders.clear()
    return sorted(found)


def missing_in_wheels(layout: Layout, ros: str) -> list[Path]:
    """Folders of the packages that are built beside ours where ROS comes from the wheels, in order.

    Args:
        layout: paths of the project.
        ros: where ROS comes from, see `find_ros`.
    """
    if ros != WHEELS or not layout.wheels_packages.is_dir():
        return []
    # The folder itself is marked to be left out by every other build.
    return sorted(folder.parent for folder in layout.wheels_packages.glob("*/package.xml"))


def source_digests(sources: Path) -> dict[str, str]:
    """Hash of each package's sources, by its folder's path relative to `sources`."""
    return {str(folder.relative_to(sources)): folder_digest(folder) for folder in package_folders(sources)}


def read_package(folder: Path) -> Package:
    """Read a package's name and what it is built from out of its package.xml.

    Args:
        folder: the package's folder.

    Returns:
        The package.

    Raises:
        SetupError: the file is not a package description.
    """
    from xml.etree import ElementTree  # noqa: PLC0415 - later starts do without

    path = folder / "package.xml"
    try:
        description = ElementTree.parse(path).getroot()  # noqa: S314
    except ElementTree.ParseError as error:
        raise SetupError(f"{path} is not XML: {error}") from error
    name = (description.findtext("name") or "").strip()
    if not re.fullmatch(r"[a-z][a-z0-9_-]*", name):
        raise SetupError(f"{path} has no <name> of a package")
    needs = frozenset(
        (element.text or "").strip() for kind in _BUILD_DEPENDENCIES for element in description.findall(kind)
    )
    return Package(name, folder, needs)


def packages_to_build(packages: Iterable[Package], changed: Iterable[str]) -> set[str]:
    """The changed packages and all that are built from them, directly or not.

    Args:
        packages: all packages of the workspace.
        changed: names of those whose sources have changed.

    Returns:
        Names.
    """
    todo = set(changed)
    known = list(packages)
    while True:
        more = {package.name for package in known if package.needs & todo} - todo
        if not more:
            return todo
        todo |= more


def build_arguments(layout: Layout, ros: str) -> list[str]:
    """The arguments of colcon that decide what comes out of a build."""
    beside = [str(folder.relative_to(layout.workspace)) for folder in missing_in_wheels(layout, ros)]
    arguments = ["--merge-install", "--base-paths", "src", *beside, "--cmake-args", "-G", "Ninja"]
    arguments += ["-DCMAKE_BUILD_TYPE=Release", "-DBUILD_TESTING=OFF"]
    # CMake would else take the newest Python of the system, conda's or pyenv's.
    arguments += [f"-DPython3_EXECUTABLE={layout.python}"]
    if ros == WHEELS:
        arguments += [f"-DCMAKE_PROJECT_INCLUDE={layout.wheels_fix}"]
    return arguments


def wanted_install(layout: Layout, ros: str, venv: Mapping[str, Any]) -> dict[str, Any]:
    """What the stamp of the built workspace says if it fits, its variables excepted.

    Args:
        layout: paths of the project.
        ros: where ROS comes from, see `find_ros`.
        venv: stamp of the virtual environment it was built with.

    Returns:
        Hashes of the packages, and one of all that concerns every package.
    """
    common = [*build_arguments(layout, ros), repr(sorted(venv.items()))]
    fix = layout.wheels_fix.read_bytes()
    beside = {
        f"../{folder.relative_to(layout.workspace)}": folder for folder in missing_in_wheels(layout, ros)
    }
    return {
        "common": digest([*(part.encode() for part in common), fix]),
        "packages": source_digests(layout.sources)
        | {place: folder_digest(folder) for place, folder in beside.items()},
    }


def build_workspace(job: Job) -> dict[str, Any]:
    """Build what has changed since the last finished build.

    Args:
        job: the set-up.

    Returns:
        The stamp of the build.

    Raises:
        SetupError: a package does not build.
    """
    layout = job.layout
    wanted = wanted_install(layout, job.ros, read_stamp(layout.venv_stamp))
    packages = {folder: read_package(layout.sources / folder) for folder in wanted["packages"]}
    digests = {packages[folder].name: value for folder, value in wanted["packages"].items()}
    built = _trusted_packages(layout, wanted["common"])
    changed = {name for name, value in digests.items() if built.get(name) != value}
    todo = packages_to_build(packages.values(), changed)
    outdated = todo | (built.keys() - digests.keys())
    layout.install_stamp.unlink(missing_ok=True)
    for name in outdated:
        remove_package(layout, name)
    layout.install.mkdir(parents=True, exist_ok=True)
    # If a package does not build, the next try builds the outdated ones alone.
    good = {name: value for name, value in built.items() if name not in outdated}
    write_stamp(_partial_stamp(layout), {"common": wanted["common"], "built": good})
    if todo:
        _colcon(job, sorted(todo))
    stamp = {**wanted, "built": digests, "variables": built_variables(layout, job.ros)}
    write_stamp(layout.install_stamp, stamp)
    _partial_stamp(layout).unlink(missing_ok=True)
    return stamp


def remove_package(layout: Layout, name: str) -> None:
    """Remove all that a package's build has left.

    An install only adds: a module or message that is no longer in the sources would stay importable.

    Args:
        layout: paths of the project.
        name: the package's name.
    """
    shutil.rmtree(layout.build / name, ignore_errors=True)
    patterns = [f"{folder}/{name}" for folder in ("include", "lib", "share", "share/colcon-core/packages")]
    patterns += [f"share/ament_index/resource_index/*/{name}", f"lib/lib{name}__*.so"]
    for modules in ("lib/python3*/site-packages", "local/lib/python3*/dist-packages"):
        patterns += [f"{modules}/{name}", f"{modules}/{name}-*.egg-info", f"{modules}/{name}-*.dist-info"]
    for path in [path for pattern in patterns for path in layout.install.glob(pattern)]:
        shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()


def remove_workspace(layout: Layout) -> None:
    """Remove everything a build has made, its stamp first."""
    layout.install_stamp.unlink(missing_ok=True)
    for folder in (layout.install, layout.build, layout.workspace / "log"):
        if folder.exists():
            shutil.rmtree(folder)


def _partial_stamp(layout: Layout) -> Path:
    return layout.install / "partial.json"


def _trusted_packages(layout: Layout, common: str) -> dict[str, str]:
    """Name -> hash of the packages whose build is still good; none is, after a change that concerns all."""
    stamp = read_stamp(layout.install_stamp) or read_stamp(_partial_stamp(layout))
    built = stamp.get("built")
    if stamp.get("common") == common and isinstance(built, dict):
        return built
    remove_workspace(layout)
    return {}


def _colcon(job: Job, names: list[str]) -> None:
    from satform_setup.logged_process import Progress, run_logged  # noqa: PLC0415 - later starts do without

    layout = job.layout
    additions = base_variables(layout, job.ros)
    additions["search"]["PYTHONPATH"] = [str(Path(__file__).parent / "parse_once")]
    variables = applied(additions, shell_variables(job.ros, job.environment))
    parsed = layout.build / ".parsed_interfaces"
    parsed.mkdir(parents=True, exist_ok=True)
    variables["SATFORM_PARSED_INTERFACES"] = str(parsed)
    # The user's own defaults for colcon are for their own workspaces.
    variables["COLCON_HOME"] = str(layout.venv / "colcon")
    # Else colcon has ninja start no second compiler while the machine's load is above its number of cores.
    cores = len(os.sched_getaffinity(0))
    variables["CMAKE_BUILD_PARALLEL_LEVEL"] = str(cores)
    variables.setdefault("MAKEFLAGS", f"-j{cores}")
    command = [str(layout.python), str(layout.venv / "bin" / "colcon"), "--log-base", "log", "build"]
    command += ["--packages-select", *names, "--event-handlers", "console_cohesion+"]
    command += build_arguments(layout, job.ros)
    usual = "one to four minutes" if "satform_msgs" in names else "a few seconds"
    # Of this build alone: over a year of changes the log would grow without end.
    layout.log.write_bytes(b"")
    progress = Progress(f"building {', '.join(names)} ({usual})")
    progress.count("Finished <<<", len(names))
    outcome = run_logged(job, command, variables, progress, layout.workspace)
    progress.end()
    if outcome.code:
        failed = re.findall(r"^Failed\s+<<<\s+(\S+)", outcome.output, re.MULTILINE)
        raise SetupError(
            f"{' and '.join(failed) or 'the workspace'} cannot be built; output of colcon: "
            f"{layout.log}, its last lines:\n{last_lines(layout.log, 25)}"
        )
