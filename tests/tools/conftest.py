# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the tests of the set-up share, and those of campaigns.

What tests of campaigns import takes long to load, and those of the set-up need none of it.
"""

import os
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

# A machine's way to the package index, which a bare environment would lose.
_NETWORK = ("PIP_", "UV_", "SSL_CERT_FILE", "REQUESTS_CA_BUNDLE")
_PROXIES = ("http_proxy", "https_proxy", "no_proxy", "all_proxy")


def pytest_configure(config):
    config.addinivalue_line(
        "markers",
        "setup_from_scratch: sets up a fresh clone, which takes a minute or two and the network; "
        '-m "not setup_from_scratch" leaves it out',
    )


@pytest.fixture
def bare_environment(tmp_path):
    """Variables of someone who has just logged in: an empty home, nothing sourced, the way to the index."""
    home = tmp_path / "home"
    home.mkdir()
    network = {
        name: value
        for name, value in os.environ.items()
        if name.startswith(_NETWORK) or name.lower() in _PROXIES
    }
    python = Path(getattr(sys, "_base_executable", sys.executable)).parent
    path = f"{python}:/usr/local/bin:/usr/bin:/bin"
    return {**network, "HOME": str(home), "PATH": path, "LANG": "C.UTF-8", "TERM": "dumb"}


@pytest.fixture
def project(tmp_path):
    """A project of nothing but the set-up itself."""
    root = tmp_path / "project"
    (root / "tools" / "satform_setup").mkdir(parents=True)
    (root / "ros_ws" / "src").mkdir(parents=True)
    for name in ("requirements.txt", "ros_ws/ros_wheels_fix.cmake", "tools/satform"):
        (root / name).write_bytes((ROOT / name).read_bytes())
    (root / "tools" / "satform").chmod(0o755)
    for module in (ROOT / "tools" / "satform_setup").glob("*.py"):
        (root / "tools" / "satform_setup" / module.name).write_bytes(module.read_bytes())
    return root


@pytest.fixture
def file(tmp_path):
    """File of a small campaign."""
    from small_campaign import write_campaign

    return write_campaign(tmp_path)


@pytest.fixture(scope="module")
def wanted(tmp_path_factory):
    """The hash over all results of the small campaign, flown in this process alone."""
    from small_campaign import results_hash, write_campaign

    return results_hash(write_campaign(tmp_path_factory.mktemp("wanted")))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder of a campaign of 300 cases, whose results were made and not flown."""
    from campaigns import made_campaign

    return made_campaign(tmp_path_factory.mktemp("campaigns") / "made", 300)


@pytest.fixture(scope="module")
def summary(folder):
    """Summary of the campaign of made results."""
    from satform_tools.campaign.summary import summarise

    return summarise(folder, folder.campaign())


@pytest.fixture(scope="module")
def page(summary, tmp_path_factory):
    """Page of the campaign of made results."""
    from satform_tools.campaign import report

    return report.write(summary, tmp_path_factory.mktemp("page"))[0]
