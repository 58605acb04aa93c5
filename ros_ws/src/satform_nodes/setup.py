# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Package description of `satform_nodes`, with the executables for `ros2 run`."""

from setuptools import find_packages, setup

PROGRAMS = ("plant", "satellite", "group", "recorder", "display")

setup(
    name="satform_nodes",
    version="0.2.0",
    packages=find_packages(include=["satform_nodes", "satform_nodes.*"]),
    package_data={"satform_nodes": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/satform_nodes"]),
        ("share/satform_nodes", ["package.xml"]),
        # Plain files: scripts that are generated for entry points import much before a signal is handled.
        ("lib/satform_nodes", [f"scripts/{name}_node" for name in PROGRAMS]),
    ],
    install_requires=["setuptools"],
    # `colcon test` looks for pytest here; named in tests_require it runs no test and reports success.
    extras_require={"test": ["pytest"]},
    zip_safe=False,
)
