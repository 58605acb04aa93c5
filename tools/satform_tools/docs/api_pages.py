# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Pages of the Python API, one for each package, made from what can be imported."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import zlib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

PACKAGES = ("satform", "satform_nodes", "satform_bringup")
"""Packages whose public functions and classes are on the site."""


def public_modules() -> Iterator[str]:
    """Every module of the packages, a package before its parts, without those whose name begins with `_`."""
    for package in PACKAGES:
        yield package
        path = importlib.import_module(package).__path__
        for found in pkgutil.walk_packages(path, f"{package}."):
            if not any(part.startswith("_") for part in found.name.split(".")):
                yield found.name


def public_names(module: ModuleType) -> list[str]:
    """Functions and classes that a module defines and whose names do not begin with `_`."""
    return [
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and (inspect.isfunction(value) or inspect.isclass(value))
        and value.__module__ == module.__name__
    ]


def write(folder: Path) -> None:
    """Write a page for each package, and remove those of packages that are no more.

    Args:
        folder: for the pages; an unchanged page keeps its time, so that Sphinx need not read it again.
    """
    modules = list(public_modules())
    packages = [name for name in modules if hasattr(importlib.import_module(name), "__path__")]
    pages = {"index": _index()}
    for name in packages:
        parts = [other for other in modules if other.rpartition(".")[0] == name]
        pages[name] = _page(name, [part for part in parts if part not in packages])
        pages[name] += _contents([part for part in parts if part in packages])
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.rst"):
        if old.stem not in pages:
            old.unlink()
    for name, text in pages.items():
        path = folder / f"{name}.rst"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def missing(inventory: Path) -> list[str]:
    """Public modules, functions and classes that a built site does not describe.

    Args:
        inventory: `objects.inv` of the site.

    Returns:
        Their full names.
    """
    described = described_names(inventory)
    wanted = []
    for name in public_modules():
        module = importlib.import_module(name)
        wanted += [name, *(f"{name}.{member}" for member in public_names(module))]
    return [name for name in wanted if name not in described]


def described_names(inventory: Path) -> set[str]:
    """Full names of the Python objects that a built site describes.

    Args:
        inventory: `objects.inv` of the site: four lines of text, then compressed lines that begin with a name
            and its role.
    """
    *_, packed = inventory.read_bytes().split(b"\n", 4)
    lines = zlib.decompress(packed).decode("utf-8").splitlines()
    return {line.split(" ", 2)[0] for line in lines if line.split(" ", 2)[1].startswith("py:")}


def _title(name: str, line: str) -> str:
    text = name.replace("_", "\\_")
    return f"{text}\n{line * len(text)}\n\n"


def _contents(names: list[str]) -> str:
    if not names:
        return ""
    return ".. toctree::\n   :maxdepth: 1\n\n" + "".join(f"   {name}\n" for name in names) + "\n"


def _index() -> str:
    text = _title("Python API", "=")
    text += (
        "Every public function and class, from the docstrings of the code. ``satform`` is the library, which "
        "needs no ROS; ``satform_nodes`` has the nodes and ``satform_bringup`` starts them.\n\n"
    )
    return text + _contents(list(PACKAGES))


def _page(name: str, modules: list[str]) -> str:
    text = _title(name, "=") + _automodule(name) + _exported(name)
    return text + "".join(_title(module, "-") + _automodule(module) for module in modules)


def _automodule(name: str) -> str:
    # What a package takes from its modules is described there alone.
    return f".. automodule:: {name}\n   :members:\n   :ignore-module-all:\n   :show-inheritance:\n\n"


def _exported(name: str) -> str:
    """Links to what a package has in `__all__` and one of its modules defines."""
    package = importlib.import_module(name)
    lines = []
    for exported in sorted(getattr(package, "__all__", ())):
        value = getattr(package, exported)
        home = getattr(value, "__module__", name)
        if home != name and (inspect.isfunction(value) or inspect.isclass(value)):
            lines.append(f"* ``{exported}``: :py:obj:`{home}.{value.__qualname__}`\n")
    return "Also importable from here:\n\n" + "".join(lines) + "\n" if lines else ""
