# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Check that every source file in git begins with the copyright and licence lines; `--add` writes them.

Usage:
    python tools/lint/licence_headers.py [--add]
"""

import subprocess
import sys
from pathlib import Path, PurePath

ROOT = Path(__file__).resolve().parents[2]

HEADER = ("Copyright 2026 satform contributors", "SPDX-License-Identifier: Apache-2.0")

_COMMENTS = {
    ("# ", ""): (".py", ".sh", ".yaml", ".yml", ".toml", ".cfg", ".cff", ".cmake", ".msg", ".srv", ".action"),
    ("// ", ""): (".js",),
    ("/* ", " */"): (".css",),
    ("{# ", " -#}"): (".j2",),
}
"""How a comment begins and ends in files of each kind."""

_NAMES = ("CMakeLists.txt", "Dockerfile")
"""Files whose comments begin with `#`, whatever their suffix; scripts without a suffix have a `#!` line."""

_VENDORED = "vendor"
"""Name of folders with files of others, whose licences stand beside them."""


def header(path: PurePath, text: str) -> str | None:
    """The header of a file as it has to stand there, or None for a file that needs none.

    Args:
        path: of the file; only its name is used.
        text: what is in it.
    """
    if not text.strip():
        return None
    if path.name in _NAMES or path.name.endswith("Dockerfile") or text.startswith("#!"):
        begin, end = "# ", ""
    else:
        found = [marks for marks, suffixes in _COMMENTS.items() if path.suffix in suffixes]
        if not found:
            return None
        ((begin, end),) = found
    return "".join(f"{begin}{line}{end}\n" for line in HEADER)


def has_header(path: PurePath, text: str) -> bool:
    """Whether a file begins with its header, after the `#!` line where it has one, or needs none."""
    expected = header(path, text)
    return expected is None or _split(text)[1].startswith(expected)


def with_header(path: PurePath, text: str) -> str:
    """The text of a file with its header."""
    if has_header(path, text):
        return text
    first, rest = _split(text)
    return f"{first}{header(path, text)}{rest}"


def _split(text: str) -> tuple[str, str]:
    """The `#!` line, if there is one, and the rest."""
    if not text.startswith("#!"):
        return "", text
    first, _, rest = text.partition("\n")
    return f"{first}\n", rest


def _files() -> list[Path]:
    """Files in git, and new ones that git does not ignore; none of others."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    names = [name for name in listed.split("\0") if name and _VENDORED not in PurePath(name).parts]
    return [file for name in names if (file := ROOT / name).is_file()]


def main(arguments: list[str]) -> int:
    """Check, or add what is missing.

    Args:
        arguments: `--add`, or none.

    Returns:
        0 when every file has its header, else 1.
    """
    missing = []
    for file in _files():
        try:
            text = file.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        if has_header(file, text):
            continue
        missing.append(file)
        if arguments == ["--add"]:
            file.write_text(with_header(file, text), encoding="utf-8")
    for file in missing:
        print(f"{file.relative_to(ROOT)}: the first lines are not the copyright and licence of this project")
    return int(bool(missing) and arguments != ["--add"])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
