# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The commands on a running formation: topics, echo, nodes, params, call, reconfigure, watch."""

# ruff: noqa: PLC0415

import inspect
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any

import typer

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE
from satform_tools.cli.shared_options import Bind, Control, Foxglove, Json, Port, page_options
from satform_tools.errors import CommandError
from satform_tools.run.page_options import LOOPBACK

if TYPE_CHECKING:
    from satform_tools.inspect.observer_node import Observer

_SELECTION = (
    "Uses the only formation that runs on this machine. If several run, or one on another machine, select it "
    "by --domain or ROS_DOMAIN_ID."
)

Topic = Annotated[str, typer.Argument(metavar="TOPIC", help="Name of a topic, e.g. /sat1/state.")]
NodeName = Annotated[str, typer.Argument(metavar="NODE", help="Name of a node, e.g. /sat1.")]
ParameterName = Annotated[
    str, typer.Argument(metavar="NAME", help="Name of a parameter, e.g. controller.switching_gain.")
]

topics = typer.Typer(
    help=f"List the topics of a running formation. {_SELECTION}", invoke_without_command=True
)
nodes = typer.Typer(help=f"List the nodes of a running formation. {_SELECTION}", invoke_without_command=True)
params = typer.Typer(
    help=f"Read and set parameters of a running formation's nodes. {_SELECTION}", no_args_is_help=True
)


def add_to(app: typer.Typer) -> None:
    """Add these commands to the program's."""
    app.add_typer(topics, name="topics")
    app.add_typer(nodes, name="nodes")
    app.add_typer(params, name="params")
    app.command(help=f"Print the messages of a topic. {_SELECTION}")(echo)
    app.command(help=f"Call a service. {_SELECTION}")(call)
    app.command(help=f"Give satellites new targets in flight, with progress. {_SELECTION}")(reconfigure)
    app.command(help=f"Show the state of a running formation until its flight ends. {_SELECTION}")(watch)


def _observer_options(
    context: typer.Context,
    domain: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=232,
            metavar="N",
            help="DDS domain; by default that of ROS_DOMAIN_ID, else that of the only run on this machine.",
        ),
    ] = None,
    namespace: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Namespace of the formation, / for the root; by default that of the only formation.",
        ),
    ] = None,
    timeout: Annotated[
        float,
        typer.Option(
            min=0.1,
            metavar="SECONDS",
            help="Longest wall-clock time to wait for the topic, node, service or message, s.",
        ),
    ] = 10.0,
    json: Json = False,
) -> None:
    """The options of every command that takes an observer node."""


def _observing(command: Callable[..., int | None]) -> Callable[..., None]:
    """Give a command the options of an observer node, and call it with the node.

    Args:
        command: takes the observer node, its own arguments, and `as_json`; may return an exit code.

    Returns:
        The command as Typer takes it: its own arguments and the options in its signature.
    """
    own = [
        parameter
        for name, parameter in inspect.signature(command).parameters.items()
        if name not in ("observer", "as_json")
    ]
    options = list(inspect.signature(_observer_options).parameters.values())
    keyword = inspect.Parameter.KEYWORD_ONLY

    def observing(**arguments: Any) -> None:
        asked = {option.name: arguments.pop(option.name) for option in options}
        if asked["context"].invoked_subcommand:
            # The callback of a group, before one of its commands.
            return
        if asked["json"] and arguments.get("csv"):
            raise typer.BadParameter("--csv and --json exclude each other")
        with _observer(asked["domain"], asked["namespace"], asked["timeout"]) as observer:
            code = command(observer, **arguments, as_json=asked["json"])
        if code is not None:
            raise typer.Exit(code)

    observing.__name__ = command.__name__
    observing.__doc__ = command.__doc__
    parameters = [parameter.replace(kind=keyword) for parameter in (*own, *options)]
    observing.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    observing.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return observing


@contextmanager
def _observer(domain: int | None, namespace: str | None, timeout: float) -> Iterator["Observer"]:
    from satform_tools.cli import names
    from satform_tools.run import ros_packages

    ros_packages.require()
    from satform_tools.inspect import observer_node, target_domain

    space = None if namespace is None else names.namespace(namespace)
    with observer_node.observe(target_domain.domain(domain), timeout, space) as found:
        try:
            yield found
        except BrokenPipeError:
            # The reader of the output has gone; nothing more may be written on the way out.
            sys.stdout = None
            raise typer.Exit(EXIT_DONE) from None


@topics.callback()
@_observing
def list_topics(observer: "Observer", *, as_json: bool) -> None:
    """List topics with their types and numbers of publishers and subscriptions."""
    from satform_tools.inspect import graph

    graph.list_topics(observer, as_json=as_json)


@topics.command("info")
@_observing
def topic_info(observer: "Observer", topic: Topic, *, as_json: bool) -> None:
    """Show publishers and subscriptions of a topic with their QoS."""
    from satform_tools.inspect import graph

    graph.topic_info(observer, topic, as_json=as_json)


@topics.command("hz")
@_observing
def topic_rate(
    observer: "Observer",
    topic: Topic,
    count: Annotated[
        int, typer.Option(min=0, help="Number of lines to print before the command ends; 0 for no limit.")
    ] = 0,
    *,
    as_json: bool,
) -> None:
    """Print the message rate of a topic once a second."""
    from satform_tools.inspect import echo as topic_echo

    topic_echo.rate(observer, topic, count=count, as_json=as_json)


