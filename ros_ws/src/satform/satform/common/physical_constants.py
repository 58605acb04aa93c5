# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Constants of electromagnetic waves; exact by the definition of the SI (BIPM, SI Brochure, 9th ed.)."""

SPEED_OF_LIGHT = 299_792_458.0
"""m/s."""

BOLTZMANN = 1.380649e-23
"""J/K."""

PLANCK = 6.62607015e-34
"""J s."""
