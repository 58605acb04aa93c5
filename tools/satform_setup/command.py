# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The set-up at each start: checks, builds what is missing, and starts the program."""

from __future__ import annotations

import fcntl
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

from satform_setup.errors import SetupError, os_error_text
from satform_setup.layout import Layout, read_stamp
from satform_setup.ros_distribution import WHEELS, WHEELS_MARK, find_ros
from satform_setup.variables import applied, shell_variables
from satform_setup.virtual_environment import make_venv, rebuild_reason, remove_venv, venv_fits, wanted_venv
from satform_setup.workspace import build_workspace, remove_workspace, wanted_install

TYPE_CHECKING = False
if TYPE_CHECKING:
    from satform_setup.logged_process import Job

SETUP_FAILED = 2  # exit code of a set-up that could not be finished
INTERRUPTED = 130


def main(arguments: Sequence[str]) -> int:
    """Run `tools/satform`.

    Args:
        arguments: the command line after the program's name.

    Returns:
        Exit code, if no program was started in this process's place.
    """
    layout = Layout(Path(__file__).resolve().parents[2])
    try:
        return _run(layout, list(arguments), os.environ)
    except SetupError as error:
        print(f"satform: {error}", file=sys.stderr)
        return SETUP_FAILED
    except KeyboardInterrupt:
        print("\nsatform: interrupted; the next command repeats what was not finished", file=sys.stderr)
        return INTERRUPTED
    except OSError as error:
        print(f"satform: {os_error_text(error)}", file=sys.stderr)
        return SETUP_FAILED


def _run(layout: Layout, arguments: list[str], environment: Mapping[str, str]) -> int:
    ros = find_ros(environment)
    if arguments[:1] == ["setup"]:
        return _setup(layout, ros, arguments[1:], environment)
    if arguments[:1] == ["--version"]:
        print(f"satform {_version(layout)}")
        return 0
    stamp = finished(layout, ros) or ensure(layout, ros, environment, clean=False)
    variables = applied(stamp["variables"], shell_variables(ros, environment))
    if arguments[:1] == ["docs"] and not {"-h", "--help"} & set(arguments):
        _ensure_docs_packages(layout, ros, environment)
    # -P: a file of the folder the user stands in must not take a module's place.
    program = [str(layout.python), "-P", "-m", "satform_tools", *arguments]
    return _execute(arguments[1:] if arguments[:1] == ["exec"] else program, variables)


def _setup(layout: Layout, ros: str, options: list[str], environment: Mapping[str, str]) -> int:
    if any(option != "--clean" for option in options):
        raise SetupError("usage: satform setup [--clean]   (--clean makes a new environment)")
    clean = "--clean" in options
    if clean or not finished(layout, ros):
        ensure(layout, ros, environment, clean=clean)
    print(f"satform: the environment is ready ({layout.venv})", file=sys.stderr)
    return 0


def _version(layout: Layout) -> str:
    text = (layout.sources / "satform" / "package.xml").read_text(encoding="utf-8")
    return text.partition("<version>")[2].partition("</version>")[0]


def _execute(command: list[str], variables: dict[str, str]) -> NoReturn:
    if not command:
        raise SetupError("usage: satform exec COMMAND [ARGUMENT...]   (runs COMMAND in the environment)")
    try:
        os.execvpe(command[0], command, variables)  # noqa: S606 - no shell is wanted
    except FileNotFoundError:
        raise SetupError(f"there is no program {command[0]!r} in the environment or on the PATH") from None


def finished(layout: Layout, ros: str) -> dict[str, Any] | None:
    """Check, in a few milliseconds, that environment and build fit the sources.

    Args:
        layout: paths of the project.
        ros: where ROS comes from, see `find_ros`.

    Returns:
        The build's stamp, with the variables of programs, or None if there is something to do.
    """
    if not venv_fits(layout, ros):
        return None
    stamp = read_stamp(layout.install_stamp)
    wanted = wanted_install(layout, ros, read_stamp(layout.venv_stamp))
    return stamp if wanted == {name: stamp.get(name) for name in wanted} else None


def ensure(layout: Layout, ros: str, environment: Mapping[str, str], *, clean: bool) -> dict[str, Any]:
    """Set up what is missing, one process at a time.

    Args:
        layout: paths of the project.
        ros: where ROS comes from, see `find_ros`.
        environment: the shell's variables.
        clean: make everything again.

    Returns:
        The build's stamp.

    Raises:
        SetupError: the set-up could not be finished.
    """
    from satform_setup.logged_process import Job, end_orphans  # noqa: PLC0415 - later starts do without

    _require_own_folder(layout)
    with layout.launcher.open("rb") as lock:
        _take(lock)
        end_orphans(layout)
        job = Job(layout, ros, environment)
        if clean:
            remove_workspace(layout)
        renew = clean or not venv_fits(layout, ros)
        if renew:
            _renew_venv(job)
        # Sources saved while they are built make the stamp unfit at the next start, not now.
        fresh = finished(layout, ros)
        if fresh:
            return fresh
        stamp = build_workspace(job)
        _compile_bytecode(job, stamp, everything=renew)
        return stamp


