"""Files of pairs of either kind: Parquet here, CSV in a module of its own."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet

from per_obspy.errors import CatalogError
from per_obspy.files import unreadable_reason
from per_obspy.inventory.files.csv_rows import CsvFile
from per_obspy.inventory.files.raw_rows import IDENTIFIER, PairFile, RawRows
from per_obspy.inventory.schema import COLUMNS

#: How pandas calls a column that only numbers the rows.
INDEX = "__index_level_"


class ParquetFile:
    """Pairs in a Parquet file."""

    def __init__(self, file: Path) -> None:
        self.file = file
        with self._readable():
            names = pa.parquet.read_schema(file).names
        self.names: Sequence[str] = [name for name in names if not name.startswith(INDEX)]

    def identifiers(self) -> Iterator[pa.Array]:
        """Give the names of the pairs, block by block."""
        with self._readable(), pa.parquet.ParquetFile(self.file) as stored:
            for batch in stored.iter_batches(columns=[IDENTIFIER]):
                yield batch.column(0).cast(pa.string())

    def rows(self, size: int) -> Iterator[RawRows]:
        """Give the rows, so many at a time."""
        line = 2
        with self._readable(), pa.parquet.ParquetFile(self.file) as stored:
            for batch in stored.iter_batches(batch_size=size, columns=self.names):
                lines = np.arange(line, line + batch.num_rows)
                yield RawRows(
                    str(self.file), _with_numbers(pa.Table.from_batches([batch])), lines, ()
                )
                line += batch.num_rows

    @contextmanager
    def _readable(self) -> Iterator[None]:
        try:
            yield
        except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
            raise CatalogError(
                str(self.file), unreadable_reason(self.file, "Parquet table", error)
            ) from error


def _with_numbers(table: pa.Table) -> pa.Table:
    """Return the table with truth values as 0 and 1 where numbers belong, as some programs write what was observed."""
    for i, column in enumerate(table.schema):
        if (
            pa.types.is_boolean(column.type)
            and column.name in COLUMNS
            and COLUMNS[column.name].dtype == "float64"
        ):
            table = table.set_column(i, column.name, table[i].cast(pa.float64()))
    return table


#: What layers of footprints are called, which are no pairs yet.
FOOTPRINTS = (".gpkg", ".geojson", ".shp", ".fgb")

_KINDS: dict[str, type[CsvFile] | type[ParquetFile]] = {".csv": CsvFile, ".parquet": ParquetFile}


def pair_file(path: Path) -> PairFile:
    """
    Open a file of pairs.

    Raises
    ------
    CatalogError
        If it does not exist, is of an unknown kind, or cannot be read.
    """
    if path.suffix.lower() not in _KINDS:
        made = (
            "; per-obspy pairs makes such a table of footprints"
            if path.suffix.lower() in FOOTPRINTS
            else ""
        )
        raise CatalogError(
            str(path), f"unknown suffix {path.suffix!r}, expected {' or '.join(_KINDS)}{made}"
        )
    if not path.is_file():
        raise CatalogError(str(path), "no such file")
    return _KINDS[path.suffix.lower()](path)
