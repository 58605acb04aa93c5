# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Participants whose documents are forged, expired, another's or of another domain are refused."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, load_pem_private_key

from changed_keystores import authority, enclave, sign_changed
from flights import shipped
from satform_tools.security.keystore import Authority, make
from satform_tools.security.permission_documents import ANY_DOMAIN
from secured_participants import (
    CycloneProgram,
    FastDdsProgram,
    Participant,
    Participants,
    exchange,
    wait_for_report,
)

STATE = "rt/sat1/state"
"""Which the plant publishes, and sat1 and the recorder read."""

SAMPLES = 5


@pytest.fixture
def keystore(tmp_path: Path) -> Path:
    make(shipped("triangle"), tmp_path / "keystore", 30, ANY_DOMAIN)
    return tmp_path / "keystore"


def forge(document: Path, old: bytes, new: bytes) -> None:
    """Change a document after it was signed."""
    text = document.read_bytes()
    assert old in text
    document.write_bytes(text.replace(old, new))


def own_certificate(keystore: Path, signer: Authority, begin: datetime, end: datetime) -> None:
    """Give sat1 a certificate of its key by some authority, with some validity."""
    key = load_pem_private_key((enclave(keystore, "sat1") / "key.pem").read_bytes(), None)
    assert isinstance(key, ec.EllipticCurvePrivateKey)
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "/formation/sat1")])
    builder = x509.CertificateBuilder(
        signer.certificate.subject, subject, key.public_key(), x509.random_serial_number(), begin, end
    )
    signed = builder.sign(signer.key, hashes.SHA256())
    (enclave(keystore, "sat1") / "cert.pem").write_bytes(signed.public_bytes(Encoding.PEM))


def expire_certificate(keystore: Path) -> None:
    now = datetime.now(UTC).replace(microsecond=0)
    own_certificate(keystore, authority(keystore), now - timedelta(days=1), now - timedelta(minutes=1))


def sign_certificate_elsewhere(keystore: Path) -> None:
    make(shipped("triangle"), keystore / "other", 30, ANY_DOMAIN)
    now = datetime.now(UTC).replace(microsecond=0)
    other = authority(keystore / "other")
    own_certificate(keystore, other, now - timedelta(days=1), now + timedelta(days=1))


def expire_permissions(keystore: Path) -> None:
    document = enclave(keystore, "sat1") / "permissions.p7s"
    begin, end = (
        document.with_suffix(".xml").read_text().partition(f"<{tag}>")[2].partition("<")[0]
        for tag in ("not_before", "not_after")
    )
    past = datetime.fromisoformat(begin) + timedelta(minutes=1)
    sign_changed(keystore, document, end, past.isoformat())


def widen_permissions(keystore: Path) -> None:
    document = enclave(keystore, "sat1") / "permissions.p7s"
    forge(document, b"<topic>rt/sat1/command</topic>", b"<topic>rt/sat2/command</topic>")


def open_governance(keystore: Path) -> None:
    kept = keystore / "enclaves" / "governance.p7s"
    forge(kept, b"participants>false<", b"participants>true<")


def name_domains_to_232(keystore: Path) -> None:
    kept = keystore / "enclaves" / "governance.p7s"
    sign_changed(keystore, kept, "<max>230</max>", "<max>232</max>")


def take(name: str) -> Callable[[Path], None]:
    """Give sat1 a file of sat2."""

    def copy(keystore: Path) -> None:
        content = (enclave(keystore, "sat2") / name).read_bytes()
        (enclave(keystore, "sat1") / name).write_bytes(content)

    return copy


SPOILT = {
    "certificate expired": (expire_certificate, "certificate has expired"),
    "certificate of another authority": (sign_certificate_elsewhere, "certificate signature failure"),
    "permissions expired": (expire_permissions, "Permissions validity period expired for CN=/formation/sat1"),
    "permissions changed after they were signed": (widen_permissions, "signature failure"),
    "governance changed after it was signed": (open_governance, "signature failure"),
    "governance that names domains to 232": (name_domains_to_232, "Can not parse governance file"),
    "permissions of another satellite": (take("permissions.p7s"), "Subject name is invalid"),
    "certificate of another satellite": (take("cert.pem"), "Subject name is invalid"),
}
"""What is spoilt of sat1, with the reason for which Cyclone DDS refuses it."""


@pytest.mark.parametrize(("spoil", "reason"), SPOILT.values(), ids=SPOILT)
def test_a_participant_with_wrong_documents_does_not_join(
    spoil: Callable[[Path], None],
    reason: str,
    keystore: Path,
    cyclone: CycloneProgram,
    participants: Participants,
) -> None:
    variables = cyclone.variables(enclave(keystore, "sat1"))
    assert participants.start(cyclone.executable, "sat1", variables).joined()
    spoil(keystore)
    refused = participants.start(cyclone.executable, "sat1", variables)
    assert not refused.joined()
    assert reason in refused.log.read_text()


