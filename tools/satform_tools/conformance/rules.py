# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The rules of docs/interface.md that are tried, and what was found of each."""

from dataclasses import dataclass, field

RULES = {
    "E1": "endpoints under the satellite's name, with the types of the reference",
    "E2": "QoS compatible with the reference",
    "R1": "one NodeReady with its name, step 0 and its stamp, the checkpoint",
    "R2": "NodeReady only when all endpoints are matched",
    "V1": "interface version",
    "V2": "type hashes of the messages",
    "S1": "phase for the first step when its state arrives",
    "S2": "command only with the state and all messages of the step",
    "S3": "phase for the next step after the command",
    "S4": "stamps and frame",
    "S5": "finite numbers within bounds",
    "S6": "copy of the phase in the command",
    "S7": "no other command for a repeated state",
    "S8": "last messages again while a step does not go on",
    "S9": "late state answered",
    "F1": "no command before the status of the state's version",
    "F2": "in-neighbours by the edges and members of the status",
    "F3": "a new edge: subscribes and waits",
    "L1": "no command after its own loss, and exit code 3",
    "L2": "NodeReady again to rejoin",
    "L3": "takes part from the step of its return",
    "X1": "ends at FINISHED with exit code 0",
}
"""What each rule is about, in the order in which they are printed."""


@dataclass
class Findings:
    """What was found of each rule.

    Attributes:
        tried: rules that were tried.
        broken: of each broken rule, sentences about how.
        left_out: of each rule that this scenario does not allow to try, a sentence about why.
    """

    tried: set[str] = field(default_factory=set)
    broken: dict[str, list[str]] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)

    def require(self, rule: str, fulfilled: object, sentence: str) -> bool:
        """Note whether a rule is kept.

        Args:
            rule: that is tried.
            fulfilled: whether it is kept.
            sentence: about what was found where it is not.

        Returns:
            Whether it is kept.
        """
        self.tried.add(rule)
        if not fulfilled and sentence not in self.broken.setdefault(rule, []):
            self.broken[rule].append(sentence)
        return bool(fulfilled)

    def leave_out(self, rule: str, why: str) -> None:
        """Note why a rule is not tried.

        Args:
            rule: that is not tried.
            why: as a sentence.
        """
        self.left_out[rule] = why

    def remarks(self, rule: str) -> list[str]:
        """Sentences about how a rule is broken, or why it is not tried."""
        why = self.left_out.get(rule)
        return self.broken.get(rule, [why] if why else [])

    def outcome(self, rule: str) -> str:
        """`kept`, `broken` or `not tried`."""
        if self.broken.get(rule):
            return "broken"
        return "kept" if rule in self.tried else "not tried"

    def data(self) -> dict[str, dict[str, object]]:
        """Outcome and sentences of each rule, for JSON."""
        return {
            rule: {
                "outcome": self.outcome(rule),
                "found": self.broken.get(rule, []),
                "why_not_tried": self.left_out.get(rule, ""),
            }
            for rule in RULES
        }
