# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Satellite 2 of the scenario `triangle` as a program of its own: plain rclpy and satform's messages."""

import rclpy
from phase_law import PhaseLaw, header
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from satform_msgs.msg import ArcLength, Command, FormationStatus, NodeReady, RelativeState, Tracking

OWN, NEIGHBOURS = "sat2", ("sat1", "sat3")
EACH_STEP = QoSProfile(depth=1000)  # reliable, volatile
LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class ForeignSatellite(Node):
    def __init__(self) -> None:
        super().__init__(OWN)
        recorded = self.declare_parameter("recorded", True).value  # whether a recorder takes part
        self.law, self.step, self.state, self.status = PhaseLaw(), None, None, FormationStatus()
        self.phases, self.last, self.ready, self.alive, self.rejoined = {}, [], False, False, False
        self.command = self.create_publisher(Command, f"{OWN}/command", EACH_STEP)
        self.phase = self.create_publisher(ArcLength, f"{OWN}/arc_length", EACH_STEP)
        self.tracking = self.create_publisher(Tracking, f"{OWN}/tracking", EACH_STEP)  # for the recorder
        self.node_ready = self.create_publisher(NodeReady, "formation/node_ready", LATCHED)
        self.create_subscription(FormationStatus, "formation/status", self.on_status, LATCHED)
        self.sources = [self.create_subscription(RelativeState, f"{OWN}/state", self.on_state, EACH_STEP)]
        for name in NEIGHBOURS:
            take = lambda message, name=name: self.on_phase(name, message)  # noqa: E731
            self.sources.append(self.create_subscription(ArcLength, f"{name}/arc_length", take, EACH_STEP))
        self.targets = {self.command: 1 + recorded, self.phase: 2 + recorded, self.tracking: 0 + recorded}
        self.create_timer(0.1, self.report_ready)

    def report_ready(self) -> None:  # once all its topics are matched
        matched = all(end.get_subscription_count() >= count for end, count in self.targets.items())
        if not self.ready and matched and all(source.get_publisher_count() for source in self.sources):
            self.ready = True
            self.node_ready.publish(NodeReady(header=header(0), node=f"/{OWN}", checkpoint=-1, interface=1))

    def on_status(self, status: FormationStatus) -> None:
        self.status, alive = status, status.alive[status.satellites.index(OWN)]
        self.ready, self.alive = self.ready and (alive or not self.alive), alive  # a loss asks for it again
        self.rejoined = alive and (self.rejoined or OWN in status.rejoined)
        over = status.phase in (FormationStatus.FINISHED, FormationStatus.ABORTED)
        if over or (self.step is not None and not alive):  # if it is lost, it rejoins when started again
            raise SystemExit(0 if status.phase == FormationStatus.FINISHED else 3)
        for publisher, message in self.last:  # a repeated status asks for the last messages again
            publisher.publish(message)
        self.act()

    def on_phase(self, name: str, message: ArcLength) -> None:
        self.phases[message.step, name] = (message.arc_length, message.rate)
        self.act()

    def on_state(self, state: RelativeState) -> None:
        if self.step is None or state.step == self.step:  # else it is repeated, and has been answered
            self.state = state
            self.act()

    def act(self) -> None:  # once the formation of the state and all phases of its step are known
        state, status = self.state, self.status
        if state is None or status.version < state.formation_version or state.step == status.last_step:
            return
        if self.step is None:  # begins at step 0, or at that of its return
            if state.step < status.step or not (self.alive and (state.step == 0 or self.rejoined)):
                return
            self.step = state.step
            self.publish(self.phase, ArcLength(**self.law.join(self.step)), self.step)
        edges = zip(status.edge_receivers, status.edge_senders, strict=True)
        senders = [sender for receiver, sender in edges if status.satellites[receiver] == OWN]
        keys = [(self.step, status.satellites[sender]) for sender in senders if status.alive[sender]]
        if all(key in self.phases for key in keys):
            acceleration = self.law.act(state, [self.phases[key] for key in keys])
            self.step, self.state, self.last = self.step + 1, None, self.last[-1:]
            phase = {f"announced_{name}": value for name, value in self.law.phase.items()}
            command = Command(acceleration=acceleration, announced_at=header(self.step).stamp, **phase)
            self.publish(self.command, command, self.step - 1)
            self.publish(self.tracking, Tracking(**self.law.tracking), self.step - 1)
            self.publish(self.phase, ArcLength(**self.law.phase), self.step)

    def publish(self, publisher, message, step: int) -> None:
        message.header, message.step = header(step), step
        self.last.append((publisher, message))
        publisher.publish(message)


if __name__ == "__main__":
    rclpy.init()
    rclpy.spin(ForeignSatellite())
