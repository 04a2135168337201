"""Work on one chunk of rows of buildings: whole rows of one station, and their exact histories."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version

import numpy as np
import pyarrow as pa

from per_obspy.buildings.histories import no_outcomes, row_outcomes
from per_obspy.buildings.tables import write_rows_part
from per_obspy.errors import Rejection
from per_obspy.files import remove_file
from per_obspy.runs.tasks.ground_files import StationFile, read_station_once
from per_obspy.runs.tasks.parts import Part, PartTask, rows_hash
from per_obspy.screening.values import Columns, chosen, components
from per_obspy.spectra.station import lacks_azimuths


@dataclass(frozen=True, kw_only=True)
class RowsTask(PartTask):
    """One chunk of rows of buildings."""

    #: Contacts of whole rows, one after the other, with the columns of their interfaces that are
    #: known, and those of ``histories.NEEDED``.
    contacts: pa.Table
    #: Whose record they are followed under; None: no history is computed.
    station: StationFile | None

    @property
    def rows(self) -> int:
        """Number of contacts."""
        return int(self.contacts.num_rows)

    @property
    def name(self) -> str:
        """First and last row."""
        rows = self.contacts["row_id"]
        return f"rows of buildings from {rows[0]} to {rows[-1]}"

    def content_hash(self) -> str:
        """Return the hash of all inputs of the part."""
        station = self.station.hash if self.station else ""
        return rows_hash([version("per_obspy"), station], self.contacts)

    def do(self) -> Part:
        """Follow the rows of the chunk, write its part and status, and return the part."""
        remove_file(self.part)
        contacts = _columns(self.contacts)
        if self.station is None:
            return self._write(contacts, no_outcomes(self.rows), ())
        dataset = read_station_once(self.station.shard, self.station.hash)
        if lacks_azimuths(dataset):
            reason = f"the azimuths of the horizontals of {dataset['station'].item()} are unknown"
            return self._reject_all(reason)
        # Along a single horizontal whatever the axis: it counts as north
        one_horizontal = dataset.sizes["horizontal"] == 1
        if one_horizontal:
            contacts["flags"] = _flagged(contacts["flags"], "one_horizontal")
        axis = np.zeros(self.rows) if one_horizontal else contacts["azimuth"]
        outcomes, rejected = _known_outcomes(components(dataset), contacts | {"axis": axis})
        return self._write(contacts, outcomes, rejected)

    def failed(self, reason: str) -> Part:
        """Return a part without histories after a failure; the next run repeats it."""
        return replace(self, key="")._reject_all(reason)._replace(failed=True)

    def _reject_all(self, reason: str) -> Part:
        """Write a part of which no row has a history, for the same reason."""
        names = dict.fromkeys(self.contacts["row_id"].to_pylist())
        rejected = [Rejection("row", str(name), "", None, (reason,)) for name in names]
        return self._write(_columns(self.contacts), no_outcomes(self.rows), rejected)

    def _write(self, contacts: Columns, outcomes: Columns, rejected: Sequence[Rejection]) -> Part:
        """Write the part, its status after it, and return the part."""
        names, flags = contacts["row_id"], contacts["flags"]
        # What holds for one contact of a row holds for all of it
        raised = {
            "values_reconciled": np.isin(names, names[outcomes["reconciled"]]),
            "no_history": np.isin(names, [rejection.name for rejection in rejected]),
        }
        for name, rows in raised.items():
            flags = np.where(rows, _flagged(flags, name), flags)
        write_rows_part({**contacts, **outcomes, "flags": flags}, self.part)
        return self.record(rejected)


def _columns(table: pa.Table) -> Columns:
    """Return a table as arrays."""
    frame = table.to_pandas()
    return {str(name): frame[name].to_numpy() for name in frame}


def _known_outcomes(
    motion: tuple[np.ndarray, np.ndarray, float], contacts: Columns
) -> tuple[Columns, tuple[Rejection, ...]]:
    """Compute the outcomes of all rows but those of unknown gap, which are rows of two."""
    known = np.flatnonzero(np.isfinite(contacts["gap"]))
    outcomes = no_outcomes(contacts["gap"].size)
    if not known.size:
        return outcomes, ()
    computed, rejected = _outcomes(motion, chosen(contacts, known))
    for name, column in computed.items():
        outcomes[name][known] = column
    return outcomes, rejected


def _outcomes(
    motion: tuple[np.ndarray, np.ndarray, float], contacts: Columns
) -> tuple[Columns, tuple[Rejection, ...]]:
    """Compute the outcomes of all rows but those that fail, which are found by halving."""
    count = contacts["interface"].size
    first = np.append(np.flatnonzero(contacts["interface"] == 1), count)
    try:
        return row_outcomes(motion, contacts, first, contacts["axis"][first[:-1]]), ()
    except (ValueError, ArithmeticError, RuntimeError) as error:
        if first.size == 2:
            rejection = Rejection("row", contacts["row_id"][0], "", None, (str(error),))
            return no_outcomes(count), (rejection,)

    # A row among several fails: each half is computed alone
    middle = first[first.size // 2]
    (one, rejected), (other, more) = (
        _outcomes(motion, chosen(contacts, rows))
        for rows in (np.arange(middle), np.arange(middle, count))
    )
    # Both halves in their order
    return {name: np.append(one[name], other[name]) for name in one}, (*rejected, *more)


def _flagged(flags: np.ndarray, name: str) -> np.ndarray:
    """Add a flag to texts of flags."""
    return np.array([f"{text} {name}".strip() for text in flags.tolist()], dtype=object)
