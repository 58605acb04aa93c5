# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Damaged keystores: missing, foreign and open files, and any text for the list of permissions."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from random import Random

from byte_damage import damaged
from input_kind import Input

from flights import shortened
from satform.flight.compile import compile_scenario
from satform_bringup.deployment import security
from satform_nodes.plant.permitted_edges import POLICIES, permitted_graph
from satform_tools.security.keystore import make as make_keystore
from satform_tools.security.permission_documents import ANY_DOMAIN

_XML = (
    b'<?xml version="1.0" encoding="utf-7"?><a/>',
    b'<?xml version="1.0" encoding="ebcdic-x"?><a/>',
    b'<?xml version="1.0" encoding="idna"?><a/>',
    b'<!DOCTYPE a [<!ENTITY x SYSTEM "file:///dev/zero">]><a>&x;</a>',
    b"<!DOCTYPE a [" + b"".join(b'<!ENTITY e%d "%s">' % (n, b"&e%d;" % (n - 1) * 9) for n in range(1, 12)),
    b"<a>" * 200_000,
    b"<a " + b"x='1' " * 100_000 + b"/>",
    b"<enclaves/>",
    b"\xff\xfe<\0a\0/\0>\0",
    b"",
)
"""Documents that are none, or that stand for more than they are."""

_SNIPPETS = (
    b"<",
    b">",
    b"&",
    b"&x;",
    b"<!--",
    b"]]>",
    b"<![CDATA[",
    b"</topic>",
    b"\x00",
    b"\xff",
    b"<topic/>",
)


def keystore_inputs(folder: Path) -> Callable[[Random, Path], Input]:
    """What makes damaged keystores.

    Args:
        folder: for the whole one.
    """
    scenario = shortened("triangle", 10.0)
    whole = folder / "keys"
    make_keystore(scenario, whole, 30, ANY_DOMAIN)
    plan = compile_scenario(scenario)
    policies = (whole / POLICIES).read_bytes()
    enclaves = sorted(f"/formation/{path.name}" for path in (whole / "enclaves" / "formation").iterdir())

    def make(draw: Random, place: Path) -> Input:
        keystore = place / "keys"
        if draw.random() < 0.5:
            keystore.mkdir()
            text = draw.choice(_XML) if draw.random() < 0.1 else damaged(draw, policies, _SNIPPETS)
            (keystore / POLICIES).write_bytes(text)
        else:
            shutil.copytree(whole, keystore, symlinks=True, copy_function=_linked)
            _replace(draw, keystore)
        return Input(read(keystore), str(keystore), (security.SecurityError,))

    def read(keystore: Path) -> Callable[[], None]:
        def _read() -> None:
            permitted_graph(plan, security.variables(keystore))
            for enclave in enclaves:
                security.require_enclave(keystore, enclave)

        return _read

    return make


def _linked(source: str, target: str) -> None:
    """Give a file another name: files are replaced, and never written to."""
    os.link(source, target, follow_symlinks=False)


def _replace(draw: Random, keystore: Path) -> None:
    """Put something else in the place of one of the files."""
    files = sorted(path for path in keystore.rglob("*") if not path.is_dir() or path.is_symlink())
    path = draw.choice([*files, keystore / POLICIES])
    content = path.read_bytes()
    path.unlink()
    match draw.randrange(8):
        case 0:
            path.mkdir()
        case 1:
            os.mkfifo(path)
        case 2:
            path.symlink_to(path.name)
        case 3:
            path.symlink_to("/dev/zero")
        case 4:
            path.write_bytes(content)
            path.chmod(draw.choice((0o644, 0o000, 0o777)))
        case 5:
            path.write_bytes(b"")
        case 6:
            path.write_bytes(damaged(draw, content))
            path.chmod(0o600)
        case _:
            # It is missing.
            return
