# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every link in the project's pages has a target: a file of the project, and a heading in it."""

import re
import subprocess
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").rglob("*.md")),
    *sorted((ROOT / "docker").glob("*.md")),
    *sorted((ROOT / "ros_ws" / "src").glob("*/README.md")),
    *sorted((ROOT / "tests").rglob("*.md")),
]
LINK = re.compile(r"\]\(([^)\s]+)\)|<img[^>]+src=\"([^\"]+)\"")


def without_code(text: str) -> str:
    """A page without what it shows as code, where brackets are no links."""
    text = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"^ {4}.*$", "", re.sub(r"`[^`\n]*`", "", text), flags=re.MULTILINE)


@cache
def anchors(page: Path) -> set[str]:
    """Names of the headings of a page, as GitHub makes them."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+ (.+)$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@cache
def kept() -> set[Path]:
    """Files of the project, and the folders that they are in; what was only made here is none."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if listed.returncode:
        return {path for path in ROOT.rglob("*") if ".venv" not in path.parts}
    files = {ROOT / line for line in listed.stdout.splitlines()}
    return files | {parent for file in files for parent in file.parents}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_somewhere(page: Path) -> None:
    nowhere: list[str] = []
    for groups in LINK.findall(without_code(page.read_text(encoding="utf-8"))):
        link = groups[0] or groups[1]
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        if target not in kept() or (anchor and anchor not in anchors(target)):
            nowhere.append(link)
    assert nowhere == []


def test_every_page_of_the_docs_is_reached_from_the_readme() -> None:
    seen: set[Path] = set()
    waiting = [ROOT / "README.md"]
    while waiting:
        page = waiting.pop()
        if page in seen or page.suffix != ".md" or not page.is_file():
            continue
        seen.add(page)
        for groups in LINK.findall(without_code(page.read_text(encoding="utf-8"))):
            waiting.append((page.parent / (groups[0] or groups[1]).partition("#")[0]).resolve())
    pages = [page for page in PAGES if "tests" not in page.parts]
    assert [str(page.relative_to(ROOT)) for page in pages if page not in seen] == []
