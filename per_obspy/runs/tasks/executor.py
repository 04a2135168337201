"""Executor of a run: the processes of this machine, one that was given, or a Dask cluster."""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from per_obspy.config import Run
from per_obspy.config.engine import Engine, checked_address
from per_obspy.errors import CatalogError, require_extra
from per_obspy.runs.tasks.parallel import Workers


@contextmanager
def dask_executor(address: str | None) -> Iterator[Executor | None]:
    """
    Yield the executor of a Dask cluster for one command; None without an address.

    Parameters
    ----------
    address : str or None
        ``local``, ``local:N``, ``PROTOCOL://HOST:PORT``, ``HOST:PORT``, or a scheduler file.

    Yields
    ------
    Executor or None
        For any function of the pipeline; the cluster is connected when there is work for it.

    Raises
    ------
    CatalogError
        If the address has none of these forms.
    MissingExtra
        If Dask is not installed.
    """
    if address is None:
        yield None
        return
    from per_obspy.runs.tasks.cluster.dask_executor import DaskExecutor

    with DaskExecutor(_address(address)) as executor:
        yield executor


def on_cluster(settings: Run, address: str | None) -> Run:
    """
    Return settings whose every run connects to a Dask cluster by itself; unchanged without one.

    A program of many runs outlives a scheduler that is started again.

    Parameters
    ----------
    settings : Run
        Of the runs.
    address : str or None
        As :func:`dask_executor` takes it.

    Raises
    ------
    CatalogError
        If the address has none of its forms.
    MissingExtra
        If Dask is not installed.
    """
    if address is None:
        return settings
    require_extra("dask", "distributed")
    engine = settings.engine.model_copy(update={"dask": _address(address)})
    return settings.model_copy(update={"engine": engine})


def _address(address: str) -> str:
    """Return a checked address of the command line."""
    try:
        return checked_address(address, Path.cwd())
    except ValueError as error:
        raise CatalogError("--dask", str(error)) from error


@contextmanager
def opened_executor(engine: Engine, workers: Workers, folder: Path) -> Iterator[Workers]:
    """
    Yield the workers of a run while its folder is shared with them.

    Parameters
    ----------
    engine : Engine
        Settings; its cluster is used if the workers have no executor.
    workers : Workers
        Where to work.
    folder : Path
        Of the results.

    Raises
    ------
    MissingExtra
        If Dask is not installed.
    TryLater
        If the cluster has no scheduler or no usable worker.
    """
    if workers.executor is None and engine.dask is not None:
        with (
            dask_executor(engine.dask) as cluster,
            opened_executor(engine, replace(workers, executor=cluster), folder) as used,
        ):
            yield used
        return
    sharing = getattr(workers.executor, "sharing", None)
    if sharing is None:
        yield workers
        return
    with sharing(folder.resolve(), engine):
        yield workers


def engine_facts(executor: Executor | None) -> dict[str, Any] | None:
    """Return workers and events of a cluster for ``run.json``; None for other executors."""
    facts = getattr(executor, "facts", None)
    return facts() if facts else None
