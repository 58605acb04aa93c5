# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a page shows."""

from html.parser import HTMLParser
from pathlib import Path


class Shown(HTMLParser):
    """Text, tags and addresses of a page, without its scripts."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.texts: list[str] = []
        self.tags: list[str] = []
        self.addresses: list[str] = []
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.addresses += [value or "" for name, value in attrs if name in {"src", "href", "data", "action"}]

    def handle_data(self, data: str) -> None:
        if data.strip() and self.tags[-1] not in {"script", "style"}:
            self.texts.append(" ".join(data.split()))
