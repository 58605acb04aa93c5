# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Package description of `satform_bringup`, with its launch files."""

from pathlib import Path

from setuptools import find_packages, setup

setup(
    name="satform_bringup",
    version="0.2.0",
    packages=find_packages(include=["satform_bringup", "satform_bringup.*"]),
    package_data={"satform_bringup": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/satform_bringup"]),
        ("share/satform_bringup", ["package.xml"]),
        ("share/satform_bringup/launch", sorted(map(str, Path("launch").glob("*.launch.py")))),
        ("share/satform_bringup/layouts", sorted(map(str, Path("layouts").iterdir()))),
    ],
    install_requires=["setuptools"],
    # `colcon test` looks for pytest here; named in tests_require it runs no test and reports success.
    extras_require={"test": ["pytest"]},
    zip_safe=False,
)
