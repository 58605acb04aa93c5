# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Long lists of names are shortened in messages."""

from satform.common.name_list import listed


def test_few_names_are_listed_and_many_are_counted() -> None:
    assert listed(["sat1", "sat2"]) == "sat1, sat2"
    assert listed([]) == ""
    names = [f"s{index}" for index in range(512)]
    assert listed(names[:8]) == "s0, s1, s2, s3, s4, s5, s6, s7"
    assert listed(names) == "s0, s1, s2, s3, s4, s5, s6, s7 and 504 more"
    assert listed(names, 6) == "s0, s1, s2, s3, s4, s5 and 506 more"
