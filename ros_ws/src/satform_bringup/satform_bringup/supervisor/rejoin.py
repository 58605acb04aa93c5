# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Restart of one process of a running flight by hand, so that a lost satellite rejoins.

Restarts by plan and by policy are in `supervisor`.
"""

from collections.abc import Iterable
from pathlib import Path

from satform.common.exit_codes import EXIT_BAD_INPUT
from satform.common.name_list import listed
from satform.common.printable_text import printable
from satform.files.bounded_file import read_json
from satform_bringup import LOG_FOLDER, PROCESSES_FILE
from satform_bringup.deployment.domain_lock import HIGHEST
from satform_bringup.deployment.external_nodes import ENVIRONMENT_FILE
from satform_bringup.deployment.node_processes import NodeProcess
from satform_bringup.supervisor import process_server
from satform_bringup.supervisor.supervisor import SHUTDOWN_TIMEOUT

_LOOK = 0.1
"""Wall-clock time between two looks at whether someone asked to stop, s."""


_MOST_BYTES = 100_000_000
"""Size of the largest file that is taken for the processes of a run."""


class RejoinError(ValueError):
    """A process cannot be started again; the message says why, and what would be right."""


def process_of(run: Path, name: str) -> tuple[NodeProcess, int, dict[str, str]]:
    """What a run's process was started with.

    Args:
        run: folder of the run.
        name: of the process: a satellite, or a group.

    Returns:
        The process, the DDS domain of the run, and what its processes have in their environment.

    Raises:
        RejoinError: the folder is no run over DDS, or there is no such process in it.
    """
    file = run / PROCESSES_FILE
    try:
        kept = read_json(file, _MOST_BYTES)
        nodes = {node["name"]: NodeProcess(**node) for node in kept["nodes"]}
        domain, environment = int(kept["domain"]), dict(kept["environment"])
        external = list(kept.get("external", []))
        _require_startable(nodes.values(), domain, environment)
    except OSError as error:
        sentence = f"{file}: cannot be read: {error.strerror}; name the folder of a run that is under way"
        raise RejoinError(sentence) from None
    except (ValueError, KeyError, TypeError):
        raise RejoinError(f"{file}: does not describe the processes of a run") from None
    if name in external:
        raise RejoinError(
            f"{run}: {name} is external; start its program again, with the environment of "
            f"{run / ENVIRONMENT_FILE}"
        )
    if name not in nodes or nodes[name].executable not in ("satellite_node", "group_node"):
        satellites = [node.name for node in nodes.values() if node.executable.startswith(("sat", "group"))]
        raise RejoinError(f"{run}: has no satellite {name}; there are {printable(listed(satellites))}")
    return nodes[name], domain, environment | nodes[name].environment


def _require_startable(nodes: Iterable[NodeProcess], domain: int, environment: dict[str, str]) -> None:
    """Check that processes can be started as a file says.

    Raises:
        ValueError: they cannot.
    """
    texts = [*environment, *environment.values()]
    for node in nodes:
        if not isinstance(node.parameters, dict):
            raise ValueError("parameters have names")
        texts += [node.name, node.executable, node.enclave, node.namespace, *node.parameters]
        if not isinstance(node.environment, dict):
            raise TypeError("the environment of a process is a table of variables")
        texts += [*node.environment, *node.environment.values()]
    if not all(isinstance(text, str) and "\0" not in text for text in texts):
        raise ValueError("names and variables of the environment are texts")
    if not 0 <= domain <= HIGHEST:
        raise ValueError(f"{domain} is no DDS domain")


def rejoin(run: Path, name: str) -> int:
    """Start a lost satellite's process again, and stay until it ends.

    Args:
        run: folder of a run that is under way.
        name: of the satellite's process.

    Returns:
        The process's exit code.

    Raises:
        RejoinError: there is no such process, or the satellite is not lost.
        OSError: it cannot be started.
    """
    node, domain, environment = process_of(run, name)
    log = _free(run / LOG_FOLDER, name)
    process, pipe = process_server.start(node.executable, node.arguments(), domain, log, environment)
    try:
        while process.exitcode is None:
            process.join(_LOOK)
            while pipe.poll():
                try:
                    pipe.recv()
                except EOFError:
                    break
    except KeyboardInterrupt:
        process.terminate()
        process.join(SHUTDOWN_TIMEOUT)
        if process.exitcode is None:
            process.kill()
            process.join()
    code = process.exitcode or 0
    pipe.close()
    process.close()
    if code == EXIT_BAD_INPUT:
        raise RejoinError(_last_line(log))
    return code


def _last_line(log: Path) -> str:
    """The last line in a node's log, without the prefix of its logger."""
    lines = log.read_text(errors="replace").strip().splitlines() or ["it printed no output"]
    return lines[-1].rpartition("]: ")[2]


def _free(folder: Path, name: str) -> Path:
    """A new file for the output of a process."""
    number = 1
    while (folder / f"{name}.again{number}.log").exists():
        number += 1
    return folder / f"{name}.again{number}.log"
