# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The images hold what they copy and run it as nobody special; the compose file distributes the triangle."""

import ipaddress
import re
import runpy
import socket
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from flights import shipped

ROOT = Path(__file__).parents[3]
DOCKER = ROOT / "docker"
IMAGES = ("Dockerfile", "wheels.Dockerfile")


def instructions(image: str) -> list[tuple[str, str]]:
    """Keyword and words of each instruction, its lines joined."""
    lines = [line for line in (DOCKER / image).read_text().splitlines() if not line.startswith("#")]
    joined = re.sub(r"\\\n", " ", "\n".join(lines))
    return [(line.split()[0], line.split(maxsplit=1)[1]) for line in joined.splitlines() if line.strip()]


def ignored(path: str) -> bool:
    """Whether `.dockerignore` keeps a path from the builder: the last rule that fits decides."""
    verdict = False
    for rule in (ROOT / ".dockerignore").read_text().split("\n"):
        pattern = rule.lstrip("!")
        if not rule or rule.startswith("#"):
            continue
        parents = [Path(path), *Path(path).parents][:-1]
        if any(part.match(pattern) for part in parents):
            verdict = not rule.startswith("!")
    return verdict


@pytest.mark.parametrize("image", IMAGES)
def test_what_an_image_copies_is_there_and_reaches_the_builder(image: str) -> None:
    copied = [words for keyword, words in instructions(image) if keyword == "COPY" and "--from" not in words]
    sources = [source for words in copied for source in words.split()[:-1]]
    assert {"requirements.txt", "tools", "ros_ws", "scenarios"} <= set(sources)
    for source in sources:
        assert (ROOT / source).exists()
        assert not ignored(source)


@pytest.mark.parametrize("path", [".git", ".venv", "runs", "keystores", "ros_ws/build", "ros_ws/install"])
def test_what_was_made_here_stays_out_of_the_images(path: str) -> None:
    assert ignored(path)


@pytest.mark.parametrize("image", IMAGES)
def test_an_image_runs_as_nobody_special_and_says_how_it_is(image: str) -> None:
    last = dict(instructions(image))
    assert int(last["USER"]) > 0
    assert "/satform/docker/health.py" in last["HEALTHCHECK"]
    keywords = [keyword for keyword, _ in instructions(image)]
    assert "RUN" not in keywords[len(keywords) - keywords[::-1].index("USER") :]


@pytest.mark.parametrize("image", IMAGES)
def test_a_layer_does_not_keep_the_lists_of_packages(image: str) -> None:
    for keyword, words in instructions(image):
        if keyword == "RUN" and "apt-get update" in words:
            assert "rm -rf /var/lib/apt/lists/*" in words
            assert "rosdep install" in words or "--no-install-recommends" in words


@pytest.fixture(scope="module")
def compose() -> Any:
    return YAML(typ="safe").load(DOCKER / "compose.yaml")


def test_every_container_flies_the_same_scenario_on_a_host_of_its_own(compose: Any) -> None:
    commands = [service["command"] for service in compose["services"].values()]
    settings = {tuple(command[2:4]) for command in commands}
    assert len(settings) == 1
    ((option, hosts),) = settings
    assert option == "--set"
    scenario = shipped(commands[0][1], hosts)
    told = {host.name: host.address for host in scenario.hosts}
    given = {
        service["command"][5]: service["networks"]["formation"]["ipv4_address"]
        for service in compose["services"].values()
    }
    assert given == told
    assert list(compose["services"]) == list(told)


def test_one_service_builds_the_image_and_the_others_wait_for_it(compose: Any) -> None:
    services = compose["services"]
    (builder,) = (name for name, service in services.items() if "build" in service)
    assert services[builder]["pull_policy"] == "build"
    for name, service in services.items():
        assert service["image"] == services[builder]["image"]
        if name != builder:
            # There is no registry that has it.
            assert service["pull_policy"] == "never"
            assert service["depends_on"] == [builder]
    context = DOCKER / services[builder]["build"]["context"]
    assert (context / services[builder]["build"]["dockerfile"]).is_file()


def test_a_run_has_one_folder_in_which_each_part_has_its_own(compose: Any) -> None:
    (volume,) = {mount for service in compose["services"].values() for mount in service["volumes"]}
    folders = {}
    for name, service in compose["services"].items():
        host, option, out = service["command"][5:]
        assert (host, option) == (name, "--out")
        folders[name] = Path(out)
    assert {folder.parent for folder in folders.values()} == {
        Path(volume.partition(":")[2]) / "${RUN:-triangle}"
    }
    assert {folder.name for folder in folders.values()} == set(folders)


def test_the_containers_addresses_are_in_their_network_and_not_its_gateways(compose: Any) -> None:
    subnet = ipaddress.ip_network(compose["networks"]["formation"]["ipam"]["config"][0]["subnet"])
    for service in compose["services"].values():
        address = ipaddress.ip_address(service["networks"]["formation"]["ipv4_address"])
        assert address in list(subnet.hosts())[1:]


def test_every_container_gives_up_what_it_does_not_need(compose: Any) -> None:
    for service in compose["services"].values():
        assert service["cap_drop"] == ["ALL"]
        assert service["read_only"] is True
        assert {mount.split(":")[0] for mount in service["volumes"]} <= set(compose["volumes"])


HEALTH = runpy.run_path(str(DOCKER / "health.py"))


def table(*ports: int) -> str:
    """Of UDP sockets, as the kernel prints it."""
    rows = [f"{n:4}: 00000000:{port:04X} 00000000:0000 07 00000000:00000000" for n, port in enumerate(ports)]
    return "\n".join(["  sl  local_address rem_address   st tx_queue", *rows, ""])


@pytest.mark.parametrize(
    ("ports", "domain", "found"),
    [
        ((7410,), 0, [7410]),
        # Third participant of domain 42: 7400 + 250 * 42 + 10 + 2 * 2.
        ((17914,), 42, [17914]),
        ((17914,), None, [17914]),
        ((17914,), 41, []),
        # Data, multicast discovery and data, a name server.
        ((7411, 7400, 7401, 53), None, []),
        ((), None, []),
    ],
)
def test_health_is_a_port_of_dds_discovery(
    ports: tuple[int, ...], domain: int | None, found: list[int]
) -> None:
    assert HEALTH["discovery_ports"](table(*ports), domain) == found


def test_health_reads_the_kernels_own_table() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bound:
        bound.bind(("127.0.0.1", 65410 + 2 * 31))
        assert 65472 in HEALTH["discovery_ports"](Path("/proc/net/udp").read_text())
