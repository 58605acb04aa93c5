# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Combine the coverage data of the tests, print each package's figures, and fail below its minimum.

Usage:
    python tools/lint/coverage_figures.py
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

MINIMUM = {"satform": 90.0, "satform_nodes": 80.0, "satform_bringup": 80.0}
"""Least fraction of a package's branches that the tests have to take, %."""


def figures(files: dict[str, dict[str, dict[str, int]]], package: str) -> tuple[float, float]:
    """The coverage of a package.

    Args:
        files: path -> entry, as in the JSON report of coverage.
        package: name of the package.

    Returns:
        Shares of its statements and of its branches that were executed, %.

    Raises:
        KeyError: the report has no file of the package.
    """
    folder = f"ros_ws/src/{package}/{package}/"
    found = [entry["summary"] for name, entry in files.items() if name.startswith(folder)]
    if not found:
        raise KeyError(f"no coverage data of {package}")

    def percentage(part: str, whole: str) -> float:
        return 100.0 * sum(entry[part] for entry in found) / sum(entry[whole] for entry in found)

    return percentage("covered_lines", "num_statements"), percentage("covered_branches", "num_branches")


def main() -> int:
    """Print the figures of every package.

    Returns:
        0 when each has its minimum, else 1.
    """
    coverage = [sys.executable, "-m", "coverage"]
    subprocess.run([*coverage, "combine", "--quiet"], cwd=ROOT, check=True)
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "coverage.json"
        subprocess.run([*coverage, "json", "--quiet", "-o", str(report)], cwd=ROOT, check=True)
        files = json.loads(report.read_text(encoding="utf-8"))["files"]
    failed = False
    for package, minimum in MINIMUM.items():
        statements, branches = figures(files, package)
        needed = f"at least {minimum:g} %"
        print(f"{package}: {statements:.1f} % of statements, {branches:.1f} % of branches ({needed})")
        failed |= branches < minimum
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