def _ensure_docs_packages(layout: Layout, ros: str, environment: Mapping[str, str]) -> None:
    """Install what only the documentation site needs, if it is not there.

    Raises:
        SetupError: it could not be installed.
    """
    from satform_setup.installer import docs_packages_fit, install_docs_packages  # noqa: PLC0415
    from satform_setup.logged_process import Job, end_orphans  # noqa: PLC0415

    job = Job(layout, ros, environment)
    if docs_packages_fit(job):
        return
    with layout.launcher.open("rb") as lock:
        _take(lock)
        end_orphans(layout)
        if not docs_packages_fit(job):
            install_docs_packages(job, shell_variables(WHEELS, environment) | {WHEELS_MARK: "1"})


def _require_own_folder(layout: Layout) -> None:
    """Refuse to replace the environment of another user, with the reason for which it cannot be used.

    Raises:
        SetupError: the folder has an environment and this user may not write in it.
    """
    if not read_stamp(layout.venv_stamp) or os.access(layout.root, os.W_OK):
        return
    why = "it does not match the sources any more"
    if not os.access(layout.python, os.X_OK):
        why = f"this user may not run its Python, {os.path.realpath(layout.python)}"
    raise SetupError(
        f"the environment of {layout.root} is another user's, and {why}; have its owner run "
        f"{layout.launcher} setup --clean, with a Python that all users may run first on the PATH, or make a "
        "copy of the project"
    )


_OFTEN_IMPORTED = (
    *("satform_nodes.preload", "satform.bag.reader", "satform_bringup.supervisor.run"),
    *(
        "satform_tools.cli.main",
        "satform_tools.run.command",
        "satform_tools.report.command",
        "satform_tools.report.gallery",
    ),
    *("satform_tools.run.replay", "satform_tools.security.keystore"),
    *("satform.dynamics.inertial", "satform.dynamics.cw_perturbed", "satform.evaluation.attitude"),
    *("scipy.integrate", "scipy.linalg", "scipy.optimize", "scipy.signal", "scipy.stats"),
    *(
        "scipy.spatial.transform",
        "brahe",
        "matplotlib.backends.backend_agg",
        "matplotlib.backends.backend_svg",
    ),
    *("networkx", "hypothesis", "pytest", "xdist", "xdist.workermanage", "xdist.remote", "xdist.dsession"),
    *("pytest_cov.plugin", "pytest_rerunfailures", "pygments.lexers", "jsonschema", "rosbags.highlevel"),
    *("mcap_ros2.reader", "jinja2", "arro3.io"),
)
"""Modules from which nearly everything else is imported that is imported at all."""

_IMPORT_ALL = """
import contextlib, importlib, sys
for name in sys.argv[1:]:
    with contextlib.suppress(ImportError):
        importlib.import_module(name)
"""


_COMPILE = "import compileall, sys; [compileall.compile_dir(folder, quiet=2) for folder in sys.argv[1:]]"


def _compile_bytecode(job: Job, stamp: dict[str, Any], *, everything: bool) -> None:
    """Compile what nodes, command line and tests import, once: else every process would do it again.

    pip and uv leave that to the first import, which keeps nothing where `PYTHONDONTWRITEBYTECODE` is set or
    another user has made the environment. Nothing depends on its success.

    Args:
        job: the set-up.
        stamp: of the build.
        everything: whether the environment is new; else only the project's own modules are compiled, where
            they have changed.
    """
    from satform_setup.logged_process import Progress, run_logged  # noqa: PLC0415 - later starts do without

    variables = applied(stamp["variables"], shell_variables(job.ros, job.environment))
    variables.pop("PYTHONDONTWRITEBYTECODE", None)
    python = [str(job.layout.python), "-P", "-c"]
    own = [str(folder) for folder in (job.layout.install / "lib", job.layout.root / "tools")]
    what = "what is imported" if everything else "the project's own modules"
    progress = Progress(f"compiling {what} (a few seconds)")
    run_logged(job, [*python, _COMPILE, *own], variables, progress, job.layout.root)
    if everything:
        run_logged(job, [*python, _IMPORT_ALL, *_OFTEN_IMPORTED], variables, progress, job.layout.root)
    progress.end()


def _take(lock: BinaryIO) -> None:
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        print("satform: another satform is setting up this folder; waiting for it to finish", file=sys.stderr)
        fcntl.flock(lock, fcntl.LOCK_EX)


def _renew_venv(job: Job) -> None:
    from satform_setup.machine import check_machine  # noqa: PLC0415 - later starts do without

    layout = job.layout
    reason = rebuild_reason(read_stamp(layout.venv_stamp), wanted_venv(layout, job.ros))
    if Path(sys.executable).parent == layout.python.parent:
        # This Python belongs to what is about to be removed: the launcher looks for another and starts over.
        print(f"satform: {reason}", file=sys.stderr)
        remove_venv(layout)
        _execute([str(layout.launcher), *sys.argv[1:]], dict(job.environment))
    check_machine(layout.root, job.ros, job.environment)
    remove_venv(layout)
    print("satform: making the environment of this folder: once, a few minutes, 1 GB", file=sys.stderr)
    make_venv(job)
