# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Mends the ROS of the wheels for folders with letters beyond ASCII."""

from __future__ import annotations

from satform_setup.errors import SetupError
from satform_setup.layout import Layout

_FILE = "share/rosidl_adapter/cmake/rosidl_adapt_interfaces.cmake"
_READ = 'file(STRINGS "${idl_output}" idl_tuples)'
_READ_AS_UTF8 = 'file(STRINGS "${idl_output}" idl_tuples ENCODING UTF-8)'


def fix_file_names(layout: Layout) -> None:
    """Have the build of messages read the names of files as UTF-8, where the project's folder needs it.

    CMake's `file(STRINGS)` takes a byte beyond ASCII for the end of a line unless it is given the encoding,
    and rosidl_adapter reads a list of paths by it.

    Args:
        layout: paths of the project.

    Raises:
        SetupError: the file is not as it is in the pinned version.
    """
    if str(layout.root).isascii():
        return
    path = layout.venv / _FILE
    text = path.read_text(encoding="utf-8")
    if _READ_AS_UTF8 in text:
        return
    if _READ not in text:
        raise SetupError(
            f"{path} does not read its list of files by {_READ}, as that of the pinned version does; move "
            "the project to a folder whose path has ASCII letters alone"
        )
    # A new file: that of the installer may be a link to its cache.
    path.unlink()
    path.write_text(text.replace(_READ, _READ_AS_UTF8), encoding="utf-8")
