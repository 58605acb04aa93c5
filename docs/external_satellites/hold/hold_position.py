# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A satellite that holds the position of its first state, and announces the mean phase of its in-neighbours.

It knows no scenario: names, graph and time come from the messages, so that it can be any satellite of any
scenario whose satellites exchange their phase. Usage: hold_position.py SATELLITE [--not-recorded]
"""

import sys
from functools import partial
from types import SimpleNamespace

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from satform_msgs.msg import ArcLength, Command, FormationStatus, NodeReady, RelativeState

STIFFNESS, DAMPING = 1.0e-4, 2.0e-2  # 1/s^2, 1/s
EACH_STEP = QoSProfile(depth=1000)
LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
OWN, RECORDED = sys.argv[1], "--not-recorded" not in sys.argv

rclpy.init()
node = rclpy.create_node(OWN)
command_publisher = node.create_publisher(Command, f"{OWN}/command", EACH_STEP)
phase_publisher = node.create_publisher(ArcLength, f"{OWN}/arc_length", EACH_STEP)
ready_publisher = node.create_publisher(NodeReady, "formation/node_ready", LATCHED)
sources, phases, last = {}, {}, []
now = SimpleNamespace(
    status=None,
    state=None,
    anchor=None,
    step=None,
    phase=(0.0, 0.0),
    ready=False,
    alive=False,
    rejoined=False,
)


def edges(end, other):
    """Names of the flying satellites at one end of the edges whose other end this satellite is."""
    names, alive = now.status.satellites, now.status.alive
    pairs = zip(end, other, strict=True)
    return [names[first] for first, second in pairs if names[second] == OWN and alive[first]]


def senders():
    return edges(now.status.edge_senders, now.status.edge_receivers)


def take_status(message):
    now.status = message
    alive = now.status.alive[now.status.satellites.index(OWN)]
    if now.status.phase == FormationStatus.FINISHED:
        raise SystemExit(0)
    if now.status.phase == FormationStatus.ABORTED or (now.step is not None and not alive):
        raise SystemExit(3)
    if now.alive and not alive:
        now.ready = False  # the plant rejects readiness that it reads before the loss
    now.alive = alive
    now.rejoined = alive and (now.rejoined or OWN in message.rejoined)
    # The status has the present edges alone, and a schedule of the scenario may bring others.
    for name in now.status.satellites:
        if name != OWN and name not in sources:
            sources[name] = node.create_subscription(
                ArcLength, f"{name}/arc_length", partial(take_phase, name), EACH_STEP
            )
    for publisher, repeated in last:
        publisher.publish(repeated)
    act()


def take_phase(name, message):
    phases[message.step, name] = (message.arc_length, message.rate)
    act()


def take_state(message):
    if now.step is None or message.step == now.step:
        now.state = message
        act()


def report_ready():
    if now.ready or now.status is None:
        return
    receivers = edges(now.status.edge_receivers, now.status.edge_senders)
    wanted = {ready_publisher: 1, command_publisher: 1 + RECORDED, phase_publisher: len(receivers) + RECORDED}
    now.ready = all(end.get_subscription_count() >= count for end, count in wanted.items()) and all(
        end.get_publisher_count() for end in (states, *(sources[name] for name in senders()))
    )
    if now.ready:
        message = NodeReady(node=node.get_fully_qualified_name(), checkpoint=-1, interface=1)
        message.header.frame_id = "lvlh"
        ready_publisher.publish(message)


def act():
    state, status = now.state, now.status
    if state is None or status is None or status.version < state.formation_version:
        return
    if state.step == status.last_step:
        return
    stamp = state.header.stamp
    if now.step is None:
        # At step 0, or at that of its return: a former process may not be known to be lost yet.
        if state.step < status.step or not (now.alive and (state.step == 0 or now.rejoined)):
            return
        now.step, now.anchor = state.step, (state.position.x, state.position.y, state.position.z)
        publish(phase_publisher, announcement(), now.step, stamp)
    names = senders()
    if state.step != now.step or any((now.step, name) not in phases for name in names):
        return
    received = [phases[now.step, name] for name in names]
    for key in [key for key in phases if key[0] <= now.step]:
        del phases[key]
    if received:
        now.phase = tuple(sum(values) / len(received) for values in zip(*received, strict=True))
    command = Command(announced_at=stamp)
    command.announced_arc_length, command.announced_rate = now.phase
    for axis, held in zip("xyz", now.anchor, strict=True):
        offset, speed = getattr(state.position, axis) - held, getattr(state.velocity, axis)
        setattr(command.acceleration, axis, -STIFFNESS * offset - DAMPING * speed)
    del last[:-1]
    publish(command_publisher, command, now.step, stamp)
    # The values hold at the time of this step, and are announced for the next one.
    publish(phase_publisher, announcement(), now.step + 1, stamp)
    now.step, now.state = now.step + 1, None


def announcement():
    return ArcLength(arc_length=now.phase[0], rate=now.phase[1])


def publish(publisher, message, number, stamp):
    message.header.stamp, message.header.frame_id, message.step = stamp, "lvlh", number
    last.append((publisher, message))
    publisher.publish(message)


states = node.create_subscription(RelativeState, f"{OWN}/state", take_state, EACH_STEP)
statuses = node.create_subscription(FormationStatus, "formation/status", take_status, LATCHED)
timer = node.create_timer(0.1, report_ready)
rclpy.spin(node)
