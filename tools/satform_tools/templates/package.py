# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `new`: makes a package with a part of one's own, which flies and is tested as it is.

Each kind of part has a folder here with a module, a scenario and a test of an example. The name of the new
part is put in the place of that of the example.
"""

import importlib.util
import keyword
import re
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

from satform.common.spec import specs
from satform.files.durable_file import write_durably
from satform_tools import console
from satform_tools.errors import CommandError, sentence_of
from satform_tools.templates.kinds import PartKind

TEMPLATES = Path(__file__).parent

_HEADER_LINES = 2
"""Copyright and licence at the beginning of each file, which are not those of the new package."""

_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")


@dataclass(frozen=True)
class Template:
    """The example of a kind of part.

    Attributes:
        group: of entry points.
        name: of the example: of its module, its kind and its scenario.
        spec: its specification class.
        about: what the kind of part is, with its article.
    """

    group: str
    name: str
    spec: str
    about: str


KINDS = {
    PartKind.CONTROLLER: Template(
        "satform.controllers", "spring_damper", "SpringDamperSpec", "a control law"
    ),
    PartKind.CURVE: Template(
        "satform.curves", "projected_circle", "ProjectedCircleSpec", "a reference orbit"
    ),
    PartKind.CONSENSUS: Template(
        "satform.consensus", "limited_coupling", "LimitedCouplingSpec", "a consensus law"
    ),
    PartKind.PERTURBATION: Template(
        "satform.perturbations", "timed_pulse", "TimedPulseSpec", "a perturbation"
    ),
    PartKind.DYNAMICS: Template(
        "satform.dynamics", "elastic_tether", "ElasticTetherSpec", "a dynamics model"
    ),
    PartKind.METRIC: Template("satform.metrics", "time_outside", "TimeOutside", "a figure of a flight"),
    PartKind.SENSOR: Template("satform.sensors", "beacon_ranging", "BeaconRangingSpec", "a sensor"),
    PartKind.TOPOLOGY: Template(
        "satform.topologies", "binary_tree", "BinaryTreeSpec", "a communication graph"
    ),
}
"""The example of each kind of part."""


def make(kind: PartKind, name: str, out: Path | None) -> Path:
    """Make a package.

    Args:
        kind: of the part.
        name: of the part and its module.
        out: folder, new or empty; None for one of that name in the working directory.

    Returns:
        The folder.

    Raises:
        CommandError: the name cannot be used, or the folder cannot be written.
    """
    template = KINDS[kind]
    _require_usable(name, template)
    folder = out or Path(name)
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise CommandError(f"{folder} already exists and is not an empty folder; name another with --out")
        for path, text in _files(kind, name).items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            write_durably(folder / path, text.encode())
    except OSError as error:
        raise CommandError(f"the package cannot be written: {sentence_of(error)}") from None
    return folder


def describe(folder: Path, name: str) -> None:
    """Print what can be done with a new package."""
    console.line(
        f"{folder}: a package with the kind {name}; its test and its scenario can be used as they are:"
    )
    console.line(f"  PYTHONPATH={folder} satform exec python -m pytest {folder}")
    console.line(f"  PYTHONPATH={folder} satform run {folder / name}.yaml")
    console.line("To install it, so that it is found without PYTHONPATH and edits take effect at once:")
    console.line(f"  satform exec python -m pip install --no-deps --no-build-isolation -e {folder}")


def _require_usable(name: str, template: Template) -> None:
    """Check the name of a new part.

    Raises:
        CommandError: it cannot be used.
    """
    if not _NAME.fullmatch(name) or keyword.iskeyword(name):
        raise CommandError(
            f"{name!r} cannot be the name of a part: it has lower case letters, digits and underscores, a "
            "letter first, at most 40 of them, and is no keyword of Python"
        )
    if name in specs(template.group):
        raise CommandError(f"there is {template.about} of the kind {name!r} already; choose another name")
    if name in sys.stdlib_module_names or importlib.util.find_spec(name) is not None:
        raise CommandError(f"there is a Python module of the name {name!r} already; choose another name")


def _files(kind: PartKind, name: str) -> dict[str, str]:
    """Text of each file of a new package by its path."""
    template = KINDS[kind]
    files = {"pyproject.toml": _pyproject(template, name)}
    for source in sorted((TEMPLATES / kind).iterdir()):
        if source.suffix in {".py", ".yaml"}:
            files[source.name.replace(template.name, name)] = _renamed(_body(source), template.name, name)
    return files | _metadata(name, files["pyproject.toml"])


def _pyproject(template: Template, name: str) -> str:
    spec = template.spec.replace(_camel(template.name), _camel(name))
    text = _body(TEMPLATES / "pyproject.toml")
    text = text.replace("A KIND", template.about[0].upper() + template.about[1:]).replace("CLASS", spec)
    text = text.replace("GROUP", template.group).replace("my-part", name.replace("_", "-"))
    return text.replace("my_part", name)


def _metadata(name: str, pyproject: str) -> dict[str, str]:
    """What an installation would write beside the module: so it is found by PYTHONPATH alone."""
    project = tomllib.loads(pyproject)["project"]
    lines = [
        line
        for group, entries in project["entry-points"].items()
        for line in (f"[{group}]", *(f"{key} = {value}" for key, value in entries.items()))
    ]
    about = f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    folder = f"{name}.egg-info"
    return {f"{folder}/PKG-INFO": about, f"{folder}/entry_points.txt": "\n".join(lines) + "\n"}


def _body(file: Path) -> str:
    return "".join(file.read_text(encoding="utf-8").splitlines(keepends=True)[_HEADER_LINES:])


def _renamed(text: str, old: str, new: str) -> str:
    return text.replace(old, new).replace(_camel(old), _camel(new))


def _camel(name: str) -> str:
    return "".join(part.capitalize() for part in name.split("_"))
