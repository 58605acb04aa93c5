# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Starts a campaign in a new folder or resumes one, and flies the cases that have no result."""

import os
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from satform.campaign import folder_repair
from satform.campaign.cases import case_values
from satform.campaign.chunk import fly_chunk
from satform.campaign.dask_engine import DaskEngine
from satform.campaign.engine import ChunkScheduler, Engine, EngineError, Job, chunk_size
from satform.campaign.folder import RECORDS, CampaignFolder, locked
from satform.campaign.local_engine import LocalEngine
from satform.campaign.manifest import FolderError
from satform.campaign.model import Campaign
from satform.campaign.result_files import ResultFileError
from satform.campaign.result_store import ResultStore
from satform.files.durable_file import write_durably
from satform_nodes.runtime.signals import StopRequest
from satform_tools import console
from satform_tools.campaign import bags, junit, library, progress
from satform_tools.campaign import report as reports
from satform_tools.campaign.report import SUMMARY
from satform_tools.campaign.summary import Speed, Summary, summarise
from satform_tools.errors import CommandError, sentence_of
from satform_tools.report.formats import Format
from satform_tools.run import live_page, output_folders
from satform_tools.run.page_options import PageOptions
from satform_tools.run.scenario_library import SCENARIOS

LOG = "workers.log"
"""What the worker processes of this machine wrote to standard error."""


@dataclass(frozen=True)
class Options:
    """How the cases are flown.

    Attributes:
        workers: processes of this machine; None for as many as it has processors.
        engine: where cases are flown.
        scheduler: address of a dask scheduler.
        timeout: wall-clock time of a case, s; that of the campaign when None.
        junit: file to write as JUnit XML; None for none.
        quiet: whether no progress is shown.
        page: how the page of its progress is served; None for no page.
    """

    workers: int | None = None
    engine: Literal["local", "dask"] = "local"
    scheduler: str | None = None
    timeout: float | None = None
    junit: Path | None = None
    quiet: bool = False
    page: PageOptions | None = None


@dataclass(frozen=True)
class Resumption:
    """What is done before a campaign is resumed.

    Attributes:
        repair: whether damaged files of results are put aside and their cases flown again.
        retry: whether cases that a timeout or the end of a worker process ended are flown again.
        stored: whether the campaign is flown as it was stored, though its file has changed since.
    """

    repair: bool = False
    retry: bool = False
    stored: bool = False


def run(name: str, out: Path | None, options: Options) -> Summary:
    """Fly a campaign in a new folder.

    Args:
        name: of a shipped campaign, or path of a file.
        out: folder, new or empty; None for a new one in `runs`.
        options: how it is flown.

    Raises:
        CommandError: it cannot be started.
        ScenarioError: it cannot be flown.
    """
    _require_fitting(options)
    if library.is_folder(Path(name)):
        raise CommandError(f"{name} is the folder of a campaign: use satform campaign resume {name}")
    campaign, file = library.load(name)
    if out is not None and library.is_folder(out):
        there = library.opened(out).manifest
        raise CommandError(
            f"{out} already holds the campaign {there.name}: go on with satform campaign resume {out}, or "
            "name another folder with --out"
        )
    bags.prepare(campaign)
    path = output_folders.make(out, campaign.name)
    with _storing(path), locked(path):
        folder = CampaignFolder.create(path, campaign, file, datetime.now(UTC).isoformat(timespec="seconds"))
        summary = _flown(folder, campaign, options, Resumption())
    junit.write(summary, options.junit)
    return summary


def resume(target: Path, options: Options, resumption: Resumption) -> Summary:
    """Fly the cases of a campaign that have no result.

    Args:
        target: its folder, or its file, of which the newest folder in `runs` is taken.
        options: how they are flown.
        resumption: what is done before.

    Raises:
        CommandError: it cannot be resumed.
        ScenarioError: its file is none any more.
    """
    _require_fitting(options)
    if library.is_folder(target) or target.is_dir():
        folder = library.opened(target)
    else:
        folder = library.newest_folder(library.find(str(target)), Path.cwd() / "runs")
    try:
        campaign = folder.campaign()
        if not resumption.stored:
            folder.require_source(SCENARIOS)
        folder.require_software()
    except FolderError as error:
        changed = "" if resumption.stored else "; --stored goes on with the copy in the folder"
        is_source = bool(folder.manifest.file) and str(error).startswith(folder.manifest.file)
        raise CommandError(f"{error}{changed if is_source else ''}") from None
    bags.prepare(campaign)
    with _storing(folder.path), locked(folder.path):
        summary = _flown(folder, campaign, options, resumption)
    junit.write(summary, options.junit)
    return summary


def report(
    path: Path, junit_file: Path | None = None, out: Path | None = None, formats: Sequence[Format] = ()
) -> Summary:
    """What came of a campaign so far, with a page for a browser and exports.

    Args:
        path: folder of the campaign.
        junit_file: to write as JUnit XML; None for none.
        out: folder of the report; None for `report` in that of the campaign.
        formats: to be written besides the page.

    Raises:
        CommandError: the folder holds none, its results are damaged, or the report cannot be written.
    """
    folder = library.opened(path)
    try:
        summary = summarise(folder, folder.campaign())
        files = reports.write(summary, out or folder.path / reports.REPORT, formats)
    except (FolderError, ResultFileError) as error:
        raise CommandError(f"{error}{_repair_advice(path, error)}") from None
    except OSError as error:
        raise CommandError(f"the report cannot be written: {sentence_of(error)}") from None
    junit.write(summary, junit_file)
    return replace(summary, files=files)


