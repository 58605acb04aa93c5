# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Results that depend on the project's files alone, stored between commands under a hash of these files."""

import hashlib
import json
from collections.abc import Callable, Iterable
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from satform.files.durable_file import write_durably


def stored(name: str, root: Path, sources: Iterable[Path], compute: Callable[[], Any]) -> Any:
    """A result from an earlier command that had the same files, or a new one, which is stored.

    It is stored beside the build, and lost with it. Where the library in use is not the one that was built
    there, nothing is stored.

    Args:
        name: of the result.
        root: the project's folder.
        sources: files on which the result depends, beside the built library.
        compute: computes it, as data of JSON.
    """
    install = root / "ros_ws" / "install"
    key = _key(install, sources)
    if key is None:
        return compute()
    file = install / "cache" / f"{name}.json"
    # What cannot be read is computed again: it may have been cut short, or is of another version.
    with suppress(OSError, ValueError, TypeError, KeyError):
        found = json.loads(file.read_bytes())
        if found["key"] == key:
            return found["result"]
    result = compute()
    # Without permission to write there every command computes it.
    with suppress(OSError):
        file.parent.mkdir(exist_ok=True)
        write_durably(file, json.dumps({"key": key, "result": result}).encode())
    return result


def _key(install: Path, sources: Iterable[Path]) -> str | None:
    """Hash of all that the result depends on; None where the library is another one, or a file is missing."""
    library = find_spec("satform")
    if library is None or library.origin is None or not Path(library.origin).is_relative_to(install):
        return None
    total = hashlib.blake2b(digest_size=16)
    try:
        for path in (install / "complete.json", *sources):
            content = path.read_bytes()
            total.update(f"{path.name}:{len(content)}:".encode())
            total.update(content)
    except OSError:
        return None
    return total.hexdigest()
