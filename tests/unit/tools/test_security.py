# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A formation's keystore lets every node do its own work and hear its neighbours, and nothing else."""

import shutil
import stat
import subprocess
from datetime import UTC, datetime, timedelta
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from cryptography import x509

from flights import shipped
from satform.communication.topic_table import topic_name
from satform.consensus.graph import Graph
from satform.flight.compile import compile_scenario
from satform_bringup.deployment import multi_host_discovery, security
from satform_bringup.deployment.node_processes import processes
from satform_nodes.plant.permitted_edges import permitted_graph
from satform_nodes.plant.services import wanted_graph
from satform_tools.cli import main as cli
from satform_tools.describe.scenario import describe
from satform_tools.errors import CommandError
from satform_tools.security.keystore import make
from satform_tools.security.permission_documents import ANY_DOMAIN

RING = "graph={kind: matrix, rows: [[0,1,0],[0,0,1],[1,0,0]]}"
"""Each of the three hears the next one and is not heard back."""

FILES = {
    "cert.pem",
    "key.pem",
    "identity_ca.cert.pem",
    "permissions_ca.cert.pem",
    "governance.p7s",
    "permissions.p7s",
}
"""Which rmw looks for in an enclave: ROS 2 design, "ROS 2 DDS-Security integration"."""


