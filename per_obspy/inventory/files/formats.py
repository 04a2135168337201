"""
Files of pairs: one reader of text, workbooks and Parquet files, which are opened by their suffix.

A file is read once for what its cells have in common (decimal marks, units, types, identifiers that
may occur twice), then block by block.
"""

import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from per_obspy.config import TableForm
from per_obspy.errors import CatalogError
from per_obspy.inventory.cells import (
    NOTES,
    PLAIN_CELLS,
    CellForm,
    bare_name,
    read_columns,
    unit_in_cells,
)
from per_obspy.inventory.files.decimal_marks import Evidence, marks_of, two_readings, with_points
from per_obspy.inventory.files.headings import IDENTIFIER
from per_obspy.inventory.files.parquet import open_parquet
from per_obspy.inventory.files.raw_rows import Contents, RawRows, name_hashes, regrouped, stripped
from per_obspy.inventory.files.side_file import form_of
from per_obspy.inventory.files.text_cells import given_text, given_texts
from per_obspy.inventory.files.text_lines import TURKISH, open_text, two_pages
from per_obspy.inventory.files.workbook import open_workbook
from per_obspy.inventory.schema import COLUMNS, EMPTY

#: The default: the form of a table is recognised, not configured.
PLAIN = TableForm()

#: Readers by suffix.
_OPENERS = {
    ".csv": open_text,
    ".parquet": open_parquet,
    **dict.fromkeys((".xlsx", ".xlsm", ".xlsb", ".xls", ".ods"), open_workbook),
    ".tsv": open_text,
    ".txt": open_text,
}

#: Suffixes of layers of footprints, which are not pairs yet.
FOOTPRINTS = (".gpkg", ".geojson", ".shp", ".fgb", ".gml", ".osm", ".pbf", ".geojsonl")

#: Words for an empty cell.
_EMPTY_WORDS = pa.array(sorted(EMPTY))


