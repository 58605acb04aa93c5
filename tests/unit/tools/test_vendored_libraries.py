# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""JavaScript libraries in the repository: versions of the lock file, with their licences."""

import json
import re
from pathlib import Path

import pytest

from satform_tools import scene

FOLDER = Path(scene.__file__).parent
LOCK = json.loads((FOLDER / "package-lock.json").read_text(encoding="utf-8"))["packages"]
SHIPPED = {"three": "three.js", "world-atlas": "three.js", "uplot": "uplot.js"}


@pytest.mark.parametrize("name", SHIPPED)
def test_a_library_has_the_version_of_the_lock_file_and_its_licence_beside_it(name: str) -> None:
    entry = LOCK[f"node_modules/{name}"]
    assert entry["integrity"].startswith("sha512-")
    banner = (FOLDER / "vendor" / SHIPPED[name]).read_text(encoding="utf-8").partition("\n")[0]
    found = dict(re.findall(r"([\w.-]+) (\d+\.\d+\.\d+)", banner))
    title = {"three": "three.js", "uplot": "uPlot"}.get(name, name)
    assert found[title] == entry["version"]
    licences = (FOLDER / "vendor" / "LICENSES.txt").read_text(encoding="utf-8")
    assert f"{name} {entry['version']}:" in licences


def test_the_licence_of_each_library_is_permissive() -> None:
    assert {LOCK[f"node_modules/{name}"]["license"] for name in SHIPPED} <= {"MIT", "ISC"}
