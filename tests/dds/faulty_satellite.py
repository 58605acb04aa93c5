# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The example in Python with one fault, given by name: each breaks one rule of docs/interface.md.

Usage: faulty_satellite.py FAULT SCENARIO_FILE
"""

import ctypes
import math
import sys
from pathlib import Path
from typing import Any

import rclpy

sys.path.insert(0, str(Path(__file__).parents[2] / "docs" / "external_satellites" / "python"))

import phase_law
from foreign_satellite import ForeignSatellite
from phase_law import header
from rclpy.qos import QoSProfile
from satform_msgs.msg import ArcLength, Command, FormationStatus, NodeReady

FAULT, SCENARIO_FILE = sys.argv[1:]
# The command starts it again in the folder of the same scenario.
_STARTED = Path(SCENARIO_FILE).with_name("started")
IS_STARTED_AGAIN = _STARTED.exists()
_STARTED.touch()


class Doubled(ForeignSatellite):
    """E1: has a second publisher of its command."""

    def __init__(self) -> None:
        super().__init__()
        self.second = self.create_publisher(Command, "sat2/command", 1000)


class NotLatched(ForeignSatellite):
    """E2: subscribes to the status as to a topic that is not latched."""

    def create_subscription(self, kind: Any, topic: str, callback: Any, profile: Any, **options: Any) -> Any:
        if kind is FormationStatus:
            profile = QoSProfile(depth=1000)
        return super().create_subscription(kind, topic, callback, profile, **options)


class NotMatched(ForeignSatellite):
    """R2: ready before its endpoints are matched."""

    def report_ready(self) -> None:
        if not self.ready:
            self.ready = True
            self.node_ready.publish(NodeReady(header=header(0), node="/sat2", checkpoint=-1, interface=1))


class Unready(ForeignSatellite):
    """R1: is there, and never ready."""

    def report_ready(self) -> None:
        pass


class ReadyAgain(ForeignSatellite):
    """R1: says again, at its first state, that it is ready."""

    def on_state(self, state: Any) -> None:
        if self.step is None:
            self.ready = False
            self.report_ready()
        super().on_state(state)


class OtherInterface(ForeignSatellite):
    """V1: written by another version of the interface."""

    def create_publisher(self, kind: Any, *arguments: Any, **options: Any) -> Any:
        made = super().create_publisher(kind, *arguments, **options)
        if kind is NodeReady:
            publish = made.publish
            made.publish = lambda message: (setattr(message, "interface", 99), publish(message))
        return made


class TypeSupport(ctypes.Structure):
    """`rosidl_message_type_support_t` of rosidl_runtime_c."""

    _fields_ = tuple(
        (name, ctypes.c_void_p)
        for name in ("identifier", "data", "find", "type_hash", "type_description", "sources")
    )


class TypeHash(ctypes.Structure):
    """`rosidl_type_hash_t` of rosidl_runtime_c."""

    _fields_ = (("version", ctypes.c_uint8), ("value", ctypes.c_uint8 * 32))


class OtherDefinition(ForeignSatellite):
    """V2: built with another definition of Command, so that DDS announces another type hash."""

    def __init__(self) -> None:
        capsule = ctypes.pythonapi
        capsule.PyCapsule_GetPointer.restype = ctypes.c_void_p
        capsule.PyCapsule_GetPointer.argtypes = (ctypes.py_object, ctypes.c_char_p)
        capsule.PyCapsule_New.restype = ctypes.py_object
        capsule.PyCapsule_New.argtypes = (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p)
        capsule.PyCapsule_GetName.restype = ctypes.c_char_p
        capsule.PyCapsule_GetName.argtypes = (ctypes.py_object,)
        kind: Any = type(Command)
        kind.__import_type_support__()
        self.name_of_capsule = capsule.PyCapsule_GetName(kind._TYPE_SUPPORT)
        address = capsule.PyCapsule_GetPointer(kind._TYPE_SUPPORT, self.name_of_capsule)
        self.other_hash = TypeHash(1, (ctypes.c_uint8 * 32)(*range(32)))
        take_hash = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p)
        self.take_hash = take_hash(lambda _support: ctypes.addressof(self.other_hash))
        # The original is in memory that cannot be written to.
        self.support = TypeSupport.from_buffer_copy(TypeSupport.from_address(address))
        self.support.type_hash = ctypes.cast(self.take_hash, ctypes.c_void_p).value
        kind._TYPE_SUPPORT = capsule.PyCapsule_New(ctypes.addressof(self.support), self.name_of_capsule, None)
        super().__init__()


class Impatient(ForeignSatellite):
    """S2: does not wait for its in-neighbours."""

    def act(self) -> None:
        if self.state is not None and self.status.satellites:
            for name in ("sat1", "sat3"):
                self.phases.setdefault((self.state.step, name), (self.law.arc_length, self.law.rate))
        super().act()


class Changed(ForeignSatellite):
    """A fault in one of the messages that it publishes."""

    def publish(self, publisher: Any, message: Any, step: int) -> None:
        super().publish(_Late(publisher, self.change), message, step)
        self.last[-1] = (publisher, message)

    def change(self, message: Any) -> None:
        raise NotImplementedError


class _Late:
    """A publisher that has a message changed before it is sent."""

    def __init__(self, publisher: Any, change: Any) -> None:
        self._publisher, self._change = publisher, change

    def publish(self, message: Any) -> None:
        self._change(message)
        self._publisher.publish(message)


class WrongStamp(Changed):
    """S4: the stamp of a command is that of the next step."""

    def change(self, message: Any) -> None:
        if isinstance(message, Command):
            message.header = header(message.step + 1)


class NotFinite(Changed):
    """S5: an acceleration that is not a number."""

    def change(self, message: Any) -> None:
        if isinstance(message, Command):
            message.acceleration.x = math.nan


class OtherCopy(Changed):
    """S6: the copy of the phase in the command is that of another."""

    def change(self, message: Any) -> None:
        if isinstance(message, Command):
            message.announced_rate += 1.0


class Inconstant(ForeignSatellite):
    """S7: another command for a repeated state."""

    def on_state(self, state: Any) -> None:
        if self.step is not None and state.step < self.step:
            other = Command(header=header(state.step), step=state.step)
            self.command.publish(other)
        super().on_state(state)


class Mute(ForeignSatellite):
    """S8: publishes nothing again."""

    def on_status(self, status: Any) -> None:
        self.last.clear()
        super().on_status(status)


class Silent(ForeignSatellite):
    """S3: announces no phase after that of its first step."""

    def publish(self, publisher: Any, message: Any, step: int) -> None:
        if not (isinstance(message, ArcLength) and step > 0):
            super().publish(publisher, message, step)


class Forgetful(ForeignSatellite):
    """S9: drops a state that comes after a pause, in which the status has been repeated many times."""

    statuses = 0

    def on_status(self, status: Any) -> None:
        self.statuses += 1
        super().on_status(status)

    def on_state(self, state: Any) -> None:
        # Where nothing is late there are six at most between two states, and in a pause ten and more.
        if self.statuses < 9:
            super().on_state(state)
        self.statuses = 0


class AnyVersion(ForeignSatellite):
    """F1: answers a state whose formation it does not know, once it flies."""

    def on_state(self, state: Any) -> None:
        if self.step is not None:
            state.formation_version = 0
        super().on_state(state)


class Faithful(ForeignSatellite):
    """F2: waits for a neighbour that is lost."""

    def on_status(self, status: Any) -> None:
        for name in ("sat1", "sat3"):
            status.alive[status.satellites.index(name)] = True
        super().on_status(status)


class FixedNeighbours(ForeignSatellite):
    """F3: waits for the message of a new neighbour, and does not subscribe to it; in ring_six."""

    def __init__(self) -> None:
        phase_law.STEP, phase_law.STEP_NANOSECONDS = 1.0, 10**9
        super().__init__()


class NoNewEdge(FixedNeighbours):
    """F3: does not wait for a new neighbour; in ring_six."""

    def on_status(self, status: Any) -> None:
        for name in ("sat4", "sat5", "sat6"):
            status.alive[status.satellites.index(name)] = False
        super().on_status(status)


class Undying(ForeignSatellite):
    """L1: goes on though it is lost."""

    def on_status(self, status: Any) -> None:
        status.alive[1] = status.alive[1] or self.step is not None
        super().on_status(status)


class LateCheckpoint(ForeignSatellite):
    """L2: rejoins with a checkpoint that is later than its loss."""

    def create_publisher(self, kind: Any, *arguments: Any, **options: Any) -> Any:
        made = super().create_publisher(kind, *arguments, **options)
        return _Late(made, self.change) if kind is NodeReady and IS_STARTED_AGAIN else made

    def change(self, message: Any) -> None:
        message.checkpoint = 10**6


class ReadyOnce(ForeignSatellite):
    """L2: is not ready when it is started again."""

    def report_ready(self) -> None:
        if not IS_STARTED_AGAIN:
            super().report_ready()


class TooEarly(ForeignSatellite):
    """L3: answers the first state that it receives, before it has rejoined."""

    def act(self) -> None:
        self.alive = self.rejoined = True
        super().act()


class DropsFirstState(ForeignSatellite):
    """L3: drops the state of the step of its return if it arrives before the status that says so."""

    def on_state(self, state: Any) -> None:
        if self.step is not None or self.status.version >= state.formation_version:
            super().on_state(state)


class Endless(ForeignSatellite):
    """X1: goes on after the end."""

    def on_status(self, status: Any) -> None:
        if status.phase != status.FINISHED:
            super().on_status(status)


class NoFirstPhase(ForeignSatellite):
    """S1: its first phase is that of the second step."""

    def publish(self, publisher: Any, message: Any, step: int) -> None:
        if not (isinstance(message, ArcLength) and step == 0):
            super().publish(publisher, message, step)


class NoPhase(ForeignSatellite):
    """S3: commands, and publishes no phase from step 3 on."""

    def publish(self, publisher: Any, message: Any, step: int) -> None:
        if not (isinstance(message, ArcLength) and step >= 3):
            super().publish(publisher, message, step)


class NoPhaseForRecorder(NoPhase):
    """S3: no phase from step 3 on, in a graph in which only the recorder receives it."""

    def __init__(self) -> None:
        super().__init__()
        self.targets[self.phase] = 1


class Stuck(ForeignSatellite):
    """S2: publishes its last messages again and again, and commands no more from step 3 on."""

    def act(self) -> None:
        if self.step is None or self.step < 3:
            super().act()


if __name__ == "__main__":
    rclpy.init()
    rclpy.spin(globals()[FAULT]())
