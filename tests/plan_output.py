# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What `satform plan` prints as JSON."""

import json

import pytest

from satform_tools.cli import main as cli


def planned(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, object]:
    """Call `satform plan` with these words, and read its JSON."""
    assert cli.main(["plan", *words, "--json"]) == 0
    found: dict[str, object] = json.loads(capsys.readouterr().out)
    return found
