"""Who may say and hear what: the adjacency matrix and the nodes' work, as lists of topics and services."""

from dataclasses import dataclass

from satform.scenario import Scenario
from satform_bringup.security import ENCLAVES

OPERATOR = "operator"
"""Enclave of the person who looks in and changes gains: hears everything, says nothing to the flight."""

_PARAMETER_SERVICES = (
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "get_type_description",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
)
"""Which every ROS 2 node offers."""

_EVERYONE_SAYS = ("/parameter_events", "/rosout")
"""What every ROS 2 node publishes."""


@dataclass(frozen=True)
class Access:
    """What one node may do; everything else is denied.

    Attributes:
        node: its name.
        publishes: names of topics.
        subscribes: names of topics.
        replies: names of services that it offers.
        requests: names of services that it may call.
    """

    node: str
    publishes: tuple[str, ...]
    subscribes: tuple[str, ...]
    replies: tuple[str, ...] = ()
    requests: tuple[str, ...] = ()

    @property
    def enclave(self) -> str:
        """Path of the node's enclave, which is also the common name of its certificate."""
        return f"{ENCLAVES}/{self.node}"


def accesses(scenario: Scenario) -> list[Access]:
    """What each node of a formation needs, and no more.

    Args:
        scenario: what is flown.

    Returns:
        Plant, satellites in their order, recorder, operator.
    """
    satellites = [_satellite(scenario, index) for index in range(len(scenario.satellites))]
    flying = [_plant(scenario), *satellites, _recorder(scenario)]
    return [*flying, _operator(flying)]


def _plant(scenario: Scenario) -> Access:
    from satform_nodes import services, topics  # noqa: PLC0415 - needs ROS
    from satform_nodes.diagnostics import DIAGNOSTICS  # noqa: PLC0415

    told = [topic for index in range(len(scenario.satellites)) for topic in _told(scenario, index)]
    shown = [topic for index in range(len(scenario.satellites)) for topic in _shown(scenario, index)]
    commands = [topics.command(satellite.name) for satellite in scenario.satellites]
    says = (topics.CLOCK, topics.STATUS, DIAGNOSTICS, *told, *shown)
    offers = (services.PAUSE, services.RESUME, services.STEP, services.STOP, services.SET_GRAPH)
    return _node("plant", says, (topics.READY, topics.RECORDED, *commands), offers)


def _satellite(scenario: Scenario, index: int) -> Access:
    from satform_nodes import topics  # noqa: PLC0415 - needs ROS
    from satform_nodes.diagnostics import DIAGNOSTICS  # noqa: PLC0415

    name = scenario.satellites[index].name
    announced = getattr(topics, scenario.consensus.announces)
    neighbours = scenario.possible_graph().neighbours(index)
    hears = [announced(scenario.satellites[neighbour].name) for neighbour in neighbours]
    says = (*_said(scenario, name), topics.READY, DIAGNOSTICS)
    return _node(name, says, (*_told(scenario, index), topics.STATUS, *hears))


def _recorder(scenario: Scenario) -> Access:
    from satform_nodes import topics  # noqa: PLC0415 - needs ROS
    from satform_nodes.diagnostics import DIAGNOSTICS  # noqa: PLC0415

    hears = [topics.CLOCK, topics.STATUS, DIAGNOSTICS]
    for index, satellite in enumerate(scenario.satellites):
        hears += [*_told(scenario, index), *_shown(scenario, index), *_said(scenario, satellite.name)]
    return _node("recorder", (topics.READY, topics.RECORDED, DIAGNOSTICS), tuple(hears))


def _operator(flying: list[Access]) -> Access:
    said = {topic for access in flying for topic in access.publishes}
    served = {service for access in flying for service in access.replies}
    return Access(OPERATOR, _EVERYONE_SAYS, tuple(sorted(said)), (), tuple(sorted(served)))


def _node(
    name: str, publishes: tuple[str, ...], subscribes: tuple[str, ...], offers: tuple[str, ...] = ()
) -> Access:
    replies = sorted({*offers, *(f"/{name}/{service}" for service in _PARAMETER_SERVICES)})
    said = sorted({*publishes, *_EVERYONE_SAYS})
    return Access(name, tuple(said), tuple(sorted({*subscribes})), tuple(replies))


def _told(scenario: Scenario, index: int) -> list[str]:
    """What the plant tells one satellite."""
    from satform_nodes import topics  # noqa: PLC0415 - needs ROS

    spec = scenario.satellite(index)
    turned = [topics.attitude(spec.name)] if spec.attitude is not None else []
    return [topics.state(spec.name), *turned]


def _shown(scenario: Scenario, index: int) -> list[str]:
    """What the plant shows of one satellite to the recorder, and not to the satellite."""
    from satform_nodes import topics  # noqa: PLC0415 - needs ROS

    spec = scenario.satellite(index)
    truth = [topics.truth(spec.name)] if spec.sensor is not None else []
    propulsion = [topics.propulsion(spec.name)] if spec.thruster is not None else []
    return [*truth, *propulsion]


def _said(scenario: Scenario, name: str) -> list[str]:
    """What a satellite says."""
    from satform_nodes import topics  # noqa: PLC0415 - needs ROS

    announced = getattr(topics, scenario.consensus.announces)
    return [announced(name), topics.command(name), topics.tracking(name), topics.parameter_changes(name)]
