"""Place of the work of a run: processes of this machine, or workers of a Dask cluster."""

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field, ValidationInfo

from per_obspy.config.section import Section

#: Name of a cluster that is started on this machine for one command.
LOCAL = "local"

#: Most workers of such a cluster.
MOST_LOCAL = 1024


def local_workers(address: str) -> int | None:
    """
    Return the number of workers of a cluster of this machine; None for any other address.

    Examples
    --------
    >>> local_workers("local:4"), local_workers("local"), local_workers("tcp://10.0.0.1:8786")
    (4, 0, None)
    """
    name, _, count = address.partition(":")
    if name != LOCAL:
        return None
    return int(count) if count else 0


def checked_address(address: str, folder: Path) -> str:
    """
    Return the address of a cluster as it is used; a scheduler file has an absolute path.

    Parameters
    ----------
    address : str
        ``local``, ``local:N``, ``PROTOCOL://HOST:PORT``, ``HOST:PORT``, or a scheduler file.
    folder : Path
        From which a scheduler file is seen.

    Raises
    ------
    ValueError
        If it is none of them.
    """
    given = address.strip()
    # Clusters of this machine, and addresses with and without a protocol
    name, colon, port = given.rpartition(":")
    if given == LOCAL or "://" in given:
        return given
    if name == LOCAL and port.isdecimal() and 1 <= int(port) <= MOST_LOCAL:
        return given
    if colon and name and name != LOCAL and port.isdecimal() and 0 < int(port) < 65536:
        return f"tcp://{given}"
    if given and given != "." and given.endswith(".json"):
        return str((folder / given).absolute())
    raise ValueError(
        f"{address!r} is no scheduler: local, local:4, tcp://HOST:PORT, or a scheduler file (.json)"
    )


def _from_configuration(address: str, info: ValidationInfo) -> str:
    """Return an address as a configuration in its folder means it."""
    return checked_address(address, info.context["folder"] if info.context else Path.cwd())


class Engine(Section):
    """Place of the work on stations, chunks of pairs and rows of buildings (docs/cluster.md)."""

    dask: Annotated[str, AfterValidator(_from_configuration)] | None = Field(
        None,
        description=(
            "Dask scheduler: local, local:4, tcp://HOST:PORT or a scheduler file (.json); "
            "if not set, processes of this machine; needs per_obspy[dask]"
        ),
    )
    retries: int = Field(
        3,
        ge=0,
        le=100,
        description="number of further attempts of a task after a fault of a worker",
    )
    wait: float = Field(
        300.0,
        ge=1,
        le=604_800,
        description="longest time without any usable worker before the run stops, s",
    )
