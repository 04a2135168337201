"""Files of pairs by suffix: Parquet files, and CSV files from :mod:`.csv_rows`."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
from numpy.typing import NDArray

from per_obspy.errors import CatalogError, Rejection
from per_obspy.files import unreadable_reason
from per_obspy.inventory.checking import OBSERVED
from per_obspy.inventory.files.csv_rows import CsvFile
from per_obspy.inventory.files.plain_columns import plain_columns
from per_obspy.inventory.files.raw_rows import IDENTIFIER, PairFile, RawRows

#: Prefix that pandas gives to a column of row numbers.
INDEX = "__index_level_"


class ParquetFile:
    """Pairs in a Parquet file."""

    def __init__(self, file: Path) -> None:
        self.file = file
        # Relative names such as http:/x are addresses to the reader
        self._path = file.absolute()
        with self._readable():
            names = pa.parquet.read_schema(self._path).names
        self.names: Sequence[str] = [name for name in names if not name.startswith(INDEX)]

    def identifiers(self) -> Iterator[pa.Array]:
        """Yield the identifiers of the pairs, block by block."""
        with self._readable(), pa.parquet.ParquetFile(self._path) as stored:
            for batch in stored.iter_batches(columns=[IDENTIFIER]):
                if pa.types.is_nested(batch.schema.field(0).type):
                    batch.column(0).cast(pa.string())  # lists and the like are no names
                names, _ = plain_columns(pa.Table.from_batches([batch]))
                yield names.column(0).cast(pa.string()).combine_chunks()

    def rows(self, size: int) -> Iterator[RawRows]:
        """Yield blocks of so many rows."""
        line = 2
        with self._readable(), pa.parquet.ParquetFile(self._path) as stored:
            for batch in stored.iter_batches(batch_size=size, columns=self.names):
                # Lines as if the file had a header
                lines = np.arange(line, line + batch.num_rows)
                table, faults = plain_columns(pa.Table.from_batches([batch]))
                broken = [self._rejection(table, lines, *fault) for fault in faults.items()]
                good = np.isin(np.arange(batch.num_rows), list(faults), invert=True)
                rows = _with_numbers(table).filter(pa.array(good))
                yield RawRows(str(self.file), rows, lines[good], tuple(broken))
                line += batch.num_rows

    def _rejection(
        self, table: pa.Table, lines: NDArray[np.int64], row: int, fault: str
    ) -> Rejection:
        """Return the rejection of a row."""
        name = str(table[IDENTIFIER][row].as_py())
        return Rejection("pair", name, str(self.file), int(lines[row]), (fault,))

    @contextmanager
    def _readable(self) -> Iterator[None]:
        """Turn a fault of the reader into one of the file."""
        try:
            yield
        except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
            problem = unreadable_reason(self.file, "Parquet table", error)
            raise CatalogError(str(self.file), problem) from error


def _with_numbers(table: pa.Table) -> pa.Table:
    """
    Return the table with 0 and 1 for booleans in the column ``observed``.

    Some programs write it so; in other columns of numbers a boolean is a mistake.
    """
    for i, column in enumerate(table.schema):
        if column.name == OBSERVED and pa.types.is_boolean(column.type):
            table = table.set_column(i, column.name, table[i].cast(pa.float64()))
    return table


#: Suffixes of layers of footprints, which are not pairs yet.
FOOTPRINTS = (".gpkg", ".geojson", ".shp", ".fgb", ".gml", ".osm", ".pbf", ".geojsonl")

_KINDS: dict[str, type[CsvFile] | type[ParquetFile]] = {".csv": CsvFile, ".parquet": ParquetFile}


def pair_file(path: Path) -> PairFile:
    """
    Open a file of pairs.

    Raises
    ------
    CatalogError
        If it does not exist, is of an unknown kind, or cannot be read.
    """
    # Layers of footprints are a common mistake
    if path.suffix.lower() not in _KINDS:
        is_layer = path.suffix.lower() in FOOTPRINTS
        advice = "; per-obspy pairs makes such a table of footprints" if is_layer else ""
        expected = " or ".join(_KINDS)
        raise CatalogError(
            str(path), f"unknown suffix {path.suffix!r}, expected {expected}{advice}"
        )
    if not path.is_file():
        raise CatalogError(str(path), "no such file")
    return _KINDS[path.suffix.lower()](path)