@_observing
def echo(
    observer: "Observer",
    topic: Topic,
    once: Annotated[bool, typer.Option("--once", help="End after the first message.")] = False,
    field: Annotated[
        str,
        typer.Option(
            metavar="A.B", help="Print only this field of the message, e.g. position.x or alive[0]."
        ),
    ] = "",
    csv: Annotated[
        bool,
        typer.Option(
            "--csv", help="Print CSV: a line with the names of the fields, then a line for each message."
        ),
    ] = False,
    *,
    as_json: bool,
) -> None:
    """Print the messages of a topic."""
    from satform_tools.inspect import echo as topic_echo

    form = "csv" if csv else "json" if as_json else "yaml"
    topic_echo.echo(observer, topic, once=once, field=field, form=form)


@nodes.callback()
@_observing
def list_nodes(observer: "Observer", *, as_json: bool) -> None:
    """List nodes."""
    from satform_tools.inspect import graph

    graph.list_nodes(observer, as_json=as_json)


@nodes.command("info")
@_observing
def node_info(observer: "Observer", node: NodeName, *, as_json: bool) -> None:
    """Show publishers, subscriptions and services of a node."""
    from satform_tools.inspect import graph

    graph.node_info(observer, node, as_json=as_json)


@params.command("list")
@_observing
def list_parameters(observer: "Observer", node: NodeName, *, as_json: bool) -> None:
    """List the parameters of a node with their values."""
    from satform_tools.inspect import parameters

    parameters.list_all(observer, node, as_json=as_json)


@params.command("get")
@_observing
def get_parameter(observer: "Observer", node: NodeName, name: ParameterName, *, as_json: bool) -> None:
    """Print the value of a parameter."""
    from satform_tools.inspect import parameters

    parameters.get(observer, node, name, as_json=as_json)


@params.command("describe")
@_observing
def describe_parameter(observer: "Observer", node: NodeName, name: ParameterName, *, as_json: bool) -> None:
    """Show type, meaning, bounds and value of a parameter."""
    from satform_tools.inspect import parameters

    parameters.describe(observer, node, name, as_json=as_json)


@params.command("set", context_settings={"ignore_unknown_options": True})
@_observing
def set_parameter(
    observer: "Observer",
    node: NodeName,
    name: ParameterName,
    value: Annotated[str, typer.Argument(metavar="VALUE", help="New value as YAML, e.g. '[0.2, 0.2, 0.2]'.")],
    *,
    as_json: bool,
) -> int:
    """Set a parameter and print the step at which it takes effect."""
    from satform_tools.inspect import parameters

    accepted = parameters.change(observer, node, name, value, as_json=as_json)
    return EXIT_DONE if accepted else EXIT_BAD_INPUT


@_observing
def call(
    observer: "Observer",
    service: Annotated[str, typer.Argument(metavar="SERVICE", help="Name of a service.")],
    request: Annotated[
        str,
        typer.Argument(metavar="[YAML]", help="Fields of the request as YAML, e.g. '{names: [scenario]}'."),
    ] = "",
    *,
    as_json: bool,
) -> None:
    """Call a service of a running formation."""
    from satform_tools.inspect import service_call

    service_call.call(observer, service, request, as_json=as_json)


@_observing
def reconfigure(
    observer: "Observer",
    targets: Annotated[
        list[str],
        typer.Argument(
            metavar="SATELLITE=TARGET...",
            help="New target of each satellite with the fields of a scenario's targets, e.g. "
            "'sat1={curve: {kind: circle, radius: 100.0}}'.",
        ),
    ],
    tolerance: Annotated[
        float, typer.Option(metavar="M", help="Distance within which a satellite has reached its target, m.")
    ] = 1.0,
    hold: Annotated[
        float,
        typer.Option(metavar="SECONDS", help="Simulated time for which all have to stay within it, s."),
    ] = 0.0,
    within: Annotated[
        float,
        typer.Option(
            metavar="SECONDS", help="Simulated time after which the command gives up, s; 0 for no limit."
        ),
    ] = 0.0,
    *,
    as_json: bool,
) -> int:
    """Give satellites new targets, and follow them there; Ctrl-C gives the former targets back."""
    from satform_tools.inspect import reconfigure as reconfigure_command

    arrival = reconfigure_command.Arrival(tolerance, hold, within)
    return reconfigure_command.reconfigure(observer, targets, arrival, as_json=as_json)


@_observing
def watch(
    observer: "Observer",
    once: Annotated[bool, typer.Option("--once", help="Print one frame and end.")] = False,
    browser: Annotated[
        bool,
        typer.Option("--browser", help="Serve a page for browsers instead, and print its address."),
    ] = False,
    control: Control = False,
    port: Port = 0,
    bind: Bind = LOOPBACK,
    foxglove: Foxglove = False,
    *,
    as_json: bool,
) -> int:
    """Show the state of a running formation until its flight ends, or Ctrl-C."""
    page = page_options(
        "--browser", enabled=browser, control=control, port=port, bind=bind, foxglove=foxglove
    )
    if page is not None:
        if once or as_json:
            raise CommandError("--browser and --foxglove exclude --once and --json, which are for text")
        if page.foxglove:
            from satform_tools.inspect import foxglove_server

            return foxglove_server.serve(observer, page)
        from satform_tools.live import watched

        return watched.watch(observer, page)
    from satform_tools.inspect import watch as watch_command

    return watch_command.watch(observer, once=once, as_json=as_json)
