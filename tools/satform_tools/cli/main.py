# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The program `satform`: all commands, and what an error means for its exit code.

Each command imports what it needs itself, so that none waits for the imports of another.
"""

# ruff: noqa: PLC0415

import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE, EXIT_STOPPED
from satform_nodes.runtime.signals import interrupting
from satform_tools import console, output_streams
from satform_tools.cli import bench, campaign, inspect, plan, run, scenarios
from satform_tools.cli.renamed_options import RootGroup
from satform_tools.cli.shared_options import Json
from satform_tools.errors import CommandError, error_sentences, sentence_of

app = typer.Typer(
    name="satform",
    cls=RootGroup,
    help=f"Simulate, evaluate and report satellite formations. {run.EPILOG}",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich" if console.is_terminal(sys.stdout) else None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
run.add_to(app)
scenarios.add_to(app)
inspect.add_to(app)
app.add_typer(campaign.app, name="campaign")
app.add_typer(plan.app, name="plan")
app.add_typer(bench.app, name="bench")


@app.command(
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}
)
def test(context: typer.Context) -> None:
    """Check the code and run all tests, or run pytest on given files."""
    from satform_tools import run_tests
    from satform_tools.run import shipped_files

    shipped_files.require_checkout("tests are run")
    raise typer.Exit(run_tests.run(context.args))


@app.command()
def docs(
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the site; by default `site` in the project's folder."),
    ] = None,
) -> None:
    """Build the documentation as a site that needs no network.

    Broken links are errors.
    """
    from satform_tools.docs import build
    from satform_tools.run import shipped_files

    shipped_files.require_checkout("the documentation is built")
    build.build(out)


@app.command()
def wheels(
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder of the wheels; by default `wheels`.")
    ] = Path("wheels"),
    dependencies: Annotated[
        bool,
        typer.Option(
            "--dependencies",
            help="Also fetch the wheels of all that they require, for machines without network.",
        ),
    ] = False,
) -> None:
    """Build the wheels satform and satform-ros.

    `pip install --find-links DIR satform-ros` then gives a `satform` that flies, without a compiler.
    """
    from satform_tools.wheels import build

    for wheel in build.build(out, dependencies=dependencies):
        console.line(str(wheel))


@app.command()
def version(json: Json = False) -> None:
    """Print the versions of satform, its dependencies and ROS 2."""
    from satform_tools.run.versions import versions

    found = versions()
    if json:
        console.as_json(found)
    else:
        for name, number in found.items():
            console.line(f"{name} {number}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: after the program's name; those of this process when left out.

    Returns:
        Exit code.
    """
    output_streams.prepare()
    # A quantity that is not finite ends a flight with a sentence; numpy's warning would only repeat it.
    warnings.filterwarnings("ignore", category=RuntimeWarning)
    code = _run(arguments)
    try:
        output_streams.finish()
    except OSError as error:
        console.error(sentence_of(error))
        return code or EXIT_BAD_INPUT
    return code


def _run(arguments: Sequence[str] | None) -> int:
    """Run the command line; errors are printed as sentences."""
    try:
        with interrupting():
            app(args=None if arguments is None else list(arguments), prog_name="satform")
    except SystemExit as end:
        if type(sys.stdout).__name__ == "PacifyFlushWrapper":
            # The reader of a help page has gone.
            return EXIT_DONE
        return end.code if isinstance(end.code, int) else EXIT_BAD_INPUT
    except KeyboardInterrupt:
        return EXIT_STOPPED
    except Exception as error:
        sentences = error_sentences(error)
        if not sentences:
            # An error of the program itself, which is found by its traceback.
            raise
        for sentence in sentences:
            console.error(sentence)
        return error.exit_code if isinstance(error, CommandError) else EXIT_BAD_INPUT
    return EXIT_DONE
