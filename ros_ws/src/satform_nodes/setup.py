"""Package description of `satform_nodes`, with the programs `ros2 run` finds in it."""

from setuptools import find_packages, setup

setup(
    name="satform_nodes",
    version="0.1.0",
    packages=find_packages(include=["satform_nodes", "satform_nodes.*"]),
    package_data={"satform_nodes": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/satform_nodes"]),
        ("share/satform_nodes", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    # `colcon test` looks for pytest here; named in tests_require it runs no test and reports success.
    extras_require={"test": ["pytest"]},
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "plant_node = satform_nodes.plant_node:main",
            "satellite_node = satform_nodes.satellite_node:main",
            "group_node = satform_nodes.group_node:main",
            "recorder_node = satform_nodes.recorder_node:main",
            "display_node = satform_nodes.display_node:main",
        ],
    },
)