class PairFile:
    """
    Pairs in a file.

    Every cell of a text is read as text, so that a message can contain a bad value as it is.

    Parameters
    ----------
    contents : Contents
        The file.
    given : TableForm
        Form of the table as configured by the user.

    Attributes
    ----------
    names : list of str
        Columns, by the schema where it knows them; columns without a name are left out.
    headings : tuple of str
        The header as it is in the file.
    meanings : Meanings
        Meanings of the headings.
    """

    def __init__(self, contents: Contents, given: TableForm = PLAIN) -> None:
        self._contents, self._given = contents, given
        self.meanings, self.headings = contents.meanings, contents.meanings.cells
        self.names = [name for name in contents.names if name]

    @property
    def own_names(self) -> list[str]:
        """Names of the columns as the file has them, in the order of ``names``."""
        columns = zip(self.headings, self._contents.names, strict=True)
        return [given_text(heading.strip()) for heading, name in columns if name]

    @property
    def recognised(self) -> str:
        """Recognised peculiarities of the file, empty if there are none; reads the whole file."""
        # Columns by their decimal mark
        marks = self._survey.form.marks
        kinds = {",": "decimal commas in ", ".": "commas between thousands in "}
        texts = [*self._contents.form, self.meanings.sentence()]
        for mark, kind in kinds.items():
            names = ", ".join(name for name, known in marks.items() if known == mark)
            texts.append(f"{kind}{names}" if names else "")
        return "; ".join(text for text in texts if text)

    def check_cells(self) -> None:
        """
        Read the whole file for what its cells have in common.

        Raises
        ------
        CatalogError
            If a number or letter of a known column can be read in two ways, or rows exceed the
            header.
        """
        _ = self._survey
        if self._contents.separator != ",":
            return
        # Decimal commas between commas make more cells, in every row
        first = next(self._blocks(self.names[:1]))
        counts = [
            re.match(r"(\d+) columns, the header has", row.reasons[0]) for row in first.broken
        ]
        wide = [count and int(count[1]) > len(self.headings) for count in counts]
        if len(first.lines) == 0 and wide and all(wide):
            reason = f"no row has as many columns as the header ({first.broken[0].reasons[0]})"
            mend = "separate columns by semicolons, or put cells with commas in quotation marks"
            raise CatalogError(first.source, f"{reason}, as decimal commas make: {mend}")

    @property
    def hashes(self) -> NDArray[np.uint64]:
        """Hashes of the identifiers of all rows, those of a Parquet file that are left out too."""
        return self._survey.hashes

    def rows(self, size: int, are_pairs: bool = True) -> Iterator[RawRows]:
        """
        Yield blocks of so many rows; lines without any content are left out.

        Rows of pairs have values by the schema; others have text where a cell is no number.
        """
        for rows in regrouped(self._blocks(self.names), size):
            table, lines = rows.table, rows.lines
            if self._contents.is_text:
                full = np.zeros(len(table), dtype=bool)
                for column in table.columns:
                    full |= np.asarray(pc.not_equal(column, ""))
                # Numbers and texts as far as they are plain, then values
                columns = {name: self._converted(name, table[name]) for name in self.names}
                table, lines = pa.table(columns).filter(pa.array(full)), lines[full]
            values = with_values(table, self._survey.form) if are_pairs else table
            yield rows._replace(table=values, lines=lines)

    def _blocks(self, names: Sequence[str]) -> Iterator[RawRows]:
        """Yield these columns as the file has them, block by block, and the broken lines."""
        places = [self._contents.names.index(name) for name in names]
        for rows in self._contents.blocks(places):
            yield rows._replace(table=rows.table.rename_columns(list(names)))

    @cached_property
    def _survey(self) -> "_Survey":
        """
        Return what the cells of the whole file have in common.

        Raises
        ------
        CatalogError
            If a number may be read in two ways, or a text of a known column may be.
        """
        survey = _Survey(self._contents, self.names)
        blocks = list(map(survey.add, self._blocks(survey.names)))
        survey.hashes = np.concatenate([np.empty(0, dtype=np.uint64), *blocks])
        # The user has to decide if no number in the file does
        marks, doubtful = marks_of(survey.evidence, self._given.decimal or "")
        for name, column in doubtful.items():
            raise CatalogError(self._contents.source, two_readings(name, column))
        units, language = self.meanings.units, self.meanings.language
        survey.form = CellForm(units, marks, language, survey.gap_unit)
        return survey

    def _converted(self, name: str, cells: pa.ChunkedArray) -> pa.ChunkedArray:
        """Return a column of text as numbers if every cell is one, else as text."""
        if types := self._survey.types.get(name):
            return _as_numbers(cells, types[0])
        if name not in COLUMNS or COLUMNS[name].dtype == "str":
            return given_texts(cells)
        # Commas between storeys may make a list
        mark = self._survey.form.marks.get(name) if bare_name(name) != "storeys" else None
        points = with_points(cells, mark) if mark else cells
        numbers = _as_numbers(points, pa.float64())
        return points if numbers is None else numbers


