"""
Buildings of Overture Maps in a box, fetched from its public store by the package overturemaps.

The file keeps the columns of Overture and has the release in its name.
"""

import re
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from itertools import chain
from pathlib import Path

import pyarrow as pa
from pyarrow.parquet import ParquetWriter

from per_obspy.errors import CatalogError, ServiceError, WriteError, reason_of
from per_obspy.files import written_whole
from per_obspy.inventory.footprints.layer_files import Box

#: Most buildings of a box: a large city has a million.
MOST_BUILDINGS = 5_000_000

#: Time for a connection and for an answer, s.
CONNECTION, ANSWER = 20, 120

_RELEASE = re.compile(r"\d{4}-\d{2}-\d{2}\.\d+")


def fetch_overture(box: Box, output: Path) -> Path:
    """
    Fetch the buildings whose boxes cross this one, of the latest release.

    Parameters
    ----------
    box : tuple of float
        West, south, east and north, degrees.
    output : Path
        Pair table of the buildings; they are written next to it.

    Returns
    -------
    Path
        GeoParquet, named by the table and the release.

    Raises
    ------
    CatalogError
        If the box has no building or too many.
    ServiceError
        If Overture cannot be reached or its answer breaks off.
    """
    from overturemaps import core

    with _as_service():
        release = str(core.get_latest_release())
        if not _RELEASE.fullmatch(release):
            raise ServiceError(f"Overture Maps: the latest release is {release!r:.40}")
        path = output.with_suffix(f".overture-{release}.parquet")
        # Without any file there is no reader
        reader = core.record_batch_reader("building", box, release, CONNECTION, ANSWER, stac=True)
        _write(reader, path, f"Overture Maps {release}")
    return path


def _write(reader: pa.RecordBatchReader | None, path: Path, source: str) -> None:
    """Write the buildings, whole or not at all."""
    batches = iter(reader or ())
    first = next(batches, None)
    if reader is None or first is None:
        raise CatalogError(source, "gives no building of the box")
    count = 0
    with written_whole(path) as part, ParquetWriter(part, reader.schema) as writer:
        for batch in chain([first], batches):
            count += batch.num_rows
            # Half of a city is no city
            if count > MOST_BUILDINGS:
                problem = f"gives more than {MOST_BUILDINGS} buildings: take a smaller box"
                raise CatalogError(source, problem)
            writer.write_batch(batch)


@contextmanager
def _as_service() -> Iterator[None]:
    """Give requests a limit of time, turn failures into ServiceError, and keep them off stdout."""
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(ANSWER)
    try:
        with redirect_stdout(sys.stderr):
            yield
    except (CatalogError, ServiceError, WriteError):
        raise
    except Exception as error:
        # The package raises what its libraries raise, and plain exceptions
        raise ServiceError(f"Overture Maps: {reason_of(error)}") from error
    finally:
        socket.setdefaulttimeout(before)
