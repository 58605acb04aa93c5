# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Participants of other implementations of DDS than that of the wheels, in a domain of their own."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from satform_bringup.deployment.domain_lock import own_domain
from secured_participants import (
    CycloneProgram,
    FastDdsProgram,
    NotBuiltError,
    Participants,
    build_cyclone,
    build_fastdds,
)


@pytest.fixture(scope="session")
def cyclone(tmp_path_factory: pytest.TempPathFactory) -> CycloneProgram:
    """The participant on Cyclone DDS."""
    try:
        return build_cyclone(tmp_path_factory.mktemp("cyclone"))
    except NotBuiltError as error:
        pytest.skip(f"NOT TESTED: permissions are not enforced by Cyclone DDS here: {error}")


@pytest.fixture(scope="session")
def fastdds(tmp_path_factory: pytest.TempPathFactory) -> FastDdsProgram:
    """The participant on the Fast DDS of the distribution, which has security."""
    try:
        return build_fastdds(tmp_path_factory.mktemp("fastdds"))
    except NotBuiltError as error:
        pytest.skip(f"NOT TESTED: permissions are not enforced by Fast DDS here: {error}")


@pytest.fixture
def participants(tmp_path: Path) -> Iterator[Participants]:
    """Participants in a DDS domain that no other test and no run on this machine uses."""
    with own_domain() as domain:
        started = Participants(domain, tmp_path)
        yield started
        started.end()
