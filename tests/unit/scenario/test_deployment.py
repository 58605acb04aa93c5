# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Which host runs what, and how the others find it: what is agreed, and what is refused with a sentence."""

from pathlib import Path

import pytest

from flights import shipped
from satform.flight.compile import compile_scenario
from satform.scenario import Scenario, ScenarioError
from satform.scenario.deployment import HostSpec
from satform_bringup.deployment import multi_host_discovery
from satform_bringup.deployment.node_processes import processes
from satform_tools.cli import main as cli

ALPHA = "{name: alpha, address: 192.0.2.1, runs: [plant, sat1]}"
BETA = "{name: beta, address: 192.0.2.2, runs: [recorder, sat2, sat3]}"


def on(*hosts: str) -> Scenario:
    return shipped("triangle", f"hosts=[{', '.join(hosts)}]")


def test_the_parts_of_all_hosts_are_the_whole_formation() -> None:
    scenario = on(ALPHA, BETA)
    parts = [
        {node.name for node in processes(compile_scenario(scenario), Path("s"), Path("bag"), host=host)}
        for host in scenario.hosts
    ]
    assert parts == [{"plant", "sat1"}, {"recorder", "sat2", "sat3"}]


def test_satellites_share_processes_with_those_of_their_own_host_only() -> None:
    scenario = on(ALPHA, BETA)
    groups = [
        node.parameters["satellites"]
        for host in scenario.hosts
        for node in processes(compile_scenario(scenario), Path("s"), None, 2, host=host)
        if node.executable == "group_node"
    ]
    assert groups == [["sat1"], ["sat2", "sat3"]]


def test_where_it_runs_does_not_change_what_is_flown() -> None:
    assert on(ALPHA, BETA).digest() == shipped("triangle").digest()


@pytest.mark.parametrize(
    ("hosts", "sentence"),
    [
        ([ALPHA], "no host runs recorder, sat2, sat3; every part is run by exactly one host"),
        ([ALPHA, BETA.replace("sat3", "sat1, sat3")], "sat1 is run 2 times (by alpha, beta)"),
        ([ALPHA, BETA.replace("sat3", "sat33")], "there is no sat33 to be run; did you mean sat3?"),
        ([ALPHA, BETA.replace("beta", "alpha")], "another host has the name alpha too"),
        ([ALPHA, BETA.replace("0.2.2", "0.2.1")], "another host has the address 192.0.2.1 too"),
        ([ALPHA, BETA.replace("192.0.2.2", "127.0.0.1")], "127.0.0.1 is each machine's word for itself"),
        ([ALPHA, BETA.replace("192.0.2.2", "192.0.2.300")], "192.0.2.300 is not an IPv4 address"),
        ([ALPHA, BETA.replace("192.0.2.2", "'a;b'")], "address"),
        ([ALPHA, BETA.replace("[recorder, sat2, sat3]", "[]")], "runs"),
    ],
)
def test_hosts_that_cannot_fly_are_refused_with_a_sentence(hosts: list[str], sentence: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        on(*hosts)
    assert sentence in str(caught.value)
    assert "hosts" in str(caught.value)


def test_all_hosts_agree_on_a_domain_that_no_flight_on_one_machine_takes() -> None:
    one, other = on(ALPHA, BETA), on(ALPHA, BETA)
    assert multi_host_discovery.agreed_domain(one) == multi_host_discovery.agreed_domain(other)
    base = shipped("triangle", "expect=[]")
    timings = [base.timing.model_copy(update={"duration": float(n)}) for n in range(1, 200)]
    domains = {
        multi_host_discovery.agreed_domain(base.model_copy(update={"timing": timing})) for timing in timings
    }
    assert domains <= set(range(215, 231))
    assert len(domains) > 10


def test_the_ports_for_a_firewall_lie_beside_those_for_outgoing_connections_and_exist() -> None:
    # The standard's mapping: 7400 + 250 domain + 10 or 11 + 2 participant; Linux gives out 32768 to 60999.
    assert multi_host_discovery.ports(0) == (7410, 7473)
    for domain in range(215, 231):
        first, last = multi_host_discovery.ports(domain)
        assert 60999 < first < last < 65536


@pytest.fixture
def no_peers_set(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("ROS_STATIC_PEERS", "FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.usefixtures("no_peers_set")
def test_a_host_looks_for_every_other_one_and_for_those_that_the_user_names(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    scenario = on(ALPHA, BETA)
    alpha, beta = scenario.hosts
    assert multi_host_discovery.variables(scenario, alpha, tmp_path)["ROS_STATIC_PEERS"] == "192.0.2.2"
    monkeypatch.setenv("ROS_STATIC_PEERS", "192.0.2.9;192.0.2.1")
    assert (
        multi_host_discovery.variables(scenario, beta, tmp_path)["ROS_STATIC_PEERS"] == "192.0.2.1;192.0.2.9"
    )
    assert multi_host_discovery.variables(scenario, None, tmp_path) == {}


@pytest.mark.usefixtures("no_peers_set")
def test_the_users_own_settings_of_the_middleware_are_left_alone(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    scenario = on(ALPHA, BETA)
    monkeypatch.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", "/mine.xml")
    found = multi_host_discovery.variables(scenario, scenario.hosts[0], tmp_path)
    assert not {name for name in found if "PROFILES" in name}
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "sentence"), [("alpa", "did you mean alpha?"), ("omicron", "there are alpha, beta")]
)
def test_a_host_that_is_not_there_is_named_with_those_that_are(name: str, sentence: str) -> None:
    with pytest.raises(multi_host_discovery.PeerError, match=sentence):
        multi_host_discovery.find_host(on(ALPHA, BETA), name)


def test_a_scenario_without_hosts_says_how_to_give_it_some() -> None:
    with pytest.raises(multi_host_discovery.PeerError, match="give it a field hosts"):
        multi_host_discovery.find_host(shipped("triangle"), "alpha")


def test_a_machine_that_is_another_one_is_told_so() -> None:
    # 192.0.2.0/24 is kept for documentation: no machine has it.
    host = HostSpec(name="alpha", address="192.0.2.1", runs=("plant",))
    with pytest.raises(multi_host_discovery.PeerError, match=r"this machine does not have 192\.0\.2\.1"):
        multi_host_discovery.require_own_address(host)
    multi_host_discovery.require_own_address(HostSpec(name="alpha", address="127.0.0.1", runs=("plant",)))


def test_a_name_that_leads_nowhere_is_said_to() -> None:
    host = HostSpec(name="alpha", address="nowhere.invalid", runs=("plant",))
    with pytest.raises(
        multi_host_discovery.PeerError, match=r"nowhere\.invalid, the address of host alpha, is not known"
    ):
        multi_host_discovery.require_own_address(host)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--host", "alpha"], "the scenario triangle does not say which host runs which nodes"),
        (["--host", "alpha", "--mode", "inprocess"], "--host alpha is for lockstep"),
        (["--set", f"hosts=[{ALPHA}, {BETA}]", "--host", "alpha"], "this machine does not have 192.0.2.1"),
    ],
)
def test_a_part_that_cannot_be_taken_is_refused_before_a_folder_is_made(
    options: list[str], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["run", "triangle", *options, "--out", str(tmp_path / "run")]) == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
