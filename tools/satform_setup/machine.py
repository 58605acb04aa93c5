# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Requirements on the machine, checked before anything is installed."""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import sys
import sysconfig
from collections.abc import Mapping
from pathlib import Path

from satform_setup.errors import SetupError
from satform_setup.ros_distribution import WHEELS, check_python_of_ros

# brahe's wheel is the one that asks for the newest C library (manylinux_2_35).
OLDEST_GLIBC = (2, 35)
# Bytes: 1 GB installed, the rest of the installer's cache, the build.
NEEDED_SPACE = 2_000_000_000


def check_machine(root: Path, ros: str, environment: Mapping[str, str]) -> None:
    """Refuse, before any work, a machine on which the set-up would fail.

    Args:
        root: the project's folder.
        ros: where ROS comes from, see `find_ros`.
        environment: the shell's variables.

    Raises:
        SetupError: something is missing.
    """
    check_folder(root, ros)
    check_python_of_ros(ros, sys.version_info[:2])
    if ros == WHEELS:
        check_platform(platform.system(), platform.machine(), sys.maxsize, glibc_version())
    check_packages(missing_packages(environment))
    check_space(shutil.disk_usage(root).free)


def check_folder(root: Path, ros: str) -> None:
    """Refuse a folder in which build tools cannot work.

    Args:
        root: the project's folder.
        ros: where ROS comes from, see `find_ros`.

    Raises:
        SetupError: its path cannot stand in a search path, or it may not be written.
    """
    odd = next((sign for sign in ":;\"'$\\\n" if sign in str(root)), None)
    if odd is not None:
        raise SetupError(
            f"the project's folder {str(root)!r} has {odd!r} in its path, which ROS's build tools cannot "
            "handle; move the project to a folder without it"
        )
    foreign = next((sign for sign in str(root) if not sign.isascii()), None)
    # In the wheels, which are in a folder of this project, that is mended: see `ros_wheels_fix`.
    if foreign is not None and ros != WHEELS:
        raise SetupError(
            f"the project's folder {str(root)!r} has {foreign!r} in its path, which the installed ROS cannot "
            "build messages in: its rosidl_adapter reads the names of files as ASCII; move the project to a "
            "folder without it, or use a shell that has sourced no ROS"
        )
    if not os.access(root, os.W_OK):
        raise SetupError(f'may not write in {root}; take ownership of it: sudo chown -R "$USER" {root}')


def glibc_version() -> tuple[int, ...]:
    """Version of the C library, e.g. (2, 36); empty if it is not the GNU one."""
    try:
        name, version = (os.confstr("CS_GNU_LIBC_VERSION") or "").split()
    except (OSError, ValueError):
        return ()
    return tuple(int(part) for part in version.split(".")[:2]) if name == "glibc" else ()


def check_platform(system: str, processor: str, largest_index: int, glibc: tuple[int, ...]) -> None:
    """Refuse a system for which there are no wheels of ROS.

    Args:
        system: name of the operating system, as `platform.system` gives it.
        processor: kind of processor, as `platform.machine` gives it.
        largest_index: `sys.maxsize`, which tells a 32-bit Python on a 64-bit processor.
        glibc: version of the GNU C library, empty if it is another library.

    Raises:
        SetupError: the system is another one.
    """
    remedy = "use such a machine or container, or a ROS 2 Jazzy of your own: source /opt/ros/jazzy/setup.bash"
    wide = largest_index > 2**32
    if system != "Linux" or processor != "x86_64" or not wide:
        found = f"{system} on {processor}{'' if wide else ' with a 32-bit Python'}"
        raise SetupError(f"the ROS 2 wheels exist only for Linux on x86-64, this is {found}; {remedy}")
    if glibc < OLDEST_GLIBC:
        found = f"glibc {'.'.join(map(str, glibc))}" if glibc else "another C library"
        wanted = ".".join(map(str, OLDEST_GLIBC))
        raise SetupError(
            f"needs glibc {wanted} or newer (Debian 12, Ubuntu 22.04), this machine has {found}; {remedy}"
        )


def check_space(free: int) -> None:
    """Refuse a disk that the environment would fill.

    Args:
        free: free space, bytes.

    Raises:
        SetupError: it is too little.
    """
    if free < NEEDED_SPACE:
        raise SetupError(
            f"the disk has {free / 1e9:.1f} GB free and the set-up takes {NEEDED_SPACE / 1e9:.1f} GB; "
            "free some and run the same command again"
        )


def missing_packages(environment: Mapping[str, str]) -> dict[str, str]:
    """Find what must come from the system's package manager and has not.

    Args:
        environment: the shell's variables; PATH, CC and CXX are read.

    Returns:
        Debian's package -> what of it is missing.
    """
    missing = {}
    # Debian and Ubuntu take these two out of Python; other systems' Pythons have them.
    if importlib.util.find_spec("ensurepip") is None:
        missing[_python_package("venv")] = "Python's venv"
    if not (Path(sysconfig.get_path("include")) / "Python.h").is_file():
        missing[_python_package("dev")] = "Python's headers"
    path = environment.get("PATH", os.defpath)
    if not _compiler(environment.get("CXX"), ("c++", "g++", "clang++"), path):
        missing["g++"] = "a C++ compiler"
    elif not _compiler(environment.get("CC"), ("cc", "gcc", "clang"), path):
        missing["gcc"] = "a C compiler"
    return missing


def check_packages(missing: Mapping[str, str]) -> None:
    """Refuse a machine without what the set-up cannot bring itself.

    Args:
        missing: as `missing_packages` returns it.

    Raises:
        SetupError: something is missing.
    """
    if missing:
        verb = "is" if len(missing) == 1 else "are"
        raise SetupError(
            f"{' and '.join(missing.values())} {verb} missing; run: sudo apt install {' '.join(missing)}"
        )


def _python_package(part: str) -> str:
    # The packages of the system's default Python bear no version in their name, those of another one do.
    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    default = Path("/usr/bin/python3").resolve().name
    return f"python3-{part}" if default == f"python{version}" else f"python{version}-{part}"


def _compiler(chosen: str | None, names: tuple[str, ...], path: str) -> bool:
    command = (chosen or "").split()
    return any(shutil.which(name, path=path) for name in (command[:1] or names))
