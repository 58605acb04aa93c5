# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The documentation site as its command builds it."""

import ast
import re
import subprocess
from pathlib import Path

import pytest

from satform_tools.docs.api_pages import PACKAGES, described_names
from satform_tools.docs.build import loaded
from satform_tools.scene.browser import browsing, chromium

ROOT = Path(__file__).resolve().parents[2]

EQUATIONS_DRAWN = """new Promise((done) => {
  const timer = setInterval(() => {
    if (document.readyState === "complete" && window.MathJax?.startup?.promise) {
      clearInterval(timer);
      MathJax.startup.promise.then(() => done(true));
    }
  }, 50);
})"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the built site."""
    out = tmp_path_factory.mktemp("docs") / "site"
    command = [str(ROOT / "tools" / "satform"), "docs", "--out", str(out)]
    built = subprocess.run(command, capture_output=True, text=True, timeout=900, check=False)
    if "the package index cannot be reached" in built.stderr:
        pytest.skip("Sphinx is not installed, and there is no network to install it")
    assert built.returncode == 0, built.stderr
    return out


def public_definitions(path: Path) -> list[str]:
    """Functions and classes at the top of a source file whose names do not begin with an underscore."""
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [node.name for node in tree.body if isinstance(node, kinds) and not node.name.startswith("_")]


@pytest.mark.slow
def test_every_public_function_and_class_of_the_sources_is_described(site: Path) -> None:
    sources = ROOT / "ros_ws" / "src"
    wanted = {
        f"{'.'.join(path.relative_to(sources / package).with_suffix('').parts)}.{name}".replace(
            ".__init__", ""
        )
        for package in PACKAGES
        for path in (sources / package / package).rglob("*.py")
        if not path.stem.startswith("_") or path.stem == "__init__"
        for name in public_definitions(path)
    }
    assert len(wanted) > 500
    assert wanted - described_names(site / "objects.inv") == set()


@pytest.mark.slow
def test_no_page_loads_anything_from_another_host(site: Path) -> None:
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 50
    outside = [
        (str(page.relative_to(site)), address)
        for page in pages
        for address in loaded(page.read_text(encoding="utf-8"))
        if re.match(r"(https?:)?//", address)
    ]
    assert outside == []


@pytest.mark.slow
@pytest.mark.skipif(chromium() is None, reason="there is no Chromium on this machine")
def test_equations_are_drawn_without_errors_and_without_a_network(site: Path, tmp_path: Path) -> None:
    with browsing(tmp_path) as browser:
        for page in sorted((site / "docs" / "controllers").glob("*.html")):
            browser.call("Page.navigate", url=page.as_uri())
            assert browser.value(EQUATIONS_DRAWN) is True
            written = browser.value("document.querySelectorAll('.math').length")
            assert written > 0, page.name
            assert browser.value("document.querySelectorAll('mjx-container').length") == written, page.name
            assert browser.value("document.querySelectorAll('[data-mjx-error], mjx-merror').length") == 0
        assert [address for address in browser.requests if address.startswith("http")] == []
