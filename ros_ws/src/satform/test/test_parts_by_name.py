# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the installed package offers by name is there."""

from importlib.metadata import distribution

from satform.common.spec import Spec

PARTS = [entry for entry in distribution("satform").entry_points if entry.group.startswith("satform.")]


def test_every_part_that_a_scenario_may_name_can_be_loaded_and_bears_its_name() -> None:
    assert {entry.group for entry in PARTS} >= {"satform.controllers", "satform.curves", "satform.topologies"}
    for entry in PARTS:
        spec = entry.load()
        assert issubclass(spec, Spec), entry.name
        assert spec.model_fields["kind"].default == entry.name
