# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Output of commands that only look: stored under a hash of all that it depends on, and printed again.

`check`, `show`, `list`, `version`, `schema`, `interface` and all help pages print a function of files. It
takes a second to load the library and check a scenario, and a tenth to print what was found before.

An entry lies in `ros_ws/install/cache/output`. Its name is a hash of the command line, the working directory,
how output is shown, the built library, the command line's own files, the installed packages and the names of
the shipped scenarios. It holds the hashes of all other files that the command has opened, which have to be
the same. Only commands that ended with exit code 0 are stored, and none where packages of somebody else bring
parts of their own, whose code is not in the hash. An entry is written whole or not at all; a damaged one is
computed again; the oldest are removed beyond 64.
"""

import hashlib
import io
import json
import os
import stat
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

_TOOLS = Path(__file__).resolve().parent
_ROOT = _TOOLS.parents[1]
_INSTALL = _ROOT / "ros_ws" / "install"
_SHIPPED = (_ROOT / "scenarios", _ROOT / "scenarios" / "campaigns")

_COMMANDS = frozenset({"check", "interface", "list", "schema", "show", "version"})
_HELP = frozenset({"-h", "--help"})
_OWN_HELP = frozenset({"test"})
"""Commands that pass the options for help on."""

_SHOWN_BY = (
    "AMENT_PREFIX_PATH",
    "COLORTERM",
    "COLUMNS",
    "FORCE_COLOR",
    "GITHUB_WORKSPACE",
    "LANG",
    "LC_ALL",
    "LC_CTYPE",
    "LINES",
    "NO_COLOR",
    "PYTHONPATH",
    "ROS_DISTRO",
    "TERM",
    "TERMINAL_WIDTH",
)
"""Variables on which the output depends."""

_INSTALLED = ("-info", ".egg-link", ".pth")
"""Endings of what an installed package leaves beside its code."""

_MOST_ENTRIES = 64
_MOST_BYTES = 4 * 2**20
"""Of an entry."""
_MOST_FILES = 256
"""That a command opens beside code."""

Fingerprint = tuple[int, int, int, int]
"""Device, inode, size and time of change (ns) of a file."""


def run(arguments: Sequence[str], command: Callable[[], int]) -> int:
    """Print the stored output of a command, or run it and store its output where that may be.

    Args:
        arguments: after the program's name.
        command: runs the command line.

    Returns:
        Exit code.
    """
    key = _key(arguments) if _only_looks(arguments) else None
    if key is None:
        return command()
    pieces = _stored(key)
    if pieces is not None:
        return _printed(pieces)
    return _recorded(key, command)


def _only_looks(arguments: Sequence[str]) -> bool:
    """Whether a command line prints a function of files, and does nothing else."""
    if not arguments:
        return False
    *before, last = arguments
    if last in _HELP and not _OWN_HELP.intersection(before[:1]):
        # With options before it, it may be the value of one.
        return not any(word.startswith("-") for word in before)
    return arguments[0] in _COMMANDS


def _key(arguments: Sequence[str]) -> str | None:
    """Hash of all on which output depends beside the files that are named; None where nothing is stored."""
    library = find_spec("satform")
    if library is None or library.origin is None or not Path(library.origin).is_relative_to(_INSTALL):
        return None
    total = hashlib.blake2b(digest_size=16)
    try:
        for part in (
            *arguments,
            *map(str, (Path.cwd(), sys.version, sys.executable)),
            *(f"{name}={os.environ.get(name)}" for name in _SHOWN_BY),
            *_streams(),
            *_packages(),
            *(name for folder in _SHIPPED for name in _names(folder)),
        ):
            # The length keeps parts apart.
            total.update(f"{len(part)}:{part}".encode("utf-8", "surrogateescape"))
        for path in (_INSTALL / "complete.json", *_own_files()):
            total.update(_hash_of(path).encode())
    except OSError:
        return None
    return total.hexdigest()


def _streams() -> Iterator[str]:
    """How output is shown."""
    for stream in (sys.stdout, sys.stderr):
        yield f"{stream.isatty()} {stream.encoding}"
        if stream.isatty():
            yield str(os.get_terminal_size(stream.fileno()))


def _packages() -> Iterator[str]:
    """What is installed where Python looks for modules."""
    for folder in sys.path:
        with suppress(OSError):
            yield folder
            yield from (name for name in _names(Path(folder)) if name.endswith(_INSTALLED))


def _names(folder: Path) -> list[str]:
    """Names of what is in a folder."""
    return sorted(entry.name for entry in os.scandir(folder))


def _own_files() -> Iterator[Path]:
    """Files of the command line itself."""
    for folder, folders, names in os.walk(_TOOLS):
        folders[:] = sorted(set(folders) - {"__pycache__"})
        yield from (Path(folder, name) for name in sorted(names))


def _hash_of(path: str | Path) -> str:
    return hashlib.blake2b(Path(path).read_bytes(), digest_size=16).hexdigest()


def _entries() -> Path:
    """Folder of the entries."""
    return _INSTALL / "cache" / "output"


def _stored(key: str) -> list[tuple[str, str]] | None:
    """Names of streams and texts of a stored output whose files are unchanged; None where there is none."""
    # What cannot be read is computed again: it may be damaged, or be removed by another command.
    with suppress(OSError, ValueError, TypeError, KeyError):
        total, text = (_entries() / f"{key}.json").read_bytes().split(b"\n", 1)
        if total.decode() != hashlib.blake2b(text, digest_size=16).hexdigest():
            return None
        entry = json.loads(text)
        if all(_hash_of(path) == content for path, content in entry["files"].items()):
            return [(str(stream), str(piece)) for stream, piece in entry["pieces"]]
    return None


def _printed(pieces: list[tuple[str, str]]) -> int:
    from satform_tools import output_streams  # noqa: PLC0415 - by name, as tests replace it

    for stream, piece in pieces:
        (output_streams.write if stream == "stdout" else output_streams.note)(piece)
    output_streams.finish()
    return 0


class _Recorded(io.TextIOWrapper):
    """A standard stream that keeps what is written to it."""

    def __init__(self, stream: Any, name: str, pieces: list[tuple[str, str]]) -> None:
        """Take the place of a standard stream, which has been flushed."""
        super().__init__(
            stream.buffer,
            encoding=stream.encoding,
            errors=stream.errors,
            line_buffering=stream.line_buffering,
            write_through=stream.write_through,
        )
        self._name, self._pieces = name, pieces

    def write(self, text: str) -> int:
        """Keep what is written; what is no text is an error, by which typer knows streams of text."""
        written = super().write(text)
        self._pieces.append((self._name, text))
        return written


def _recorded(key: str, command: Callable[[], int]) -> int:
    """Run a command and store its output."""
    from satform_tools import output_streams  # noqa: PLC0415 - by name, as tests replace it

    pieces: list[tuple[str, str]] = []
    opened: dict[str, Fingerprint | None] = {}
    listening = True

    def hook(event: str, details: tuple[Any, ...]) -> None:
        if listening and event == "open":
            _take_down(opened, *details[:1])

    sys.addaudithook(hook)
    before = {name: getattr(sys, name) for name in ("stdout", "stderr")}
    recorded = {}
    for name, stream in before.items():
        stream.flush()
        recorded[name] = _Recorded(stream, name, pieces)
        setattr(sys, name, recorded[name])
    try:
        code = command()
    finally:
        listening = False
        for name, stream in recorded.items():
            # Also where a library has wrapped it, as click does when the reader has gone.
            setattr(sys, name, before[name])
            # Otherwise it would close the descriptor when it is no longer used.
            with suppress(OSError, ValueError):
                stream.detach()
        with suppress(OSError):
            # What is left in the buffer of a stream without a reader; Python would try again on its way out.
            output_streams.finish()
    if code == 0:
        # Without permission or room to write there every command computes it.
        with suppress(OSError, ValueError):
            _store(key, opened, pieces)
    return code


def _take_down(opened: dict[str, Fingerprint | None], path: object) -> None:
    """Note that a file is opened, and what it is at that time."""
    if not isinstance(path, str | bytes | os.PathLike):
        return
    name = os.path.realpath(os.fsdecode(path))
    if not _is_code(name) and name not in opened:
        opened[name] = _fingerprint(name)


def _is_code(path: str) -> bool:
    """Whether a file is in the hash of the key, or is none that the output depends on."""
    known = (_TOOLS, _INSTALL, sys.prefix, sys.base_prefix, "/dev", "/proc", "/sys", "/etc")
    return path.startswith(tuple(f"{folder}{os.sep}" for folder in known))


def _fingerprint(path: str) -> Fingerprint | None:
    """None where there is no file that can be read again."""
    try:
        found = Path(path).stat()
    except OSError:
        return None
    if not stat.S_ISREG(found.st_mode):
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def _store(key: str, opened: dict[str, Fingerprint | None], pieces: list[tuple[str, str]]) -> None:
    """Store output, unless a file has changed since it was read or parts of somebody else may be in it."""
    from satform.files.durable_file import write_durably  # noqa: PLC0415 - not needed to print

    if len(opened) > _MOST_FILES or _has_foreign_parts():
        return
    files = {path: _hash_of(path) for path, found in opened.items() if found is not None}
    if any(_fingerprint(path) != found for path, found in opened.items()):
        return
    text = json.dumps({"files": files, "pieces": pieces}).encode()
    if len(text) > _MOST_BYTES:
        return
    folder = _entries()
    folder.mkdir(parents=True, exist_ok=True)
    total = hashlib.blake2b(text, digest_size=16).hexdigest().encode()
    write_durably(folder / f"{key}.json", total + b"\n" + text)
    _remove_oldest(folder)


def _has_foreign_parts() -> bool:
    """Whether packages other than the library bring parts of scenarios."""
    from importlib.metadata import distributions  # noqa: PLC0415 - slow to import

    return any(
        point.group.startswith("satform.")
        for package in distributions()
        if package.metadata["Name"] != "satform"
        for point in package.entry_points
    )


def _remove_oldest(folder: Path) -> None:
    """Keep the newest entries; another command may remove the same ones."""
    aged = []
    for path in folder.glob("*.json"):
        with suppress(OSError):
            aged.append((path.stat().st_mtime_ns, path))
    for _, path in sorted(aged)[:-_MOST_ENTRIES]:
        path.unlink(missing_ok=True)
