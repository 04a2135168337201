"""Files of pairs by suffix: Parquet, CSV (:mod:`.csv_rows`) and workbooks."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
from numpy.typing import NDArray

from per_obspy.config import TableForm
from per_obspy.errors import CatalogError, Rejection
from per_obspy.files import unreadable_reason
from per_obspy.inventory.cells import CellForm
from per_obspy.inventory.files.csv_rows import PLAIN, CsvFile
from per_obspy.inventory.files.plain_columns import plain_columns
from per_obspy.inventory.files.raw_rows import PairFile, RawRows, cell_form, with_values
from per_obspy.inventory.files.workbook_rows import WorkbookFile
from per_obspy.inventory.recognition.column_meanings import IDENTIFIER, meanings_of
from per_obspy.inventory.recognition.side_file import form_of

#: Prefix that pandas gives to a column of row numbers.
INDEX = "__index_level_"


class ParquetFile:
    """
    Pairs in a Parquet file.

    Parameters
    ----------
    file : Path
        The file.
    given : TableForm
        Names and units of the user.
    """

    def __init__(self, file: Path, given: TableForm = PLAIN) -> None:
        self.file = file
        # Relative names such as http:/x are addresses to the reader
        self._path = file.absolute()
        with self._readable():
            stored = pa.parquet.read_schema(self._path).names
        self.headings = [name for name in stored if not name.startswith(INDEX)]
        self.meanings = meanings_of(self.headings, given, str(file))
        self.names: Sequence[str] = self.meanings.names

    @property
    def recognised(self) -> str:
        """Names and units that are not those of the schema, empty if all are."""
        return self.meanings.sentence()

    def check_cells(self) -> None:
        """Return without a change: numbers of a Parquet file can be read in one way only."""

    def identifiers(self) -> Iterator[pa.Array]:
        """Yield the identifiers of the pairs, block by block."""
        with self._readable(), pa.parquet.ParquetFile(self._path, pre_buffer=False) as stored:
            if IDENTIFIER not in self.names:
                yield pa.nulls(stored.metadata.num_rows, pa.string())
                return
            column = self.headings[self.names.index(IDENTIFIER)]
            for batch in stored.iter_batches(columns=[column]):
                if pa.types.is_nested(batch.schema.field(0).type):
                    batch.column(0).cast(pa.string())  # lists and the like are no names
                names, _ = plain_columns(pa.Table.from_batches([batch]))
                yield names.column(0).cast(pa.string()).combine_chunks()

    def rows(self, size: int) -> Iterator[RawRows]:
        """Yield blocks of so many rows in the units of the schema."""
        line, form = 2, self._cell_form
        with self._readable(), pa.parquet.ParquetFile(self._path, pre_buffer=False) as stored:
            for batch in stored.iter_batches(batch_size=size, columns=self.headings):
                # Lines as if the file had a header
                lines = np.arange(line, line + batch.num_rows)
                # Names and units of the schema
                table, faults = plain_columns(pa.Table.from_batches([batch]))
                table = table.select(self.headings).rename_columns(self.names)
                broken = [self._rejection(table, lines, *fault) for fault in faults.items()]
                good = np.isin(np.arange(batch.num_rows), list(faults), invert=True)
                rows = with_values(table.filter(pa.array(good)), form)
                yield RawRows(str(self.file), rows, lines[good], tuple(broken))
                line += batch.num_rows

    @property
    def _cell_form(self) -> CellForm:
        """Return how the cells are written; reads all gaps that are text."""
        return cell_form(self.meanings, self._gaps(), {})

    def _gaps(self) -> Iterator[pa.ChunkedArray]:
        """Yield the gaps block by block."""
        place = self.names.index("gap")
        with self._readable(), pa.parquet.ParquetFile(self._path, pre_buffer=False) as stored:
            for batch in stored.iter_batches(columns=[self.headings[place]]):
                yield plain_columns(pa.Table.from_batches([batch]))[0].column(0)

    def _rejection(
        self, table: pa.Table, lines: NDArray[np.int64], row: int, fault: str
    ) -> Rejection:
        """Return the rejection of a row."""
        name = str(table[IDENTIFIER][row].as_py()) if IDENTIFIER in self.names else ""
        return Rejection("pair", name, str(self.file), int(lines[row]), (fault,))

    @contextmanager
    def _readable(self) -> Iterator[None]:
        """Turn a fault of the reader into one of the file."""
        try:
            yield
        except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
            problem = unreadable_reason(self.file, "Parquet table", error)
            raise CatalogError(str(self.file), problem) from error


#: Suffixes of layers of footprints, which are not pairs yet.
FOOTPRINTS = (".gpkg", ".geojson", ".shp", ".fgb", ".gml", ".osm", ".pbf", ".geojsonl")

#: Suffixes of other workbooks, which a spreadsheet program saves as .xlsx.
WORKBOOKS = (".xls", ".xlsb", ".ods", ".numbers")

_KINDS: dict[str, type[CsvFile] | type[ParquetFile] | type[WorkbookFile]] = {
    ".csv": CsvFile,
    ".parquet": ParquetFile,
    ".xlsx": WorkbookFile,
    ".xlsm": WorkbookFile,
    ".tsv": CsvFile,
    ".txt": CsvFile,
}


def pair_file(path: Path, given: TableForm | None = None) -> PairFile:
    """
    Open a file of pairs.

    Parameters
    ----------
    path : Path
        The file; a side file next to it may describe its form (:mod:`~.side_file`).
    given : TableForm, optional
        Form of the file, from a configuration.

    Raises
    ------
    CatalogError
        If it does not exist, is of an unknown kind, or cannot be read.
    MissingExtra
        If it is a workbook and the library for workbooks is not installed.
    """
    # Layers of footprints are a common mistake
    suffix = path.suffix.lower()
    if suffix not in _KINDS:
        advice = (
            "; per-obspy pairs makes such a table of footprints" if suffix in FOOTPRINTS else ""
        )
        advice = "; save the workbook as .xlsx" if suffix in WORKBOOKS else advice
        expected = f"{', '.join(list(_KINDS)[:-1])} or {list(_KINDS)[-1]}"
        raise CatalogError(
            str(path), f"unknown suffix {path.suffix!r}, expected {expected}{advice}"
        )
    if not path.is_file():
        raise CatalogError(str(path), "no such file")
    file: PairFile = _KINDS[suffix](path, form_of(path, given))
    return file
