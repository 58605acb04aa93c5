# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Each ROS package names what it imports, and nothing else."""

import ast
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
SOURCES = ROOT / "ros_ws" / "src"

DEPENDENCIES = {
    "annotated_types": "python3-pydantic",
    "numpy": "python3-numpy",
    "pydantic": "python3-pydantic",
    "pydantic_core": "python3-pydantic",
    "ruamel": "python3-ruamel.yaml",
    "scipy": "python3-scipy",
    "yaml": "python3-yaml",
    **{
        name: name
        for name in (
            "ament_index_python",
            "builtin_interfaces",
            "diagnostic_msgs",
            "geometry_msgs",
            "launch",
            "launch_ros",
            "nav_msgs",
            "rcl_interfaces",
            "rclpy",
            "rosgraph_msgs",
            "satform",
            "satform_bringup",
            "satform_msgs",
            "satform_nodes",
            "satform_transport",
            "sensor_msgs",
            "std_msgs",
            "std_srvs",
            "tf2_msgs",
            "type_description_interfaces",
            "visualization_msgs",
        )
    },
}
"""What a package depends on that imports a module."""

FROM_PIP = {"brahe", "mcap", "rosbags"}
"""Imports that rosdep has no name for."""

EXTRAS = {"arro3", "clarabel", "distributed", "matplotlib", "mpl_toolkits", "pandas", "sgp4", "xarray"}
"""Imports of the library's optional features, made where they are needed; extras of its `setup.py`."""

FROM_MCAP = {"lz4", "zstandard"}
"""Imports that come with mcap, which depends on them itself."""

DEVELOPMENT = {"Python3": "python3-dev"}
"""Names of rosdep of what CMake finds under another one."""

BY_NAME = {"satform_bringup": {"satform_nodes"}}
"""What a package starts without importing it."""


def imports(package: str) -> set[str]:
    """Modules from elsewhere that the sources of a package import, wherever in a file they do."""
    found: set[str] = set()
    folder = SOURCES / package
    for file in [*(folder / package).rglob("*.py"), *(folder / "launch").glob("*.py")]:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found.add(node.module.partition(".")[0])
    return found - sys.stdlib_module_names - {package}


def declared(package: str) -> set[str]:
    description = ET.parse(SOURCES / package / "package.xml")  # noqa: S314
    return {entry.text or "" for tag in ("depend", "exec_depend") for entry in description.iter(tag)}


@pytest.mark.parametrize("package", ["satform", "satform_nodes", "satform_bringup"])
def test_a_package_depends_on_what_it_imports_and_on_nothing_else(package: str) -> None:
    needed = {DEPENDENCIES[name] for name in imports(package) - FROM_PIP - FROM_MCAP - EXTRAS}
    assert declared(package) == needed | BY_NAME.get(package, set())


@pytest.mark.parametrize("package", ["satform_msgs", "satform_transport"])
def test_a_compiled_package_depends_on_the_packages_that_it_is_built_with(package: str) -> None:
    build = (SOURCES / package / "CMakeLists.txt").read_text()
    found = {DEVELOPMENT.get(name, name) for name in re.findall(r"find_package\((\w+)", build)}
    description = ET.parse(SOURCES / package / "package.xml")  # noqa: S314
    tags = ("depend", "build_depend", "buildtool_depend")
    assert found == {entry.text for tag in tags for entry in description.iter(tag)}


def test_what_rosdep_has_no_name_for_is_pinned_and_named_where_people_look() -> None:
    pinned = set(re.findall(r"^([\w.-]+)==", (ROOT / "requirements.txt").read_text(), re.MULTILINE))
    assert pinned >= FROM_PIP | FROM_MCAP
    description = (SOURCES / "satform" / "package.xml").read_text()
    assert all(name in description for name in FROM_PIP)
    page = (ROOT / "docs" / "install.md").read_text()
    versions = dict(re.findall(r'"([\w.-]+)==([\w.]+)"', page))
    pins = dict(re.findall(r"^([\w.-]+)==([\w.]+)", (ROOT / "requirements.txt").read_text(), re.MULTILINE))
    assert set(versions) >= FROM_PIP
    assert versions == {name: pins[name] for name in versions}


@pytest.mark.parametrize(
    ("package", "data"),
    [("satform", set()), ("satform_nodes", set()), ("satform_bringup", {"launch", "layouts"})],
)
def test_the_readme_of_a_package_describes_its_sub_packages_and_nothing_else(
    package: str, data: set[str]
) -> None:
    text = (SOURCES / package / "README.md").read_text(encoding="utf-8")
    table = text.partition("| folder | content |\n")[2].partition("\n\n")[0]
    cells = [line.split("|")[1] for line in table.splitlines()[1:]]
    described = {name for cell in cells for name in re.findall(r"`(\w+)/`", cell)}
    assert described == data | {
        file.parent.name for file in (SOURCES / package / package).glob("*/__init__.py")
    }


def test_exit_codes_are_defined_in_one_place() -> None:
    defined = {
        file.name
        for folder in (SOURCES, ROOT / "tools")
        for file in folder.rglob("*.py")
        if re.search(r"^EXIT_\w+ *=", file.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert defined == {"exit_codes.py"}


def test_colcon_in_the_environment_lists_the_packages_and_what_they_are(tmp_path: Path) -> None:
    command = ["colcon", "--log-base", str(tmp_path), "list", "--base-paths", str(SOURCES)]
    listed = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout
    found = {line.split()[0]: line.split()[-1] for line in listed.splitlines()}
    assert found == {
        "satform": "(ros.ament_python)",
        "satform_bringup": "(ros.ament_python)",
        "satform_msgs": "(ros.ament_cmake)",
        "satform_nodes": "(ros.ament_python)",
        "satform_transport": "(ros.ament_cmake)",
    }
