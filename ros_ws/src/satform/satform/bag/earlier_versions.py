# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Names of messages and fields in bags of earlier versions, and what they are called now."""

import re

RENAMED_FIELDS = {
    "satform_msgs/msg/FormationStatus": {
        "number": "version",
        "listeners": "edge_receivers",
        "speakers": "edge_senders",
        "last_words": "final_commands",
        "back": "rejoined",
        "checkpoints": "rejoin_checkpoints",
    },
    "satform_msgs/msg/RelativeState": {"formation": "formation_version"},
    "satform_msgs/msg/Propulsion": {
        "clipped": "saturated_steps",
        "withheld": "below_minimum_impulse_steps",
        "starved": "propellant_depleted_steps",
    },
    "satform_msgs/msg/Attitude": {
        "torque_limited": "torque_saturated_steps",
        "momentum_limited": "momentum_saturated_steps",
    },
}
"""By message type, the fields of version 0.1.0 and their names now."""

RENAMED_MESSAGES = {
    "satform_msgs/msg/Ready": "satform_msgs/msg/NodeReady",
    "satform_msgs/msg/Recorded": "satform_msgs/msg/RecorderProgress",
}
"""The message types of version 0.1.0 that have another name now."""


def renamed(type_name: str, definition: str) -> str:
    """What has another name now of a message as a bag describes it.

    Args:
        type_name: for example `satform_msgs/msg/FormationStatus`.
        definition: text of the message, with the messages that it contains below it.

    Returns:
        A clause for an error message; empty if nothing has been renamed.
    """
    if type_name in RENAMED_MESSAGES:
        return f"its message {type_name} is now called {RENAMED_MESSAGES[type_name]}"
    own = definition.partition("\n====")[0]
    fields = {
        old: new
        for old, new in RENAMED_FIELDS.get(type_name, {}).items()
        if re.search(rf"^\s*[\w/\[\]]+\s+{old}\s*(#.*)?$", own, re.MULTILINE)
    }
    if not fields:
        return ""
    pairs = ", ".join(f"{old} is now {new}" for old, new in fields.items())
    return f"in its message {type_name} {pairs}"