class _Survey:
    """
    What the cells of a file have in common.

    Attributes
    ----------
    names : list of str
        Columns that have to be read for it.
    form : CellForm
        How the cells are written.
    evidence : dict of str to Evidence
        Columns of numbers of the schema in a text -> meaning of their commas.
    types : dict of str to list of DataType
        Other columns of a text -> types of number that each of their cells can be.
    gap_unit : str
        A unit other than m that gaps have in their cells.
    hashes : (n_rows,) ndarray of uint64
        Of the identifiers.
    """

    form = PLAIN_CELLS
    hashes: NDArray[np.uint64]

    def __init__(self, contents: Contents, names: Sequence[str]) -> None:
        is_number = {name: COLUMNS[name].dtype != "str" for name in names if name in COLUMNS}
        self._is_text = contents.is_text
        # Marks and types only where every cell is text
        text = names if contents.is_text else ()
        self.evidence = {name: Evidence() for name in text if is_number.get(name)}
        self.types = {name: [pa.int64(), pa.float64()] for name in text if name not in COLUMNS}
        self.gap_unit = ""
        # Texts only where letters are in doubt, gaps only where the heading has no unit
        self._texts = [name for name in is_number if contents.is_doubtful and not is_number[name]]
        self._gap = "" if "gap" in contents.meanings.units else "gap"
        chosen = {*self.evidence, *self.types, *self._texts, self._gap, IDENTIFIER}
        self.names = [name for name in names if name in chosen] or [*names[:1]]

    def add(self, rows: RawRows) -> NDArray[np.uint64]:
        """Look at further rows, and return the hashes of their identifiers."""
        for name, cells in zip(rows.table.column_names, rows.table.columns, strict=True):
            if name in self.evidence:
                self.evidence[name].add(cells, rows.lines)
            if name in self.types:
                # Drop every type that a cell contradicts
                self.types[name] = [
                    kind for kind in self.types[name] if _as_numbers(cells, kind) is not None
                ]
            if name == self._gap and not self.gap_unit and pa.types.is_string(cells.type):
                has_unit = pc.match_substring_regex(cells, r"\d\s*(?:\pL|['’′″”\"])")
                self.gap_unit = unit_in_cells(pc.unique(cells.filter(has_unit)).to_pylist())
            if name in self._texts:
                _check_letters(name, cells, rows)
        return self._hashes(rows)

    def _hashes(self, rows: RawRows) -> NDArray[np.uint64]:
        """Return the hashes of the identifiers of some rows."""
        names = pa.nulls(len(rows.table), pa.string())
        if IDENTIFIER in rows.table.column_names:
            names = rows.table[IDENTIFIER].cast(pa.string())
            names = (given_texts(names) if self._is_text else names).combine_chunks()
        # Rows of a Parquet file that are left out are counted as well
        lost = 0 if self._is_text else len(rows.broken)
        return name_hashes(stripped(pa.concat_arrays([names, pa.nulls(lost, pa.string())])))


def _check_letters(name: str, cells: pa.ChunkedArray, rows: RawRows) -> None:
    """Raise CatalogError for the first cell with a letter that is another one in Turkey."""
    place = pc.index(pc.match_substring_regex(cells, f"[{TURKISH}]"), True).as_py()
    if place >= 0:
        problem = two_pages(name, cells[place].as_py())
        raise CatalogError(rows.source, f"line {rows.lines[place]}: {problem}")


def _as_numbers(cells: pa.ChunkedArray, kind: pa.DataType) -> pa.ChunkedArray | None:
    """Return text as numbers if every cell is empty or a number, else None."""
    text = pc.utf8_trim_whitespace(cells)
    empty = pc.is_in(pc.utf8_lower(text), value_set=_EMPTY_WORDS)
    try:
        return pc.cast(pc.if_else(empty, None, text), kind)
    except pa.ArrowInvalid:
        return None


def with_values(table: pa.Table, form: CellForm = PLAIN_CELLS) -> pa.Table:
    """Return a table whose columns of numbers are numbers in the units of the schema."""
    # Text is left to the checks
    known = [name for name in table.column_names if name in COLUMNS]
    chosen = [name for name in known if COLUMNS[name].dtype != "str" or name == NOTES]
    values = read_columns({name: table[name].to_pandas() for name in chosen}, form)
    for name, cells in values.items():
        column = pa.chunked_array([pa.array(cells, from_pandas=True)])
        if name in chosen:
            table = table.set_column(table.column_names.index(name), name, column)
        else:
            table = table.append_column(name, column)
    return table


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
    suffix = path.suffix.lower()
    if suffix not in _OPENERS:
        # Layers of footprints are a common mistake
        advice = (
            "; per-obspy pairs makes such a table of footprints" if suffix in FOOTPRINTS else ""
        )
        advice = "; save the workbook as .xlsx" if suffix == ".numbers" else advice
        *others, last = _OPENERS
        problem = f"unknown suffix {path.suffix!r}, expected {', '.join(others)} or {last}{advice}"
        raise CatalogError(str(path), problem)
    if not path.is_file():
        raise CatalogError(str(path), "no such file")
    form = form_of(path, given)
    return PairFile(_OPENERS[suffix](path, form), form)
