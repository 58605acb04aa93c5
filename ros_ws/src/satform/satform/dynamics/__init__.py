# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Truth dynamics models of relative motion: CW, perturbed CW, J2, inertial; forces and integrators.

Imports `orbits` and below.
"""