REFUSED_BY_FAST_DDS = {
    **{name: spoil for name, (spoil, _) in SPOILT.items() if "232" not in name},
    "key of another satellite": take("key.pem"),
}


@pytest.mark.parametrize("spoil", REFUSED_BY_FAST_DDS.values(), ids=REFUSED_BY_FAST_DDS)
def test_fast_dds_refuses_wrong_documents(
    spoil: Callable[[Path], None], keystore: Path, fastdds: FastDdsProgram, participants: Participants
) -> None:
    variables = fastdds.variables(enclave(keystore, "sat1"))
    assert participants.start(fastdds.executable, "sat1", variables).joined()
    spoil(keystore)
    assert not participants.start(fastdds.executable, "sat1", variables).joined()


def test_keys_of_one_domain_are_not_accepted_in_another(
    cyclone: CycloneProgram, participants: Participants, tmp_path: Path
) -> None:
    make(shipped("triangle"), tmp_path / "keys", 30, (participants.domain, participants.domain))
    variables = cyclone.variables(enclave(tmp_path / "keys", "sat1"))
    assert participants.start(cyclone.executable, "sat1", variables).joined()
    other = participants.start(cyclone.executable, "sat1", variables, participants.domain + 100)
    assert not other.joined()
    assert f"Could not find domain {participants.domain + 100} in governance" in other.log.read_text()


def restrict_to_another_domain(keystore: Path) -> None:
    document = enclave(keystore, "sat1") / "permissions.p7s"
    domains = document.with_suffix(".xml").read_text().partition("<domains>")[2].partition("</domains>")[0]
    sign_changed(keystore, document, domains, "<id>199</id>")


@pytest.mark.parametrize(
    ("spoil", "own_checks", "reason"),
    [
        pytest.param(
            *(restrict_to_another_domain, False, "participant denied by default rule"),
            id="permissions of another domain",
        ),
        pytest.param(take("key.pem"), True, "Process handshake failed", id="key of another satellite"),
    ],
)
def test_a_participant_whose_own_dds_lets_it_join_is_refused_by_the_others(
    spoil: Callable[[Path], None],
    own_checks: bool,
    reason: str,
    keystore: Path,
    cyclone: CycloneProgram,
    participants: Participants,
) -> None:
    def start(*names: str, own_checks: bool = True) -> list[Participant]:
        return [
            participants.start(
                cyclone.executable, name, cyclone.variables(enclave(keystore, name), own_checks=own_checks)
            )
            for name in names
        ]

    # The others have joined before the documents of sat1 are spoilt.
    flying = start("plant", "recorder")
    assert [participant.joined() for participant in flying] == [True] * 2
    spoil(keystore)
    flying += start("sat1", own_checks=own_checks)
    assert flying[2].joined()
    for participant in flying[:2]:
        wait_for_report((participant, reason), (flying[2], reason))
    exchange(flying, [{("publish", STATE): 1}, {("subscribe", STATE): 1}, {("subscribe", STATE): 0}], SAMPLES)
    assert [participant.matched for participant in flying] == [
        {("publish", STATE): 1},
        {("subscribe", STATE): 1},
        {("subscribe", STATE): 0},
    ]
    assert [participant.received for participant in flying] == [{}, {(STATE, "plant"): 2 * SAMPLES}, {}]


def test_formations_with_keys_of_two_authorities_do_not_receive_each_other(
    keystore: Path, cyclone: CycloneProgram, participants: Participants, tmp_path: Path
) -> None:
    make(shipped("triangle"), tmp_path / "other", 30, ANY_DOMAIN)
    flying = [
        participants.start(cyclone.executable, f"{node}_{keys.name}", cyclone.variables(enclave(keys, node)))
        for keys in (keystore, tmp_path / "other")
        for node in ("plant", "sat1")
    ]
    assert [participant.joined() for participant in flying] == [True] * 4
    # Of two that meet, the one that answers reports the other's certificate.
    failure = "certificate signature failure; subject: /CN=\\/formation\\/"
    for plant, satellite in ((flying[0], flying[3]), (flying[2], flying[1])):
        wait_for_report((plant, f"{failure}sat1"), (satellite, f"{failure}plant"))
    exchange(flying, [{("publish", STATE): 1}, {("subscribe", STATE): 1}] * 2, SAMPLES)
    assert [participant.matched for participant in flying] == [
        {("publish", STATE): 1},
        {("subscribe", STATE): 1},
    ] * 2
    assert [participant.received for participant in flying] == [
        *({}, {(STATE, "plant_keystore"): 2 * SAMPLES}),
        *({}, {(STATE, "plant_other"): 2 * SAMPLES}),
    ]