def _require_fitting(options: Options) -> None:
    """Check that the options can be combined.

    Raises:
        CommandError: they cannot.
    """
    if options.engine == "dask" and options.scheduler is None:
        raise CommandError(
            "--engine dask needs --scheduler ADDRESS; start one with: dask scheduler, and on each machine: "
            "dask worker ADDRESS"
        )
    if options.engine == "dask" and options.workers is not None:
        raise CommandError("--workers is for --engine local; dask has the workers that are started for it")
    if options.engine == "local" and options.scheduler is not None:
        raise CommandError("--scheduler is for --engine dask")


@contextmanager
def _storing(path: Path) -> Iterator[None]:
    """Say in a sentence why a campaign cannot be stored in a folder.

    Raises:
        CommandError: it cannot.
    """
    try:
        yield
    except (FolderError, ResultFileError) as error:
        raise CommandError(f"{error}{_repair_advice(path, error)}") from None
    except OSError as error:
        raise CommandError(f"the campaign cannot be stored: {sentence_of(error)}") from None


def _flown(folder: CampaignFolder, campaign: Campaign, options: Options, resumption: Resumption) -> Summary:
    """Fly what is missing and write the summary; the folder is locked."""
    _prepare(folder, resumption)
    with live_page.beside_campaign(options.page, folder.path) as served:
        summary = _with_bags(_fly(folder, campaign, options, folder.done()))
        with suppress(OSError):
            # A full disk is in the summary already.
            write_durably(folder.path / SUMMARY, f"{console.to_json(summary.data())}\n".encode())
        summary = _with_page(summary)
        if not summary.stopped:
            served.wait()
    return summary


def _with_bags(summary: Summary) -> Summary:
    """Record the bags that the campaign retains, once all cases are flown."""
    if not summary.complete or summary.stopped or summary.reason:
        return summary
    reason, stopped = bags.record(summary.folder, summary.campaign)
    return replace(summary, reason=reason, stopped=stopped)


def _with_page(summary: Summary) -> Summary:
    """Write the page of a campaign that was not stopped; the summary with its path."""
    if summary.stopped or not summary.flown:
        return summary
    try:
        return replace(summary, files=reports.write(summary, summary.folder.path / reports.REPORT))
    except OSError as error:
        console.note(f"the report cannot be written: {sentence_of(error)}")
        return summary


def _prepare(folder: CampaignFolder, resumption: Resumption) -> None:
    if resumption.repair:
        count = folder_repair.repair(folder)
        if count:
            console.note(f"{count} files of results are put aside; their cases are flown again")
    damaged = folder_repair.damaged_files(folder)
    if damaged:
        raise damaged[0]
    folder_repair.clean(folder)
    if resumption.retry:
        count = folder_repair.forget_lost(folder)
        console.note(f"{count} cases that were ended by the machine are flown again")


def _repair_advice(path: Path, error: Exception) -> str:
    if not isinstance(error, ResultFileError):
        return ""
    return f"; satform campaign resume {path} --repair puts it aside and flies its cases again"


def _fly(
    folder: CampaignFolder,
    campaign: Campaign,
    options: Options,
    done: NDArray[np.bool_],
) -> Summary:
    total, before = len(done), int(np.count_nonzero(done))
    if before == total:
        return summarise(folder, campaign)
    workers = options.workers or len(os.sched_getaffinity(0))
    store = ResultStore(folder)
    reason, flown, begun = "", False, time.perf_counter()
    with StopRequest() as request, progress.displayed(campaign.name, quiet=options.quiet) as show:
        scheduler = ChunkScheduler(
            lambda number: case_values(campaign, number),
            store.store,
            lambda count: show(before + count, total),
            lambda: request.asked,
        )
        show(before, total)
        engine: Engine | None = None
        try:
            engine = _engine(folder, campaign, options, workers)
            workers = engine.workers
            satellites = len(campaign.base.satellites)
            size = chunk_size(total - before, workers, satellites, campaign.series_bytes)
            flown = scheduler.fly(map(int, np.flatnonzero(~done)), size, engine)
            store.flush()
        except EngineError as error:
            reason = str(error)
            store.flush()
        except OSError as error:
            reason = f"the results cannot be stored: {sentence_of(error)}"
        finally:
            if engine is not None:
                engine.close()
        stopped = not flown and not reason
    seconds = time.perf_counter() - begun
    after = int(np.count_nonzero(folder.done()))
    speed = Speed(after - before, seconds, workers, options.engine)
    return summarise(folder, campaign, stopped=stopped, reason=reason, speed=speed)


def _engine(folder: CampaignFolder, campaign: Campaign, options: Options, workers: int) -> Engine:
    records = None
    if campaign.keep.record != "never":
        (folder.path / RECORDS).mkdir(exist_ok=True)
        records = str((folder.path / RECORDS).absolute())
    job = Job(fly_chunk, campaign, records, options.timeout or campaign.timeout)
    if options.scheduler is not None:
        return DaskEngine(job, options.scheduler)
    return LocalEngine(job, workers, folder.path / LOG)
