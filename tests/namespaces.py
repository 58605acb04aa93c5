# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Several machines on one: network namespaces and a switch, with cables to cut and packets to lose."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest

_OF_THIS_MACHINE = ("ROS_DOMAIN_ID", "SATFORM_HOLDS_DOMAIN", "ROS_AUTOMATIC_DISCOVERY_RANGE")


def _ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True, text=True)


@dataclass
class Network:
    """Machines by name, each with one cable to the switch.

    Attributes:
        prefix: of the names of namespaces, so that they are this process's own.
        folder: for what the machines write.
        names: of the machines, in the order in which they were made.
    """

    prefix: str
    folder: Path
    names: list[str] = field(default_factory=list)
    started: list[subprocess.Popen[str]] = field(default_factory=list)
    temporary: list[Path] = field(default_factory=list)

    @property
    def switch(self) -> str:
        return f"{self.prefix}-switch"

    def namespace(self, name: str) -> str:
        return f"{self.prefix}-{name}"

    def _cable(self, name: str) -> str:
        return f"cable{self.names.index(name)}"

    def build(self, addresses: Mapping[str, str]) -> None:
        _ip("netns", "add", self.switch)
        _ip("-n", self.switch, "link", "add", "bridge", "type", "bridge")
        _ip("-n", self.switch, "link", "set", "bridge", "up")
        for name, address in addresses.items():
            self.names.append(name)
            space, cable = self.namespace(name), self._cable(name)
            _ip("netns", "add", space)
            _ip("-n", self.switch, "link", "add", cable, "type", "veth", "peer", "eth0", "netns", space)
            _ip("-n", self.switch, "link", "set", cable, "master", "bridge", "up")
            _ip("-n", space, "address", "add", f"{address}/24", "dev", "eth0")
            for device in ("lo", "eth0"):
                _ip("-n", space, "link", "set", device, "up")

    def remove(self) -> None:
        for process in self.started:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        for process in self.started:
            try:
                process.communicate(timeout=30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        for space in (self.switch, *map(self.namespace, self.names)):
            subprocess.run(["ip", "netns", "delete", space], check=False, capture_output=True)
        for folder in self.temporary:
            shutil.rmtree(folder, ignore_errors=True)

    def start(self, name: str, arguments: Sequence[str]) -> subprocess.Popen[str]:
        """Start `satform` on a machine; it is ended with the network."""
        # Each machine has its own; short, since paths of sockets must be.
        own = Path(tempfile.mkdtemp(prefix="machine-"))
        self.temporary.append(own)
        variables = {key: value for key, value in os.environ.items() if key not in _OF_THIS_MACHINE}
        process = subprocess.Popen(
            ["ip", "netns", "exec", self.namespace(name), sys.executable, "-m", "satform_tools", *arguments],
            env=variables | {"TMPDIR": str(own), "XDG_RUNTIME_DIR": ""},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        self.started.append(process)
        return process

    def cut(self, name: str) -> None:
        """Pull the machine's cable."""
        _ip("-n", self.switch, "link", "set", self._cable(name), "down")

    def mend(self, name: str) -> None:
        """Plug the machine's cable in again."""
        _ip("-n", self.switch, "link", "set", self._cable(name), "up")

    def lose(self, percent: int) -> None:
        """Have every machine lose some of the packets that reach it, by chance."""
        if shutil.which("nft") is None:
            pytest.skip("NOT TESTED: packets are lost by nftables, and there is no nft here")
        rules = f"""
            table inet cable {{
                chain incoming {{
                    type filter hook input priority 0;
                    iifname eth0 ip protocol udp numgen random mod 100 < {percent} counter drop
                }}
            }}
            """
        for name in self.names:
            command = ["ip", "netns", "exec", self.namespace(name), "nft", "-f", "-"]
            done = subprocess.run(command, input=rules, check=False, capture_output=True, text=True)
            if done.returncode:
                pytest.skip(f"NOT TESTED: nftables loses no packets on this machine: {done.stderr.strip()}")

    def lost_packets(self, name: str) -> int:
        """How many packets the machine has lost."""
        command = ["ip", "netns", "exec", self.namespace(name), "nft", "list", "ruleset"]
        rules = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        return int(rules.partition("packets ")[2].split()[0])


@contextmanager
def network(folder: Path, addresses: Mapping[str, str]) -> Iterator[Network]:
    """Machines on a network, for the length of a block; nothing of it is left behind.

    Args:
        folder: existing, for the machines' temporary files.
        addresses: IPv4 address of each machine by its name, all in one /24.
    """
    if os.geteuid() != 0 or shutil.which("ip") is None:
        pytest.skip("NOT TESTED: several hosts on one machine need root and the program ip")
    made = Network(f"satform{os.getpid()}", folder)
    try:
        try:
            made.build(addresses)
        except subprocess.CalledProcessError as error:
            pytest.skip(f"NOT TESTED: this machine lets nobody make a network: {error.stderr.strip()}")
        yield made
    finally:
        made.remove()
