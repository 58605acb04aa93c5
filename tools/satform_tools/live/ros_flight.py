# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight under way as the live page shows it, from the newest message of each of its topics.

It is an observer: best effort and newest only, so that no node of the flight waits for it.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
from rcl_interfaces.srv import GetParameters
from satform_msgs.msg import Attitude, FormationStatus, LinkConditions, Propulsion

from satform.communication.topic_table import PLANT, topic_name
from satform.display.shapes import attitude_in_lvlh
from satform.flight.compile import scene_plan
from satform.numeric.elementwise import Array
from satform.scenario import Scenario, ScenarioError, load_scenario
from satform.scenario.loader import SCENARIO_FILE
from satform_tools.errors import CommandError
from satform_tools.inspect import target_domain
from satform_tools.inspect.monitor import FormationMonitor
from satform_tools.inspect.observer_node import Observer
from satform_tools.inspect.service_call import ask
from satform_tools.inspect.snapshot import Frame
from satform_tools.live.formation import FormationView
from satform_tools.live.history import History, Recent, rows_for
from satform_tools.live.link_losses import LinkLosses
from satform_tools.live.stored_flight import ALIVE, LOST, STALE, columns

_MOST_EVENTS = 500
_MOST_GRAPHS = 2000


class RosFlight:
    """A formation that flies in the observer's domain.

    Attributes:
        monitor: takes its messages.
        scenario: that is flown; None where its file cannot be read here.
    """

    period = 0.1

    def __init__(self, observer: Observer) -> None:
        """Find the formation and subscribe.

        Raises:
            CommandError: no formation flies here.
        """
        self.monitor = FormationMonitor(observer)
        status = self.monitor.status
        self._names = tuple(str(name) for name in status.satellites)
        self.scenario = _scenario(observer, self._names)
        self._view = None if self.scenario is None else FormationView(self.scenario)
        self._edges = _present_edges(status) if self._view is None else self._view.edges
        self._edge_index = {edge: index for index, edge in enumerate(self._edges)}
        self._subscribe()
        shown = columns(
            len(self._names),
            len(self._edges),
            attitudes=bool(self._attitudes),
            losses=bool(self._conditions) or self._drawn is not None,
        )
        self.history = History(shown, rows_for(len(self._names)))
        self.events = Recent(_MOST_EVENTS)
        self.graphs = Recent(_MOST_GRAPHS)
        self._version: int | None = None
        self._spent = np.zeros(len(self._names))
        self.monitor.update()
        self._frame = self.monitor.frame()

    def formation(self) -> dict[str, Any]:
        """What does not change during the flight."""
        known = (
            _without_scenario(self._names, self._frame) if self._view is None else self._view.description()
        )
        approximate = (
            "approximate: sum of the commands that were received" if self._any_without_thruster else ""
        )
        return {
            **known,
            "edges": self._edges,
            "subtitle": f"{self._frame.title}; positions are the satellites' own estimates",
            "delta_v_note": approximate,
        }

    def status(self) -> dict[str, Any]:
        """Phase, step, time and speed."""
        frame = self._frame
        rate = frame.steps_per_second
        return {
            "phase": frame.phase,
            "step": frame.step,
            "time": frame.time,
            "steps_per_second": None if math.isnan(rate) or self.monitor.over else round(rate, 2),
            "over": self.monitor.over,
        }

    def update(self) -> None:
        """Take the newest messages."""
        if self.monitor.over and self._version is not None:
            return
        self.monitor.update()
        before, self._frame = self._frame, self.monitor.frame()
        self._note_graph()
        while self.monitor.events:
            self.events.append({"time": self._frame.time, "text": self.monitor.events.popleft()})
        if self._frame.time > self.history.last_time and self.monitor.is_complete():
            self._add_row(max(0.0, self._frame.time - before.time))

    def _subscribe(self) -> None:
        newest = self.monitor.newest
        scenario = self.scenario
        specs = [] if scenario is None else [scenario.satellite(index) for index in range(len(self._names))]
        self._attitude_orbits = (
            [None] * len(self._names) if scenario is None else scene_plan(scenario).attitude_orbits
        )
        self._attitudes = {
            index: newest(Attitude, topic_name("attitude", self._names[index]))
            for index, orbit in enumerate(self._attitude_orbits)
            if orbit is not None
        }
        self._propulsion = {
            index: newest(Propulsion, topic_name("propulsion", self._names[index]))
            for index, spec in enumerate(specs)
            if spec.thruster is not None
        }
        self._any_without_thruster = len(self._propulsion) < len(self._names)
        links = None if scenario is None else scenario.links
        physical = links is not None and links.physical
        self._drawn = None
        if scenario is not None and links is not None and not physical and self._edges:
            self._drawn = LinkLosses(scenario, self._edges)
        self._conditions = {
            index: newest(LinkConditions, topic_name("link_conditions", name))
            for index, name in enumerate(self._names if physical else ())
        }

    def _note_graph(self) -> None:
        status = self.monitor.status
        if status.version == self._version:
            return
        self._version = status.version
        self.graphs.append(
            {
                "time": self._frame.time if self.graphs.count else 0.0,
                "alive": [bool(alive) for alive in status.alive],
                "pairs": [list(edge) for edge in _present_edges(status)],
                "connectivity": float(status.algebraic_connectivity),
            }
        )

    def _add_row(self, passed: float) -> None:
        frame = self._frame
        control = np.array([entry.command for entry in frame.satellites])
        self._spent += np.nan_to_num(control) * passed
        spent = self._spent.copy()
        for index, latest in self._propulsion.items():
            latest.update()
            if latest.message is not None:
                spent[index] = latest.message.delta_v
        chief = None if self._view is None else self._view.chief(np.array([frame.time]))[0]
        health = [STALE if entry.stale else ALIVE if entry.alive else LOST for entry in frame.satellites]
        values: dict[str, Any] = {
            "position": [entry.position for entry in frame.satellites],
            "attitude": self._turned() if self._attitudes else None,
            "error": [entry.error for entry in frame.satellites],
            "control": control,
            "delta_v": spent,
            "health": health,
            "age": self._ages(frame),
            "loss": self._losses() if self._conditions else None,
            **self._drawn_links(frame),
            "spread": [frame.spread],
            "connectivity": [frame.connectivity],
            "chief": chief,
        }
        self.history.append(frame.time, {name: value for name, value in values.items() if value is not None})

    def _turned(self) -> Array:
        found: Array = np.full((len(self._names), 4), np.nan)
        for index, latest in self._attitudes.items():
            latest.update()
            orbit, message = self._attitude_orbits[index], latest.message
            if message is not None and orbit is not None:
                mrp = np.array([message.mrp.x, message.mrp.y, message.mrp.z])
                stamp = message.header.stamp
                found[index] = attitude_in_lvlh(mrp, orbit, stamp.sec + 1e-9 * stamp.nanosec)
        return found

    def _ages(self, frame: Frame) -> Array:
        found: Array = np.full(len(self._edges), np.nan)
        numbers = {name: index for index, name in enumerate(self._names)}
        for link in frame.links:
            index = self._edge_index.get((numbers[link.receiver], numbers[link.sender]))
            if index is not None:
                found[index] = link.age
        return found

    def _drawn_links(self, frame: Frame) -> dict[str, Array]:
        """Age and loss by the random numbers of links, where messages are lost by them."""
        if self._drawn is None:
            return {}
        age, loss = self._drawn.at(frame.step)
        # A satellite that sends no more is older than its last message by the links.
        return {"age": np.fmax(age, self._ages(frame)), "loss": loss}

    def _losses(self) -> Array:
        found: Array = np.full(len(self._edges), np.nan)
        for receiver, latest in self._conditions.items():
            latest.update()
            for sender, loss in enumerate(() if latest.message is None else latest.message.loss):
                index = self._edge_index.get((receiver, sender))
                if index is not None:
                    found[index] = loss
        return found


