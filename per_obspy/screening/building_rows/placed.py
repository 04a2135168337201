"""Station of each row, and the order of computation of rows: station by station."""

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
        ``station`` (that follows the row) and ``chunk``.
    order : (n_rows,) ndarray of int
        Number that each row has in the chains.
    several_stations : (n_rows,) ndarray of bool
        Whether pairs of the row are served by different stations, in this order.
    """

    contacts: pd.DataFrame
    order: IntArray
    several_stations: NDArray[np.bool_]


def placed_rows(chains: Chains, pairs: pd.DataFrame, size: int) -> PlacedRows:
    """
    Assign a station to every row, and group whole rows of one station into chunks.

    The station is the one that serves most pairs of the row; of several that serve equally many it
    is the one nearer to its pairs, then the first by name. It is empty where most pairs have none.

    Parameters
    ----------
    chains : Chains
        Rows of contacts.
    pairs : DataFrame
        ``station, distance, azimuth_used`` of each pair.
    size : int
        Contacts of a chunk, as far as rows are whole.
    """
    # Stations in the order of their names
    sizes = np.diff(chains.first)
    row = np.repeat(np.arange(sizes.size), sizes)
    station, several = _stations(row, pairs.iloc[chains.pair])
    order = np.lexsort([np.arange(sizes.size), station]).astype(np.int64)
    # Contacts in the order of their rows
    place = np.argsort(order)
    chunk = _chunks(sizes[order], station[order], size)
    contacts = pd.DataFrame({"pair": chains.pair, "turned": chains.turned}).assign(
        interface=np.arange(row.size) - chains.first[row] + 1,
        buildings=sizes[row] + 1,
        azimuth=_azimuths(chains, pairs)[row],
        station=pd.Categorical.from_codes(station[row], _names(pairs)),
        row=place[row],
        chunk=chunk[place[row]],
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


def _chunks(sizes: IntArray, station: IntArray, size: int) -> IntArray:
    """Return the chunk number of each row: one station and limited contacts per chunk."""
    chunk, number, contacts, before = np.empty(sizes.size, dtype=np.int64), 0, 0, -1
    # Rows of one station, as long as there is room
    for row, (count, code) in enumerate(zip(sizes.tolist(), station.tolist(), strict=True)):
        if row and (code != before or contacts + count > size):
            number, contacts = number + 1, 0
        chunk[row], contacts, before = number, contacts + count, code
    return chunk
