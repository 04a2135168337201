"""
Station of each row, and the order of computation of rows: station by station.

Rows are placed a piece of the table at a time; chunks are numbered when all rows are in order.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.inventory.building_rows.chains import Chains

IntArray = NDArray[np.int64]


class PlacedRows(NamedTuple):
    """
    Contacts of all rows in their order of computation.

    Attributes
    ----------
    contacts : DataFrame
        One row per contact: ``pair`` (its row in the pair table), ``turned``, ``row`` (number from
        0), ``interface`` (from 1), ``buildings`` (of the row), ``azimuth`` (of the row, degrees),
        ``station`` (that follows the row).
    order : (n_rows,) ndarray of int
        Number that each row has in the chains.
    several_stations : (n_rows,) ndarray of bool
        Whether pairs of the row are served by different stations, in this order.
    """

    contacts: pd.DataFrame
    order: IntArray
    several_stations: NDArray[np.bool_]


def placed_rows(chains: Chains, pairs: pd.DataFrame) -> PlacedRows:
    """
    Assign a station to every row, and order the rows by station, then as they are.

    The station is the one that serves most pairs of the row; of several that serve equally many it
    is the one nearer to its pairs, then the first by name. It is empty where most pairs have none.

    Parameters
    ----------
    chains : Chains
        Rows of contacts.
    pairs : DataFrame
        ``station, distance, azimuth_used`` of each pair.
    """
    # Stations in the order of their names
    sizes = np.diff(chains.first)
    row = np.repeat(np.arange(sizes.size), sizes)
    station, several = _stations(row, pairs.iloc[chains.pair])
    order = np.lexsort([np.arange(sizes.size), station]).astype(np.int64)
    # Contacts in the order of their rows
    place = np.argsort(order)
    contacts = pd.DataFrame({"pair": chains.pair, "turned": chains.turned}).assign(
        interface=np.arange(row.size) - chains.first[row] + 1,
        buildings=sizes[row] + 1,
        azimuth=_azimuths(chains, pairs)[row],
        station=pd.Categorical.from_codes(station[row], _names(pairs)),
        row=place[row],
    )
    ordered = contacts.sort_values("row", kind="stable", ignore_index=True)
    return PlacedRows(ordered, order, several[order])


def _azimuths(chains: Chains, pairs: pd.DataFrame) -> FloatArray:
    """Return the azimuth of each row, degrees; the worst one of a pair without an azimuth."""
    first = chains.first[:-1]
    used = pairs["azimuth_used"].to_numpy(np.float64)[chains.pair[first]]
    used = (used + 180.0 * chains.turned[first]) % 360.0
    return np.where(np.isnan(chains.azimuth), used, chains.azimuth)


def _names(pairs: pd.DataFrame) -> pd.Index:
    """Return the names of stations, sorted."""
    names = sorted(map(str, pairs["station"].unique()))
    found: pd.Index = pd.Index(np.array(names, dtype=object))
    return found


def _stations(row: IntArray, pairs: pd.DataFrame) -> tuple[IntArray, NDArray[np.bool_]]:
    """Return the station number of each row, and whether its pairs have several stations."""
    codes = _names(pairs).get_indexer(pd.Index(pairs["station"]))
    table = pd.DataFrame({"row": row, "code": codes, "distance": pairs["distance"].to_numpy()})
    groups = table.groupby(["row", "code"])["distance"].agg(["size", "sum"]).reset_index()
    # Most pairs first, then the nearest, then the name
    ordered = groups.sort_values(
        ["row", "size", "sum", "code"], ascending=[True, False, True, True]
    )
    first = ordered.drop_duplicates("row")
    several = groups.groupby("row").size().to_numpy() > 1
    return first["code"].to_numpy(dtype=np.int64), np.asarray(several)


class ChunkNumbers:
    """
    Numbers of chunks: whole rows of one station, and a limited number of contacts.

    A class, because rows arrive in pieces.

    Parameters
    ----------
    size : int
        Contacts of a chunk, as far as rows are whole.
    """

    def __init__(self, size: int) -> None:
        """Begin with chunk 0."""
        self._size = size
        self._number, self._contacts, self._station = 0, 0, ""

    def add(self, contacts: Sequence[int], stations: Sequence[str]) -> IntArray:
        """Return the chunk of each of the next rows, by their contacts and stations."""
        found = []
        for count, station in zip(contacts, stations, strict=True):
            # Rows of one station, as long as there is room
            is_full = station != self._station or self._contacts + count > self._size
            if self._contacts and is_full:
                self._number, self._contacts = self._number + 1, 0
            self._contacts, self._station = self._contacts + count, station
            found.append(self._number)
        return np.array(found, dtype=np.int64)