def _present_edges(status: FormationStatus) -> list[tuple[int, int]]:
    """Receiver and sender of each edge of the graph in force."""
    pairs = zip(status.edge_receivers, status.edge_senders, strict=True)
    return [(int(receiver), int(sender)) for receiver, sender in pairs]


def _scenario(observer: Observer, names: tuple[str, ...]) -> Scenario | None:
    """What is flown, from the folder of a run on this machine or from the file that the plant was given."""
    folders = [Path(run.folder) for run in target_domain.runs_here() if run.domain == observer.domain]
    files = [folder / SCENARIO_FILE for folder in folders]
    if len(files) != 1:
        files = [*_file_of_plant(observer)]
    for file in files:
        try:
            scenario = load_scenario(file, recorded=True)
        except (OSError, ScenarioError):
            continue  # of another machine: the page then has no orbits
        if tuple(satellite.name for satellite in scenario.satellites) == names:
            return scenario
    return None


def _file_of_plant(observer: Observer) -> list[Path]:
    request = GetParameters.Request(names=["scenario"])
    service = observer.full_name(f"/{PLANT}/get_parameters")
    try:
        (value,) = ask(observer, GetParameters, service, request).values
    except CommandError:
        return []  # parameter services are off in very large flights
    return [Path(value.string_value)] if value.string_value else []


def _without_scenario(names: tuple[str, ...], frame: Frame) -> dict[str, Any]:
    """What is known of a formation whose scenario cannot be read here."""
    step = frame.time / frame.step if frame.step else 1.0
    count = len(names)
    return {
        "name": "formation",
        "title": frame.title,
        "names": list(names),
        "step": step,
        "last_step": frame.last_step,
        "period": 0.0,
        "orbits": [None] * count,
        "boresights": [None] * count,
        "chief_orbit": None,
        "chief_note": "The scenario cannot be read on this machine.",
        "earth_angle": 0.0,
        "earth_rate": 0.0,
        "agrees": not math.isnan(frame.spread),
        "theory": None,
    }
