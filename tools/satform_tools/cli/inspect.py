"""The commands that look into a running formation: topics, echo, nodes, params, call, watch."""

# ruff: noqa: PLC0415

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE

if TYPE_CHECKING:
    from satform_tools.inspect.observer_node import Looker

_WHICH = (
    "The formation is the one that is under way on this machine; where there are several, or it flies "
    "elsewhere, --domain or ROS_DOMAIN_ID say which."
)

Domain = Annotated[
    int | None,
    typer.Option(
        min=0,
        max=232,
        metavar="N",
        help="DDS domain; by default ROS_DOMAIN_ID, else that of the only run here.",
    ),
]
Wait = Annotated[
    float, typer.Option(min=0.1, metavar="SECONDS", help="How long to wait for what is looked for.")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines.")]
Topic = Annotated[str, typer.Argument(metavar="TOPIC", help="Name of a topic, e.g. /sat1/state.")]
NodeName = Annotated[str, typer.Argument(metavar="NODE", help="Name of a node, e.g. /sat1.")]
ParameterName = Annotated[
    str, typer.Argument(metavar="NAME", help="Name of a parameter, e.g. controller.switching_gain.")
]

Namespace = Annotated[
    str | None,
    typer.Option(
        metavar="NAME", help="Namespace of the formation, / for the root; by default that of the only one."
    ),
]

_PATIENCE = 10.0

topics = typer.Typer(help=f"Topics of a running formation. {_WHICH}", invoke_without_command=True)
nodes = typer.Typer(help=f"Nodes of a running formation. {_WHICH}", invoke_without_command=True)
params = typer.Typer(help=f"Parameters of a running formation's nodes. {_WHICH}", no_args_is_help=True)


def add_to(app: typer.Typer) -> None:
    """Add these commands to the program's."""
    app.add_typer(topics, name="topics")
    app.add_typer(nodes, name="nodes")
    app.add_typer(params, name="params")
    app.command(help=f"Print what is said on a topic. {_WHICH}")(echo)
    app.command(help=f"Call a service. {_WHICH}")(call)
    app.command(help=f"Watch a formation fly. {_WHICH}")(watch)


@contextmanager
def _looking(domain: int | None, namespace: str | None, wait: float) -> Iterator["Looker"]:
    from satform_tools.cli import names
    from satform_tools.run import ros

    ros.require()
    from satform_tools.inspect import observer_node, target_domain

    space = None if namespace is None else names.namespace(namespace)
    with observer_node.looking(target_domain.domain(domain), wait, space) as found:
        try:
            yield found
        except BrokenPipeError:
            # Whoever read this has seen enough; nothing more may be written on the way out.
            sys.stdout = None
            raise typer.Exit(EXIT_DONE) from None


@topics.callback()
def list_topics(
    context: typer.Context,
    domain: Domain = None,
    namespace: Namespace = None,
    wait: Wait = _PATIENCE,
    json: Json = False,
) -> None:
    """List topics, with their types and how many publish and subscribe."""
    if context.invoked_subcommand:
        return
    with _looking(domain, namespace, wait) as observer_node:
        from satform_tools.inspect import graph

        graph.list_topics(observer_node, as_json=json)


@topics.command("info")
def topic_info(
    topic: Topic,
    domain: Domain = None,
    namespace: Namespace = None,
    wait: Wait = _PATIENCE,
    json: Json = False,
) -> None:
    """Show who publishes and who subscribes, and with which quality of service."""
    with _looking(domain, namespace, wait) as observer_node:
        from satform_tools.inspect import graph

        graph.topic_info(observer_node, topic, as_json=json)


@topics.command("hz")
def topic_rate(
    topic: Topic,
    count: Annotated[int, typer.Option(min=0, help="Lines after which to end; 0 to go on.")] = 0,
    domain: Domain = None,
    namespace: Namespace = None,
    wait: Wait = _PATIENCE,
    json: Json = False,
) -> None:
    """Print once a second how often something is said."""
    with _looking(domain, namespace, wait) as observer_node:
        from satform_tools.inspect import echo as topic_echo

        topic_echo.rate(observer_node, topic, count=count, as_json=json)


def echo(
    topic: Topic,
    once: Annotated[bool, typer.Option("--once", help="End after the first message.")] = False,
    field: Annotated[
        str, typer.Option(metavar="A.B", help="Only this part of the message, e.g. position.x or alive[0].")
    ] = "",
    csv: Annotated[bool, typer.Option("--csv", help="A line for each message, after one of names.")] = False,
    domain: Domain = None,
    namespace: Namespace = None,
    wait: Wait = _PATIENCE,
    json: Json = False,
) -> None:
    """Print what is said on a topic."""
    if csv and json:
        raise typer.BadParameter("--csv and --json exclude each other")
    with _looking(domain, namespace, wait) as observer_node:
        from satform_tools.inspect import echo as topic_echo

        form = "csv" if csv else "json" if json else "yaml"
        topic_echo.echo(observer_node, topic, once=once, field=field, form=form)


@nodes.callback()
def list_nodes(
    context: typer.Context,
    domain: Domain = None,
    namespace: Namespace = None,
    wait: Wait = _PATIENCE,
    json: Json = False,
) -> None:
    """List nodes."""
    if context.invoked_subcommand:
        return
    with _looking(domain, namespace, wait) as observer_node:
        from satform_tools.inspect import graph

        graph.list_nodes(observer_node, as_json=json)


@nodes.command("info")
def node_info(
    node: NodeName,
    domain: Domain = None,
    namespace: Namespace = None,
    wait: Wait = _PATIENCE,
    json: Json = False,
) -> None:
    """Show what a node publishes, what it subscribes to, and its services."""
    with _looking(domain, namespace, wait) as observer_node:
        from satform_tools.inspect import graph

        graph.node_info(observer_node, node, as_json=json)


@params.command("list")
def list_parameters(
    node: NodeName,
    domain: Domain = None,
    namespace: Namespace = None,
    wait: Wait = _PATIENCE,
    json: Json = False,
) -> None:
    """List the parameters of a node with their values."""
    with _looking(domain, namespace, wait) as observer_node:
        from satform_tools.inspect import parameters as node_parameters

        node_parameters.list_all(observer_node, node, as_json=json)


@params.command("get")
def get_parameter(
    node: NodeName,
    name: ParameterName,
    domain: Domain = None,
    namespace: Namespace = None,
    wait: Wait = _PATIENCE,
    json: Json = False,
) -> None:
    """Print the value of a parameter."""
    with _looking(domain, namespace, wait) as observer_node:
        from satform_tools.inspect import parameters as node_parameters

        node_parameters.get(observer_node, node, name, as_json=json)


@params.command("describe")
def describe_parameter(
    node: NodeName,
    name: ParameterName,
    domain: Domain = None,
    namespace: Namespace = None,
    wait: Wait = _PATIENCE,
    json: Json = False,
) -> None:
    """Show type, meaning, bounds and value of a parameter."""
    with _looking(domain, namespace, wait) as observer_node:
        from satform_tools.inspect import parameters as node_parameters

        node_parameters.describe(observer_node, node, name, as_json=json)


@params.command("set", context_settings={"ignore_unknown_options": True})
def set_parameter(
    node: NodeName,
    name: ParameterName,
    value: Annotated[str, typer.Argument(metavar="VALUE", help="As YAML, e.g. '[0.2, 0.2, 0.2]'.")],
    domain: Domain = None,
    namespace: Namespace = None,
    wait: Wait = _PATIENCE,
    json: Json = False,
) -> None:
    """Change a parameter in flight; the node says from which step on it counts."""
    with _looking(domain, namespace, wait) as observer_node:
        from satform_tools.inspect import parameters as node_parameters

        taken = node_parameters.change(observer_node, node, name, value, as_json=json)
    raise typer.Exit(0 if taken else EXIT_BAD_INPUT)


def call(
    service: Annotated[str, typer.Argument(metavar="SERVICE", help="Name of a service.")],
    request: Annotated[
        str, typer.Argument(metavar="[YAML]", help="Fields of the request, e.g. '{names: [scenario]}'.")
    ] = "",
    domain: Domain = None,
    namespace: Namespace = None,
    wait: Wait = _PATIENCE,
    json: Json = False,
) -> None:
    """Call a service of a running formation."""
    with _looking(domain, namespace, wait) as observer_node:
        from satform_tools.inspect import service_call

        service_call.call(observer_node, service, request, as_json=json)


def watch(
    once: Annotated[bool, typer.Option("--once", help="Print one frame and end.")] = False,
    domain: Domain = None,
    namespace: Namespace = None,
    wait: Wait = _PATIENCE,
    json: Json = False,
) -> None:
    """Watch a formation fly until it has ended, or Ctrl-C."""
    with _looking(domain, namespace, wait) as observer_node:
        from satform_tools.inspect import watch as watch_command

        code = watch_command.watch(observer_node, once=once, as_json=json)
    raise typer.Exit(code)
