# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes a wheel of files that are built already, by the binary distribution format of Python packages.

Equal files give an equal wheel: entries are in order and have no time.
"""

import base64
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

_FILE, _PROGRAM = 0o100644, 0o100755


@dataclass(frozen=True)
class Content:
    """A file of a wheel.

    Attributes:
        data: of the file.
        program: whether it can be executed.
    """

    data: bytes
    program: bool = False


def write_wheel(folder: Path, name: str, version: str, tag: str, files: Mapping[str, Content]) -> Path:
    """Write a wheel that is not pure Python.

    Args:
        folder: of the wheel.
        name: of the distribution, with underscores.
        version: of it.
        tag: Python, ABI and platform, such as `cp311-cp311-linux_x86_64`.
        files: by their path in the wheel, its metadata among them.

    Returns:
        The wheel.
    """
    info = f"{name}-{version}.dist-info"
    about = f"Wheel-Version: 1.0\nGenerator: satform {version}\nRoot-Is-Purelib: false\nTag: {tag}\n"
    every = {**files, f"{info}/WHEEL": Content(about.encode())}
    rows = [f"{path},sha256={_digest(content.data)},{len(content.data)}" for path, content in every.items()]
    record = f"{info}/RECORD"
    every[record] = Content("\n".join([*rows, f"{record},,", ""]).encode())
    wheel = folder / f"{name}-{version}-{tag}.whl"
    with ZipFile(wheel, "w", ZIP_DEFLATED) as archive:
        for path, content in every.items():
            entry = ZipInfo(path)
            entry.compress_type = ZIP_DEFLATED
            entry.external_attr = (_PROGRAM if content.program else _FILE) << 16
            archive.writestr(entry, content.data)
    return wheel


def _digest(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
