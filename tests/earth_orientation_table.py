# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A table of Earth orientation parameters for the tests that need one."""


def finals(difference=0.1, pole=(0.2, 0.3), first=60300, days=30):
    """A table in the form of finals2000A: UT1 - UTC in s, the pole in seconds of arc.

    Columns as in the IERS's own description of the format (readme.finals2000A).
    """
    lines = []
    for day in range(days):
        line = [" "] * 187
        columns = {
            1: "24 1 1",
            8: f"{first + day:8.2f}",
            17: "I",
            19: f"{pole[0]:9.6f}",
            28: " 0.000010",
            38: f"{pole[1]:9.6f}",
            47: " 0.000010",
            58: "I",
            59: f"{difference:10.7f}",
            69: " 0.0000010",
            80: " 0.0000",
            87: " 0.0100",
            96: "I",
            98: "    0.000",
            107: "    0.100",
            117: "    0.000",
            126: "    0.100",
        }
        for column, text in columns.items():
            line[column - 1 : column - 1 + len(text)] = text
        lines.append("".join(line))
    return "\n".join(lines) + "\n"
