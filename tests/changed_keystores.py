# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Documents of a keystore, changed and signed again as its authority could."""

from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import load_pem_private_key

from satform_tools.security.keystore import Authority


def enclave(keystore: Path, node: str) -> Path:
    return keystore / "enclaves" / "formation" / node


def authority(keystore: Path) -> Authority:
    certificate = x509.load_pem_x509_certificate((keystore / "public" / "ca.cert.pem").read_bytes())
    key = load_pem_private_key((keystore / "private" / "ca.key.pem").read_bytes(), None)
    assert isinstance(key, ec.EllipticCurvePrivateKey)
    return Authority(certificate, key)


def sign_changed(keystore: Path, document: Path, old: str, new: str) -> None:
    """Replace a document by a changed one, signed by the authority of the keystore."""
    text = document.with_suffix(".xml").read_text()
    assert old in text
    document.write_bytes(authority(keystore).sign(text.replace(old, new).encode()))
