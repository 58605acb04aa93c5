# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Profile of a lockstep flight: joins the traces of its processes, prints and draws the parts of a step."""

from pathlib import Path

from satform_tools import console
from satform_tools.errors import CommandError, sentence_of
from satform_tools.report import trace
from satform_tools.run import output_folders


def write(run: Path) -> None:
    """Write `trace.json` and, where the parts of a step can be separated, print them and draw `trace.png`.

    Args:
        run: folder of the run, with the trace of each process in it.

    Raises:
        CommandError: a file cannot be read or written.
    """
    try:
        _write(run)
    except OSError as error:
        raise CommandError(f"the profile cannot be written: {sentence_of(error)}") from None


def _write(run: Path) -> None:
    spans = trace.spans(run / output_folders.TRACE)
    trace.write(spans, run / trace.FILE)
    parts = trace.parts(spans)
    if not parts:
        console.note(
            f"{run / trace.FILE} opens in ui.perfetto.dev; the parts of a step are printed only if every "
            "satellite has a process of its own and sent each command once"
        )
        return
    from satform_tools.report.plots import trace as trace_plot  # noqa: PLC0415 - slow to import

    trace_plot.draw(spans, run / trace_plot.FILE)
    for part in parts:
        console.note(f"{1e6 * part.seconds:8.0f} us  {part.name}")
    total = sum(part.seconds for part in parts)
    console.note(
        f"{1e6 * total:8.0f} us  whole step, median; {run / trace.FILE} opens in ui.perfetto.dev, "
        f"and {trace_plot.FILE} beside it shows a few steps"
    )
