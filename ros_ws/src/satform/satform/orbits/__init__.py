# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames, chief orbit, relative orbits (curves) and motion along them, Earth and Sun.

Imports `common`, `numeric`, `files`.
"""
