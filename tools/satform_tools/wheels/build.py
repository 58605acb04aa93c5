# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `wheels`: the library as one wheel, and nodes, messages and command line as another."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

from satform_setup.layout import Layout
from satform_setup.machine import OLDEST_GLIBC
from satform_setup.ros_distribution import WHEELS_MARK
from satform_tools import console
from satform_tools.errors import CommandError, sentence_of
from satform_tools.run.shipped_files import ROOT, require_checkout
from satform_tools.wheels.requirements import pinned, runtime_requirements
from satform_tools.wheels.wheel_file import Content, write_wheel

NAME = "satform_ros"
"""Of the wheel with the nodes; its distribution is satform-ros."""

_BUILT = ("satform_nodes", "satform_bringup", "satform_msgs", "satform_transport", "tf2_msgs")
_TOOLS = ("satform_tools", "satform_setup")
_LEFT_OUT = {"cmake", "hook", "environment", "colcon-core", "parent_prefix_path", "satform", "__pycache__"}
"""Parts of paths of what is only for building, or in the other wheel."""


def build(out: Path, *, dependencies: bool) -> list[Path]:
    """Build both wheels.

    Args:
        out: folder of the wheels, which is made where there is none.
        dependencies: whether the wheels of all that they require are put there too, from the package index.

    Returns:
        The two wheels.

    Raises:
        CommandError: they cannot be built here.
    """
    require_checkout("wheels are built")
    if not os.environ.get(WHEELS_MARK):
        raise CommandError("wheels are built with ROS from wheels; use a shell that has sourced no ROS")
    layout = Layout(ROOT)
    try:
        out.mkdir(parents=True, exist_ok=True)
        library = _library(layout, out)
        release = version("satform")
        nodes = write_wheel(out, NAME, release, _tag(layout), dict(sorted(_files(layout, release))))
    except OSError as error:
        raise CommandError(f"the wheels cannot be written: {sentence_of(error)}") from None
    if dependencies:
        _pip(
            "wheel",
            "--wheel-dir",
            out,
            "--find-links",
            out,
            "--no-build-isolation",
            f"satform-ros=={release}",
        )
    return [library, nodes]


def _library(layout: Layout, out: Path) -> Path:
    """Build the wheel of the library, in a copy: setuptools builds in the folder of the sources."""
    with tempfile.TemporaryDirectory() as temporary:
        source = Path(temporary) / "satform"
        shutil.copytree(layout.sources / "satform", source)
        made = Path(temporary) / "made"
        _pip("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", made, source)
        (wheel,) = made.iterdir()
        return Path(shutil.move(wheel, out / wheel.name))


def _pip(*words: str | Path) -> None:
    command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet", *map(str, words)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if done.returncode:
        console.note(done.stdout)
        raise CommandError(f"pip {words[0]} ended with exit code {done.returncode}; its output is above")


def _files(layout: Layout, release: str) -> Iterator[tuple[str, Content]]:
    """Every file of the wheel with the nodes but those that describe it as a wheel."""
    (packages,) = layout.install.glob("lib/python3*/site-packages")
    for folder in (*(packages / name for name in _BUILT), *(layout.root / "tools" / name for name in _TOOLS)):
        yield from _below(folder, folder.parent, "")
    data = f"{NAME}-{release}.data/data"
    for library in layout.install.glob("lib/*.so"):
        yield f"{data}/lib/{library.name}", Content(library.read_bytes())
    yield from _below(layout.install / "lib" / "satform_nodes", layout.install, f"{data}/")
    yield from _below(layout.install / "share", layout.install, f"{data}/")
    yield from _below(layout.root / "scenarios", layout.root, f"{data}/share/satform/")
    info = f"{NAME}-{release}.dist-info"
    yield f"{info}/METADATA", Content(_metadata(layout, release).encode())
    yield f"{info}/entry_points.txt", Content(b"[console_scripts]\nsatform = satform_tools.installed:main\n")
    yield f"{info}/licenses/LICENSE", Content((layout.root / "LICENSE").read_bytes())


def _below(folder: Path, root: Path, prefix: str) -> Iterator[tuple[str, Content]]:
    for path in folder.rglob("*"):
        inner = path.relative_to(root)
        if (
            path.is_file()
            and not _LEFT_OUT & set(inner.parts[1:])
            and path.suffix not in {".bash", ".dsv", ".sh"}
        ):
            yield f"{prefix}{inner.as_posix()}", Content(path.read_bytes(), os.access(path, os.X_OK))


def _metadata(layout: Layout, release: str) -> str:
    pins = pinned(layout.requirements.read_text(encoding="utf-8"))
    lines = [
        "Metadata-Version: 2.1",
        "Name: satform-ros",
        f"Version: {release}",
        "Summary: satform with ROS 2: nodes, messages, scenarios and command line.",
        "License: Apache-2.0",
        f"Requires-Python: =={sys.version_info[0]}.{sys.version_info[1]}.*",
        f"Requires-Dist: satform=={release}",
        *(f"Requires-Dist: {requirement}" for requirement in runtime_requirements(pins)),
    ]
    return "\n".join(lines) + "\n"


def _tag(layout: Layout) -> str:
    """Tag of the wheel: this Python, and the oldest C library that has all that is needed.

    The messages are compiled for one version of Python. The C library is that of the newest symbol that they
    use, or the oldest for which there are wheels of all that is required, whichever is newer.
    """
    symbols = re.compile(rb"GLIBC_2\.(\d+)")
    libraries = [*layout.install.glob("lib/*.so"), *layout.install.glob("lib/python3*/**/*.so")]
    found = {int(minor) for library in libraries for minor in symbols.findall(library.read_bytes())}
    major, minor = OLDEST_GLIBC
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    processor = sysconfig.get_platform().partition("-")[2].replace("-", "_")
    return f"{python}-{python}-manylinux_{major}_{max(minor, *found)}_{processor}"
