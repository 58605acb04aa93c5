# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Conformance of a satellite's node with the rules of docs/interface.md.

`formation` plays the plant, the neighbours and the recorder, `rules` keeps what was found of each rule,
`procedure` is the flight in which all rules are tried, `responses` waits for what the node answers and looks
at it, `command` starts the node and prints the result.
"""