@pytest.fixture(scope="module")
def keystore(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("security") / "keystore"
    make(shipped("triangle", RING), folder, 30, ANY_DOMAIN)
    return folder


def parsed(document: bytes) -> ET.Element:
    return ET.fromstring(document)  # noqa: S314 - it was made here


def enclave(keystore: Path, node: str) -> Path:
    return keystore / "enclaves" / "formation" / node


def verified(keystore: Path, signed: Path) -> tuple[int, bytes]:
    """What OpenSSL says of a signed document, by the authority of the permissions: exit code and content."""
    authority = keystore / "public" / "permissions_ca.cert.pem"
    command = ["openssl", "smime", "-verify", "-text", "-in", str(signed), "-CAfile", str(authority)]
    done = subprocess.run(command, capture_output=True, check=False, timeout=30)
    return done.returncode, done.stdout


def granted(keystore: Path, node: str, deed: str) -> set[str]:
    """DDS topics that a node may publish or subscribe to, read from its signed permissions."""
    code, content = verified(keystore, enclave(keystore, node) / "permissions.p7s")
    assert code == 0
    return {str(topic.text) for topic in parsed(content).iterfind(f".//{deed}/topics/topic")}


def test_a_satellite_may_hear_those_whom_the_adjacency_matrix_lets_it_hear(keystore: Path) -> None:
    announcements = {f"rt{topic_name('arc_length', name)}" for name in ("sat1", "sat2", "sat3")}
    heard = {name: granted(keystore, name, "subscribe") & announcements for name in ("sat1", "sat2", "sat3")}
    assert heard == {
        "sat1": {"rt/sat2/arc_length"},
        "sat2": {"rt/sat3/arc_length"},
        "sat3": {"rt/sat1/arc_length"},
    }


def test_a_satellite_may_hear_whom_any_graph_of_the_schedule_lets_it_hear(tmp_path: Path) -> None:
    scenario = shipped("triangle", RING, "graph_schedule=[{at: 100.0, graph: {kind: complete}}]")
    make(scenario, tmp_path / "keystore", 30, ANY_DOMAIN)
    heard = granted(tmp_path / "keystore", "sat1", "subscribe")
    assert {"rt/sat2/arc_length", "rt/sat3/arc_length"} <= heard
    topic = next(entry for entry in describe(scenario)["topics"] if entry["topic"] == "/sat1/arc_length")
    assert topic["to"] == ["sat2", "sat3"]


LINE = "graph={kind: line}"
"""The first and the third of three satellites do not read each other's phases."""


def permitted_by(folder: Path, *changes: str) -> Graph:
    """Edges that the plant takes from a keystore."""
    environment = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_KEYSTORE": str(folder)}
    found = permitted_graph(compile_scenario(shipped("triangle", *changes)), environment)
    assert found is not None
    return found


def test_keys_hold_for_the_edges_that_a_service_may_use_and_for_no_others(tmp_path: Path) -> None:
    further = Graph(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    make(shipped("triangle", LINE), tmp_path / "keystore", 30, ANY_DOMAIN, further)
    read = {name: granted(tmp_path / "keystore", name, "subscribe") for name in ("sat1", "sat3")}
    assert {"rt/sat2/arc_length", "rt/sat3/arc_length"} <= read["sat1"]
    assert "rt/sat2/arc_length" in read["sat3"]
    assert "rt/sat1/arc_length" not in read["sat3"]
    expected = [[0, 1, 1], [1, 0, 1], [0, 1, 0]]
    assert permitted_by(tmp_path / "keystore", LINE).adjacency.tolist() == expected


def test_the_plant_of_a_secured_flight_rejects_edges_without_keys(tmp_path: Path) -> None:
    plan = compile_scenario(shipped("triangle", LINE))
    make(shipped("triangle", LINE), tmp_path / "keystore", 30, ANY_DOMAIN)
    ring = [0, 1, 1, 1, 0, 1, 1, 1, 0]
    assert permitted_graph(plan, {}) is None
    assert wanted_graph(ring, plan).adjacency.ravel().tolist() == ring
    with pytest.raises(ValueError, match="sat1 has no permission to read what sat3 publishes: make the"):
        wanted_graph(ring, plan, permitted_by(tmp_path / "keystore", LINE))
    fewer = [0, 1, 0, 0, 0, 0, 0, 0, 0]
    assert wanted_graph(fewer, plan, permitted_by(tmp_path / "keystore", LINE)).edges == ((1, 0),)


@pytest.mark.parametrize("text", [None, "<policy"])
def test_without_a_list_of_permissions_the_plant_keeps_to_the_edges_of_the_scenario(
    text: str | None, tmp_path: Path
) -> None:
    if text is not None:
        (tmp_path / "policies.xml").write_text(text)
    assert permitted_by(tmp_path, LINE).adjacency.tolist() == [[0, 1, 0], [1, 0, 1], [0, 1, 0]]


def test_further_edges_are_an_option_of_the_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "keystore"
    words = ["security", "triangle", "--set", LINE, "--out", str(out), "--possible-graph"]
    assert cli.main([*words, "{kind: rign}"]) == 2
    assert "--possible-graph {kind: rign}" in capsys.readouterr().err
    assert not out.exists()
    assert cli.main([*words, "{kind: ring}"]) == 0
    assert "rt/sat3/arc_length" in granted(out, "sat1", "subscribe")


def test_a_formation_that_cannot_use_further_edges_gets_no_keys_for_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "keystore"
    other_way = "{kind: matrix, rows: [[0,0,1],[1,0,0],[0,1,0]]}"
    words = ["security", "directed_triangle_close", "--out", str(out), "--possible-graph", other_way]
    assert cli.main(words) == 2
    assert "needs its messages at every step" in capsys.readouterr().err
    assert not out.exists()


def test_only_the_plant_may_be_asked_to_pause_or_stop_the_formation(keystore: Path) -> None:
    asked = "rq/formation/stopRequest"
    hearers = {
        node for node in ("plant", "sat1", "recorder") if asked in granted(keystore, node, "subscribe")
    }
    assert hearers == {"plant"}
    assert asked in granted(keystore, "operator", "publish")


def test_nobody_may_speak_in_anothers_name(keystore: Path) -> None:
    for name in ("sat1", "sat2", "sat3"):
        others = {"sat1", "sat2", "sat3"} - {name}
        said = granted(keystore, name, "publish")
        assert not [topic for topic in said for other in others if f"/{other}/" in topic]
        assert f"rt/{name}/state" not in said
        assert "rt/formation/status" not in said
    assert not [topic for topic in granted(keystore, "recorder", "publish") if topic.startswith("rt/sat")]


def test_an_enclave_has_the_files_that_the_middleware_looks_for(keystore: Path) -> None:
    for node in ("plant", "sat1", "sat2", "sat3", "recorder", "operator"):
        found = {file.name for file in enclave(keystore, node).iterdir() if file.is_file()}
        assert found >= FILES


def test_every_certificate_is_its_nodes_own_and_signed_by_the_authority(keystore: Path) -> None:
    authority = x509.load_pem_x509_certificate((keystore / "public" / "identity_ca.cert.pem").read_bytes())
    for node in ("plant", "sat1", "recorder"):
        certificate = x509.load_pem_x509_certificate((enclave(keystore, node) / "cert.pem").read_bytes())
        certificate.verify_directly_issued_by(authority)
        # The form in which the middleware compares it with the permissions.
        assert certificate.subject.rfc4514_string() == f"CN=/formation/{node}"
        assert certificate.not_valid_after_utc - datetime.now(UTC) > timedelta(days=29)


def test_permissions_hold_as_long_as_the_certificate(keystore: Path) -> None:
    certificate = x509.load_pem_x509_certificate((enclave(keystore, "sat1") / "cert.pem").read_bytes())
    _, content = verified(keystore, enclave(keystore, "sat1") / "permissions.p7s")
    validity = parsed(content).find("permissions/grant/validity")
    assert validity is not None
    moments = [datetime.fromisoformat(str(moment.text)).replace(tzinfo=UTC) for moment in validity]
    assert moments == [certificate.not_valid_before_utc, certificate.not_valid_after_utc]


@pytest.mark.parametrize("document", ["governance.p7s", "permissions.p7s"])
def test_a_document_that_was_changed_after_it_was_signed_is_refused_by_openssl(
    keystore: Path, tmp_path: Path, document: str
) -> None:
    signed = (enclave(keystore, "sat1") / document).read_bytes()
    assert verified(keystore, enclave(keystore, "sat1") / document)[0] == 0
    forged = tmp_path / document
    forged.write_bytes(signed.replace(b"<domains>", b"<domains >", 1))
    assert verified(keystore, forged)[0] != 0


def test_private_keys_can_be_read_by_nobody_but_their_owner(keystore: Path) -> None:
    keys = [file for file in keystore.rglob("*key.pem") if not file.is_symlink()]
    assert len(keys) == 7
    assert {stat.S_IMODE(key.stat().st_mode) for key in keys} == {0o600}
    assert stat.S_IMODE((keystore / "private").stat().st_mode) == 0o700


def test_documents_have_the_elements_of_the_standards_schemas_in_their_order(keystore: Path) -> None:
    # OMG DDS Security 1.1, omg_shared_ca_permissions.xsd and omg_shared_ca_governance.xsd.
    _, permissions = verified(keystore, enclave(keystore, "sat1") / "permissions.p7s")
    grant = parsed(permissions).find("permissions/grant")
    assert grant is not None
    assert [part.tag for part in grant] == ["subject_name", "validity", "allow_rule", "default"]
    assert [part.tag for part in grant.findall("allow_rule/*")] == ["domains", "publish", "subscribe"]
    assert [part.tag for part in grant.findall("allow_rule/domains/id_range/*")] == ["min", "max"]
    assert grant.findtext("default") == "DENY"
    _, governance = verified(keystore, enclave(keystore, "sat1") / "governance.p7s")
    rule = parsed(governance).find("domain_access_rules/domain_rule")
    assert rule is not None
    assert [part.tag for part in rule] == [
        "domains",
        "allow_unauthenticated_participants",
        "enable_join_access_control",
        "discovery_protection_kind",
        "liveliness_protection_kind",
        "rtps_protection_kind",
        "topic_access_rules",
    ]
    assert [part.tag for part in rule.findall("topic_access_rules/topic_rule/*")] == [
        "topic_expression",
        "enable_discovery_protection",
        "enable_liveliness_protection",
        "enable_read_access_control",
        "enable_write_access_control",
        "metadata_protection_kind",
        "data_protection_kind",
    ]


def test_the_policies_say_in_the_words_of_ros_what_the_permissions_say_in_those_of_dds(
    keystore: Path,
) -> None:
    root = parsed((keystore / "policies.xml").read_bytes())
    assert root.get("version") == "0.2.0"
    for place in root.iterfind("enclaves/enclave"):
        node = place.get("path", "").rpartition("/")[2]
        for deed in ("publish", "subscribe"):
            names = {f"rt{topic.text}" for topic in place.iterfind(f".//topics[@{deed}='ALLOW']/topic")}
            assert names == {topic for topic in granted(keystore, node, deed) if topic.startswith("rt/")}


def test_a_keystore_is_never_written_over(keystore: Path) -> None:
    with pytest.raises(CommandError, match="already exists and is not an empty folder"):
        make(shipped("triangle"), keystore, 30, ANY_DOMAIN)


def test_no_document_names_a_domain_that_cyclone_dds_refuses_and_all_name_those_of_flights(
    keystore: Path,
) -> None:
    # Cyclone DDS takes ids from 0 to 230 in these documents, Fast DDS has ports up to 232.
    for name in ("governance.p7s", "permissions.p7s"):
        _, content = verified(keystore, enclave(keystore, "sat1") / name)
        ranges = [(part.findtext("min"), part.findtext("max")) for part in parsed(content).iter("id_range")]
        assert ranges == [("0", "230")]
    assert multi_host_discovery.LAST_SHARED <= 230


def test_a_secured_flight_in_a_domain_without_permissions_is_refused_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(security.SecurityError, match="ROS_DOMAIN_ID=231 cannot be secured"):
        security.require_secured(tmp_path, [], 231)


def test_keys_may_be_made_for_one_domain_alone(tmp_path: Path) -> None:
    make(shipped("triangle"), tmp_path / "keystore", 30, (42, 42))
    _, content = verified(tmp_path / "keystore", enclave(tmp_path / "keystore", "sat2") / "permissions.p7s")
    assert [part.text for part in parsed(content).findall(".//allow_rule/domains/id")] == ["42"]


def test_every_node_is_started_in_its_own_enclave() -> None:
    nodes = security.secured(
        processes(compile_scenario(shipped("triangle")), Path("scenario.json"), Path("bag"))
    )
    enclaves = [node.arguments()[-2:] for node in nodes]
    names = ("plant", "sat1", "sat2", "sat3", "recorder")
    assert enclaves == [["--enclave", f"/formation/{name}"] for name in names]


def test_satellites_that_share_a_process_cannot_have_keys_of_their_own() -> None:
    with pytest.raises(security.SecurityError, match="fly with --satellites-per-process 1"):
        security.secured(processes(compile_scenario(shipped("triangle")), Path("scenario.json"), None, 2))


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda place: (place / "cert.pem").unlink(), r"has no cert\.pem for the enclave /formation/sat2"),
        (lambda place: (place / "key.pem").chmod(0o644), r"key\.pem may be read by others than its owner"),
    ],
)
def test_a_keystore_that_would_not_secure_the_flight_is_refused_before_it(
    keystore: Path, tmp_path: Path, spoil: object, sentence: str
) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(keystore, copy, symlinks=True)
    assert callable(spoil)
    spoil(enclave(copy, "sat2"))
    nodes = security.secured(processes(compile_scenario(shipped("triangle")), Path("scenario.json"), None))
    with pytest.raises(security.SecurityError, match=sentence):
        security.require_secured(copy, nodes, 1)


def test_a_middleware_without_security_flies_nothing_unsecured_instead(
    keystore: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    code = cli.main(["run", "triangle", "--secure", str(keystore), "--out", str(out)])
    said = capsys.readouterr().err
    if "flies" not in said and code == 0:
        pytest.skip("this middleware has security: the flight was secured")
    assert code == 2
    assert "does not support DDS Security, so nothing was flown" in said
    assert "doesn't have the security libraries" in said
    assert list(out.iterdir()) == []


def test_a_run_in_one_process_cannot_be_secured(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["run", "triangle", "--mode", "inprocess", "--secure", "keys"]) == 2
    assert "--secure needs DDS" in capsys.readouterr().err
