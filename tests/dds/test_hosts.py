# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A formation on several hosts: the same flight, whatever its cables do short of parting it."""

import re
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from flights import SCENARIOS, shortened
from namespaces import Network, network
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform.membership.formation import SatelliteLost

ADDRESSES = {"alpha": "10.213.7.1", "beta": "10.213.7.2", "gamma": "10.213.7.3"}
HOSTS = (
    "hosts=[{name: alpha, address: 10.213.7.1, runs: [plant, sat1]},"
    " {name: beta, address: 10.213.7.2, runs: [recorder, sat2]},"
    " {name: gamma, address: 10.213.7.3, runs: [sat3]}]"
)


@pytest.fixture
def hosts(tmp_path: Path) -> Iterator[Network]:
    with network(tmp_path, ADDRESSES) as made:
        yield made


class Formation:
    """The triangle, each host started with the same command but for its name."""

    def __init__(self, hosts: Network, duration: float, *changes: str) -> None:
        self.duration = duration
        self.folder = hosts.folder
        settings = [f"timing.duration={duration}", "expect=[]", HOSTS, *changes]
        options = [word for setting in settings for word in ("--set", setting)]
        self.running: dict[str, subprocess.Popen[str]] = {
            name: hosts.start(
                name, ["run", "triangle", *options, "--host", name, "--out", str(self.folder / f"{name}-run")]
            )
            for name in hosts.names
        }

    def wait_for_steps(self) -> None:
        """Until a few hundred steps are in the bag."""
        file = self.folder / "beta-run" / "bag" / "bag_0.mcap"
        end = time.monotonic() + 120.0
        while not file.exists() or file.stat().st_size < 400_000:
            early = [name for name, process in self.running.items() if process.poll() is not None]
            assert not early, f"{early} ended early: {self.running[early[0]].communicate()[0]}"
            assert time.monotonic() < end, "the flight does not begin"
            time.sleep(0.05)  # polls: there is no event for a file that another process writes

    def ends(self) -> dict[str, tuple[int, str]]:
        """Exit code and words of each host."""
        words = {name: process.communicate(timeout=180)[0] for name, process in self.running.items()}
        return {name: (self.running[name].returncode, words[name]) for name in self.running}

    def assert_flown_with_the_bits_of_one_process(self) -> dict[str, tuple[int, str]]:
        ends = self.ends()
        assert {name: code for name, (code, _) in ends.items()} == dict.fromkeys(ends, 0), ends
        bag = read_bag(self.folder / "beta-run" / "bag")
        assert bag.complete
        assert simulate(shortened("triangle", self.duration)).differences(bag.record) == []
        return ends


def test_three_hosts_fly_with_the_bits_of_one_process_and_say_which_of_them_judges(hosts: Network) -> None:
    formation = Formation(hosts, 100.0)
    ends = formation.assert_flown_with_the_bits_of_one_process()
    assert not (hosts.folder / "alpha-run" / "bag").exists()
    assert not (hosts.folder / "gamma-run" / "bag").exists()
    assert "The expectations are evaluated on host beta" in ends["alpha"][1]
    assert "The expectations are evaluated on host beta" in ends["gamma"][1]
    assert "not judged: the scenario expects nothing" in ends["beta"][1]


@pytest.mark.unmeasured
def test_a_tenth_of_all_packets_lost_does_not_change_a_bit(hosts: Network) -> None:
    hosts.lose(percent=10)
    Formation(hosts, 100.0).assert_flown_with_the_bits_of_one_process()
    assert hosts.lost_packets("gamma") > 50


@pytest.mark.unmeasured
def test_a_cut_cable_costs_the_host_behind_it_and_the_others_fly_on(hosts: Network) -> None:
    formation = Formation(hosts, 400.0, "node_timeout=2.0")
    formation.wait_for_steps()
    hosts.cut("gamma")
    ends = formation.ends()
    assert ends["alpha"][0] == ends["gamma"][0] == 3
    assert re.search(r"sat3 lost at step \d+, .*no answer within 2 s from sat3", ends["alpha"][1])
    assert re.search(r"Lost plant at step \d+ of 800", ends["gamma"][1])
    bag = read_bag(hosts.folder / "beta-run" / "bag")
    assert bag.complete
    ((step, (loss,)),) = bag.events.items()
    assert isinstance(loss, SatelliteLost)
    assert loss.satellite == 2
    assert simulate(bag.scenario, events=bag.events).position[-1].tolist() == bag.record.position[-1].tolist()
    assert bag.record.absent[step:, 2].all()


@pytest.mark.unmeasured
def test_a_cable_that_is_out_for_less_than_the_tolerated_silence_does_not_change_a_bit(
    hosts: Network,
) -> None:
    formation = Formation(hosts, 400.0, "node_timeout=30.0")
    formation.wait_for_steps()
    hosts.cut("gamma")
    time.sleep(2.0)  # duration of the link outage that is tested
    assert all(process.poll() is None for process in formation.running.values())
    hosts.mend("gamma")
    formation.assert_flown_with_the_bits_of_one_process()


@pytest.mark.unmeasured
def test_the_containers_of_the_compose_file_fly_as_they_are_told_to(tmp_path: Path) -> None:
    services = YAML(typ="safe").load(SCENARIOS.parent / "docker" / "compose.yaml")["services"]
    addresses = {name: service["networks"]["formation"]["ipv4_address"] for name, service in services.items()}
    shorter = ["--set", "timing.duration=50.0", "--set", "expect=[]"]
    with network(tmp_path, addresses) as made:
        running = {
            name: made.start(name, [*service["command"], *shorter, "--out", str(tmp_path / f"{name}-run")])
            for name, service in services.items()
        }
        words = {name: process.communicate(timeout=180)[0] for name, process in running.items()}
    assert {name: process.returncode for name, process in running.items()} == dict.fromkeys(services, 0), (
        words
    )
    bag = read_bag(tmp_path / "recorder-run" / "bag")
    assert bag.complete
    assert simulate(shortened("triangle", 50.0)).differences(bag.record) == []
