# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Makes a keystore in the layout of SROS 2: a certificate authority, and an enclave of keys for each node."""

import os
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, pkcs7
from cryptography.x509.oid import NameOID

from satform.consensus.graph import Graph
from satform.scenario import Scenario
from satform_nodes.plant.permitted_edges import POLICIES
from satform_tools.errors import CommandError, sentence_of
from satform_tools.security import permission_documents
from satform_tools.security.access import Access, accesses

_AUTHORITY = "satform"

_EARLIER = timedelta(days=1)
"""By which certificates begin before they are made, for machines whose clocks differ."""


@dataclass(frozen=True)
class Authority:
    """Certificate authority that signs certificates of nodes, governance and permissions.

    Attributes:
        certificate: of the authority, signed by itself.
        key: private.
    """

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    def sign(self, document: bytes) -> bytes:
        """A document with its signature beside it, as S/MIME."""
        builder = pkcs7.PKCS7SignatureBuilder().set_data(document)
        builder = builder.add_signer(self.certificate, self.key, hashes.SHA256())
        options = [pkcs7.PKCS7Options.Text, pkcs7.PKCS7Options.DetachedSignature]
        return builder.sign(Encoding.SMIME, options)


def make(
    scenario: Scenario, folder: Path, days: int, domains: tuple[int, int], further: Graph | None = None
) -> list[Access]:
    """Make the keystore of a formation.

    Args:
        scenario: whose nodes get keys and permissions.
        folder: new or empty.
        days: for which the certificates hold.
        domains: first and last DDS domain in which the nodes may take part.
        further: edges beside those of the scenario, as for `accesses`.

    Returns:
        What each node may do.

    Raises:
        CommandError: the folder holds something already, or cannot be written to; or the formation cannot use
            these edges in flight.
    """
    try:
        granted = accesses(scenario, further)
    except ValueError as error:
        raise CommandError(f"--possible-graph: {error}") from None
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise CommandError(f"{folder} already exists and is not an empty folder; name another with --out")
        _fill(folder, granted, timedelta(days=days), domains)
    except OSError as error:
        raise CommandError(f"the keystore cannot be written: {sentence_of(error)}") from None
    return granted


def _fill(folder: Path, granted: list[Access], validity: timedelta, domains: tuple[int, int]) -> None:
    public, private, enclaves = folder / "public", folder / "private", folder / "enclaves"
    for part in (public, enclaves):
        part.mkdir(parents=True)
    private.mkdir(mode=0o700)
    begin = datetime.now(UTC).replace(microsecond=0) - _EARLIER
    end = begin + _EARLIER + validity
    authority = _authority(begin, end)
    _write_certificate(public / "ca.cert.pem", authority.certificate)
    _write_key(private / "ca.key.pem", authority.key)
    for purpose in ("identity_ca", "permissions_ca"):
        (public / f"{purpose}.cert.pem").symlink_to("ca.cert.pem")
        (private / f"{purpose}.key.pem").symlink_to("ca.key.pem")
    (folder / POLICIES).write_bytes(permission_documents.policies(granted))
    rules = permission_documents.governance(domains)
    (enclaves / "governance.xml").write_bytes(rules)
    (enclaves / "governance.p7s").write_bytes(authority.sign(rules))
    for access in granted:
        permitted = permission_documents.permissions(access, begin, end, domains)
        _make_enclave(enclaves / access.enclave.lstrip("/"), access, authority, permitted)


def _make_enclave(folder: Path, access: Access, authority: Authority, permitted: bytes) -> None:
    folder.mkdir(parents=True)
    root = Path(*[".."] * len(access.enclave.strip("/").split("/")))
    for purpose in ("identity_ca", "permissions_ca"):
        (folder / f"{purpose}.cert.pem").symlink_to(root / ".." / "public" / f"{purpose}.cert.pem")
    (folder / "governance.p7s").symlink_to(root / "governance.p7s")
    key = ec.generate_private_key(ec.SECP256R1())
    certificate = (
        _certificate(access.enclave, key.public_key(), authority.certificate)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=False)
        .sign(authority.key, hashes.SHA256())
    )
    _write_certificate(folder / "cert.pem", certificate)
    _write_key(folder / "key.pem", key)
    (folder / "permissions.xml").write_bytes(permitted)
    (folder / "permissions.p7s").write_bytes(authority.sign(permitted))


def _authority(begin: datetime, end: datetime) -> Authority:
    # The curve that DDS Security asks for, section 9.3.1.
    key = ec.generate_private_key(ec.SECP256R1())
    name = _name(_AUTHORITY)
    certificate = (
        x509.CertificateBuilder(name, name, key.public_key(), x509.random_serial_number(), begin, end)
        .add_extension(x509.BasicConstraints(ca=True, path_length=1), critical=True)
        .sign(key, hashes.SHA256())
    )
    return Authority(certificate, key)


def _certificate(
    subject: str, key: ec.EllipticCurvePublicKey, authority: x509.Certificate
) -> x509.CertificateBuilder:
    """A certificate, yet to be signed, that holds as long as its authority's."""
    return x509.CertificateBuilder(
        authority.subject,
        _name(subject),
        key,
        x509.random_serial_number(),
        authority.not_valid_before_utc,
        authority.not_valid_after_utc,
    )


def _name(common_name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])


def _write_certificate(path: Path, certificate: x509.Certificate) -> None:
    path.write_bytes(certificate.public_bytes(Encoding.PEM))


def _write_key(path: Path, key: ec.EllipticCurvePrivateKey) -> None:
    """Write a private key with mode 0600 from its creation on."""
    text = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(text)
