# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0

"""Names of scenario fields, kinds and values that version 0.2.0 renamed, with the names they have now."""

RENAMED_FIELDS = {
    "circulation": "nominal_motion",
    "every_satellite": "satellite_defaults",
    "parameter": "path_parameter",
    "feed_forward": "feedforward_sample",
    "drop_after": "neighbour_timeout",
    "tolerated_silence": "node_timeout",
    "tolerated_liars": "tolerated_byzantine",
    "expectations_left_out": "omitted_expectations",
    "most_rejected": "max_consecutive_rejections",
    "reach": "integration_band",
    "speaker": "sender",
    "listener": "receiver",
    "back": "rejoin_at",
}
"""New name of each renamed field, whichever part of a scenario it belongs to."""

RENAMED_VALUES = {
    "hill_pd": "feedback_linearisation",
    "adaptive_distance": "artificial_potential",
    "impulse": "impulsive_guidance",
    "liar": "byzantine",
    "clipped_commands": "saturated_steps",
    "withheld_commands": "below_minimum_impulse_steps",
    "starved_steps": "propellant_depleted_steps",
    "middle": "midpoint",
    "smallest": "minimum",
    "largest": "maximum",
}
"""New name of each renamed `kind` or other choice."""
