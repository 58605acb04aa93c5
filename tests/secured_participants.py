# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Small DDS participants, written in C and C++, that take part with the keys of a formation's keystore.

`tests/dds_security/cyclone_participant.c` says which lines they read and print.
"""

import os
import select
import subprocess
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol
from xml.sax.saxutils import escape

SOURCES = Path(__file__).parent / "dds_security"

LONGEST = 60.0
"""For which a participant waits for what has to happen, s."""

_ANSWER = LONGEST + 30.0
"""For which the test waits for a participant, s."""

CYCLONE_CONFIGURATION = """<CycloneDDS><Domain id="any">
<General><Interfaces><NetworkInterface name="lo"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General>
<Discovery><Peers><Peer address="127.0.0.1"/></Peers><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>20</MaxAutoParticipantIndex><SPDPInterval>1s</SPDPInterval></Discovery>{security}
</Domain></CycloneDDS>"""
"""On loopback alone. Participants announce themselves every second, so that one that missed an announcement
while it was busy does not wait for half a minute, the time between two by default."""

CYCLONE_SECURITY = """
<Security>
<Authentication><Library path="{libraries}/libdds_security_auth.so" initFunction="init_authentication"
finalizeFunction="finalize_authentication"/>
<IdentityCA>file:{enclave}/identity_ca.cert.pem</IdentityCA>
<IdentityCertificate>file:{enclave}/cert.pem</IdentityCertificate>
<PrivateKey>file:{enclave}/key.pem</PrivateKey></Authentication>
<AccessControl><Library path="{access_control}" initFunction="init_{functions}"
finalizeFunction="finalize_{functions}"/>
<PermissionsCA>file:{enclave}/permissions_ca.cert.pem</PermissionsCA>
<Governance>file:{enclave}/governance.p7s</Governance>
<Permissions>file:{enclave}/permissions.p7s</Permissions></AccessControl>
<Cryptographic><Library path="{libraries}/libdds_security_crypto.so" initFunction="init_crypto"
finalizeFunction="finalize_crypto"/></Cryptographic>
</Security>"""


class Program(Protocol):
    """A participant's program.

    Attributes:
        executable: of the participant.
    """

    @property
    def executable(self) -> Path: ...

    def variables(self, enclave: Path | None, *, own_checks: bool = True) -> dict[str, str]:
        """Environment of a participant.

        Args:
            enclave: folder with its keys; None for a participant without security.
            own_checks: whether its own DDS keeps it to its permissions.
        """


class NotBuiltError(RuntimeError):
    """The participants cannot be built on this machine; the message says what is missing."""


@dataclass(frozen=True)
class CycloneProgram:
    """A participant on Cyclone DDS, and what it needs to take part with keys.

    Attributes:
        executable: of the participant.
        libraries: folder of the security plug-ins of Cyclone DDS.
        own_checks_off: plug-in for access control that permits its own participant everything.
    """

    executable: Path
    libraries: Path
    own_checks_off: Path

    def variables(self, enclave: Path | None, *, own_checks: bool = True) -> dict[str, str]:
        """Environment of a participant.

        Args:
            enclave: folder with its keys; None for a participant without security.
            own_checks: whether its own DDS keeps it to its permissions.
        """
        control = self.libraries / "libdds_security_ac.so"
        security = CYCLONE_SECURITY.format(
            libraries=self.libraries,
            enclave=escape(str(enclave)),
            access_control=control if own_checks else self.own_checks_off,
            functions="access_control" if own_checks else "own_checks_off",
        )
        configuration = CYCLONE_CONFIGURATION.format(security="" if enclave is None else security)
        return {"CYCLONEDDS_URI": configuration, "ACCESS_CONTROL_LIBRARY": str(control)}


@dataclass(frozen=True)
class FastDdsProgram:
    """A participant on Fast DDS.

    Attributes:
        executable: of the participant.
    """

    executable: Path

    def variables(self, enclave: Path | None, *, own_checks: bool = True) -> dict[str, str]:
        """Environment of a participant, whose own DDS always keeps it to its permissions."""
        assert own_checks, "Fast DDS has its access control compiled in"
        return {} if enclave is None else {"ENCLAVE": str(enclave)}


def build_fastdds(folder: Path) -> FastDdsProgram:
    """Build the participant on Fast DDS.

    Raises:
        NotBuiltError: Fast DDS or a compiler are missing.
    """
    if not Path("/usr/include/fastdds/rtps/security").is_dir():
        raise NotBuiltError("there is no Fast DDS with security (apt install libfastrtps-dev)")
    source = str(SOURCES / "fastdds_participant.cpp")
    flags = ("-Wall", "-Wextra", "-Werror")
    _call(folder, "c++", *flags, "-o", "fastdds_participant", source, "-lfastrtps", "-lfastcdr")
    return FastDdsProgram(folder / "fastdds_participant")


def build_cyclone(folder: Path) -> CycloneProgram:
    """Build the participant on Cyclone DDS.

    Raises:
        NotBuiltError: Cyclone DDS, its security plug-ins or a compiler are missing.
    """
    plugins = sorted(Path("/usr/lib").glob("*/libddsc*/libdds_security_ac.so"))
    if not plugins or not Path("/usr/include/dds/dds.h").exists():
        raise NotBuiltError("there is no Cyclone DDS with security (apt install cyclonedds-dev)")
    _call(folder, "idlc", "-l", "c", str(SOURCES / "Sample.idl"))
    flags = ("-O1", "-Wall", "-Wextra", "-Werror", "-I.")
    _call(
        *(folder, "cc", *flags, "-o", "cyclone_participant", str(SOURCES / "cyclone_participant.c")),
        *("Sample.c", "-lddsc"),
    )
    shared = ("-fPIC", "-shared", "-o", "own_checks_off.so", str(SOURCES / "own_checks_off.c"), "-ldl")
    _call(folder, "cc", *flags, *shared)
    return CycloneProgram(folder / "cyclone_participant", plugins[0].parent, folder / "own_checks_off.so")


def _call(folder: Path, *command: str) -> None:
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    except FileNotFoundError:
        raise NotBuiltError(f"there is no program {command[0]}") from None
    assert done.returncode == 0, done.stderr


@dataclass
class Participant:
    """A participant's process.

    Attributes:
        name: by which it signs its samples.
        process: of the participant.
        log: file with what its DDS reports.
        refused: what its own DDS refused: kind of endpoint and topic, with the reason.
        matched: number of remote endpoints of each of its endpoints.
        received: number of samples by topic and writer.
    """

    name: str
    process: subprocess.Popen[bytes]
    log: Path
    refused: dict[tuple[str, str], str] = field(default_factory=dict)
    matched: dict[tuple[str, str], int] = field(default_factory=dict)
    received: dict[tuple[str, str], int] = field(default_factory=dict)
    _rest: bytes = b""

    def send(self, *lines: str) -> None:
        """Have it do something."""
        assert self.process.stdin is not None
        self.process.stdin.write("".join(f"{line}\n" for line in lines).encode())
        self.process.stdin.flush()

    def line(self) -> list[str]:
        """Words of the next line of its output."""
        assert self.process.stdout is not None
        end = time.monotonic() + _ANSWER
        while b"\n" not in self._rest:
            ready, _, _ = select.select([self.process.stdout], [], [], max(0.0, end - time.monotonic()))
            assert ready, f"{self.name} gave no answer within {_ANSWER:g} s"
            data = os.read(self.process.stdout.fileno(), 65536)
            assert data, f"{self.name} ended with exit code {self.process.wait(10)}"
            self._rest += data
        line, _, self._rest = self._rest.partition(b"\n")
        return line.decode().split(" ")

    def joined(self) -> bool:
        """Whether its DDS lets it join the domain, with what the security plug-ins print left out."""
        while (words := self.line())[0] not in {"joined", "refused"}:
            pass
        return words == ["joined"]

    def take_answers(self, made: int = 0) -> None:
        """Read its answers: to requests for as many endpoints, or to another one up to its end."""
        while made:
            word, kind, topic, *reason = self.line()
            if word == "refused":
                self.refused[kind, topic] = " ".join(reason)
            else:
                assert word == "made", word
            made -= 1
            if not made:
                return
        while (words := self.line()) != ["done"]:
            assert words[0] in {"matched", "received"}, " ".join(words)
            table = self.matched if words[0] == "matched" else self.received
            table[words[1], words[2]] = int(words[3])


Endpoints = Mapping[tuple[str, str], int]
"""Number of remote endpoints that an endpoint is to have, by `publish` or `subscribe` and topic."""


class Participants:
    """Participants of one domain, ended with the test."""

    def __init__(self, domain: int, logs: Path) -> None:
        self.domain = domain
        self._logs = logs
        self._started: list[Participant] = []

    def start(
        self, executable: Path, name: str, variables: Mapping[str, str], domain: int | None = None
    ) -> Participant:
        """Start a participant, without waiting for it.

        Args:
            executable: of the participant.
            name: by which it signs its samples.
            variables: its environment.
            domain: another one than that of all.
        """
        number = self.domain if domain is None else domain
        command = [str(executable), str(number), name, f"{LONGEST:g}"]
        log = self._logs / f"{len(self._started)}_{name}.log"
        with log.open("wb") as file:
            process = subprocess.Popen(
                command,
                env={**os.environ, **variables},
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=file,
            )
        participant = Participant(name, process, log)
        self._started.append(participant)
        return participant

    def end(self) -> None:
        """End all: they do at the end of their input."""
        for participant in self._started:
            assert participant.process.stdin is not None
            participant.process.stdin.close()
        for participant in self._started:
            try:
                participant.process.wait(20)
            except subprocess.TimeoutExpired:
                participant.process.kill()
                participant.process.wait()
            assert participant.process.stdout is not None
            participant.process.stdout.close()


def exchange(participants: Sequence[Participant], endpoints: Sequence[Endpoints], samples: int) -> None:
    """Make endpoints, wait for their matches, and write on all of them, twice.

    When a reader has all samples of the second time, those of the first time that were for it have arrived.

    Args:
        participants: that have joined.
        endpoints: of each of them.
        samples: that each writer writes each time.
    """
    for participant, wanted in zip(participants, endpoints, strict=True):
        participant.send(*(f"{kind} {topic} {peers}" for (kind, topic), peers in wanted.items()))
    for participant, wanted in zip(participants, endpoints, strict=True):
        participant.take_answers(len(wanted))
    _all(participants, "match")
    for turn in (1, 2):
        _all(participants, f"write {samples}")
        _all(participants, f"receive {turn * samples}")
    _all(participants, "match")


def wait_for_report(*reports: tuple[Participant, str]) -> None:
    """Wait until the DDS of one of some participants has reported what is looked for in its log."""
    end = time.monotonic() + LONGEST
    while not any(text in participant.log.read_text() for participant, text in reports):
        assert time.monotonic() < end, [(participant.log, text) for participant, text in reports]
        time.sleep(0.02)  # polls files


def _all(participants: Iterable[Participant], line: str) -> None:
    participants = tuple(participants)
    for participant in participants:
        participant.send(line)
    for participant in participants:
        participant.take_answers()
