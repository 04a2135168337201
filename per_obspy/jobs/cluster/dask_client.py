"""Connection to a Dask cluster, and the few questions that its scheduler answers."""

import json
import logging
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from per_obspy.config.engine import local_workers
from per_obspy.errors import CatalogError, ServiceError, printable, reason_of, require_extra
from per_obspy.jobs.cluster.worker_side import Versions, identity
from per_obspy.threads import usable_processors

#: Seconds within which a scheduler has to answer.
ANSWER = 30

#: Bytes of a scheduler file that are read: it holds a few addresses, and every worker of later.
LARGEST_FILE = 10_000_000


@contextmanager
def connected_client(address: str) -> Iterator[Any]:
    """
    Yield a client of a cluster, which is started first if it is one of this machine.

    Parameters
    ----------
    address : str
        As :func:`per_obspy.config.engine.checked_address` returns it.

    Raises
    ------
    MissingExtra
        If Dask is not installed.
    ServiceError
        If no scheduler answers there.
    """
    require_extra("dask", "distributed")
    library = import_module("distributed")  # its classes have no complete types

    with ExitStack() as stack:
        place: Any = address
        if local_workers(address) is not None:
            place = stack.enter_context(_local_cluster(address))
        elif address.endswith(".json") and "://" not in address:
            place = _address_in(Path(address))
        try:
            client = library.Client(place, timeout=ANSWER, set_as_default=False)
        except (OSError, ValueError) as error:
            reason = printable(str(error)) or type(error).__name__
            raise ServiceError(f"{address}: no scheduler answers: {reason}") from error
        yield stack.enter_context(client)


def _address_in(file: Path) -> str:
    """Return the address in a scheduler file; for one that is missing Dask would wait for ever."""
    try:
        with file.open("rb") as opened:
            known = json.loads(opened.read(LARGEST_FILE))
    except (OSError, ValueError) as error:
        reason = f"no scheduler file that can be read: {reason_of(error)}"
        raise ServiceError(f"{file}: {reason}; has the scheduler started?") from error
    # It also names the workers, which the scheduler knows better
    address = known.get("address") if isinstance(known, dict) else None
    if not isinstance(address, str) or "://" not in address:
        raise CatalogError(str(file), "no scheduler file: it has no address of a scheduler")
    return address


def _local_cluster(address: str) -> Any:
    """Return a cluster of this machine, one process per worker, closed to other machines."""
    library = import_module("distributed")  # its classes have no complete types

    # Faults of workers are logged once, by their client
    return library.LocalCluster(
        n_workers=local_workers(address) or usable_processors(),
        threads_per_worker=1,
        processes=True,
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
        silence_logs=logging.CRITICAL,
    )


def present_workers(client: Any) -> Mapping[str, tuple[str, int]]:
    """Return the workers of a cluster: address -> machine by address, threads."""
    # ``scheduler_info`` has no workers while the client refreshes it in the background
    known = client.nthreads()
    return {
        str(address): (urlsplit(address).hostname or "unknown", int(threads))
        for address, threads in known.items()
    }


def fit_identities(client: Any, new: Collection[str]) -> dict[str, tuple[str, Versions] | str]:
    """
    Return machine and versions of workers, or why a worker gives no answer.

    Parameters
    ----------
    client : distributed.Client
        Of the cluster.
    new : collection of str
        Addresses.
    """
    if not new:
        return {}
    # Without the package a worker cannot even be asked by it
    packages = client.get_versions(packages=["per_obspy"])["workers"]
    found: dict[str, tuple[str, Versions] | str] = {}
    able = []
    for address in new & packages.keys():
        if packages[address]["packages"].get("per_obspy") is None:
            found[address] = "has no per_obspy"
        else:
            able.append(address)
    if able:
        answers = client.run(identity, workers=able, on_error="return")
        for address, answer in answers.items():
            failed = isinstance(answer, BaseException)
            found[address] = f"cannot be asked: {answer}" if failed else answer
    return found
