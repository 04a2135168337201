"""Rows of the pair table from neighbouring buildings, checked block by block."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from per_obspy.checks import FloatArray
from per_obspy.errors import Rejection
from per_obspy.inventory.cells import NOTES
from per_obspy.inventory.checking import Rejections, checked_pairs
from per_obspy.inventory.contact_height import floor_offset
from per_obspy.inventory.footprints.neighbours import Neighbours
from per_obspy.inventory.schema import COLUMNS, POSITIONS
from per_obspy.inventory.table_columns import numbers_in

#: Share of the smaller footprint that may be covered by both: digitised party walls cross by
#: centimetres.
OVERLAP = 0.02

#: Pairs per block, to bound memory.
CHUNK = 50_000

#: Columns that every building has besides those of its layer.
_PLACE = ("longitude", "latitude", "area")


class NearBuildings(NamedTuple):
    """
    Neighbours with the columns of their buildings.

    Attributes
    ----------
    near : Neighbours
        Pairs by the positions of their buildings in the table.
    buildings : DataFrame
        One row per building; the index is the number of the feature.
    drawn : mapping of str to object
        Columns that are the same for every pair: the deviation of a gap and its source.
    central_meridian : float
        Of the projection in which azimuths were measured, degrees.
    """

    near: Neighbours
    buildings: pd.DataFrame
    drawn: Mapping[str, object]
    central_meridian: float


def pair_table(found: NearBuildings, source: str) -> pd.DataFrame:
    """
    Return the checked pair table; its ``attrs["rejected"]`` has the unusable pairs.

    Parameters
    ----------
    found : NearBuildings
        At least one pair.
    source : str
        The file, for messages.
    """
    columns, rejected = dict[str, list[pd.Series]](), list[Rejection]()
    # Repeated names are known of all pairs only
    names = pair_names(found)
    repeated = names.duplicated().to_numpy()
    # Blocks bound the memory of the checks
    for start in range(0, len(names), CHUNK):
        rows = slice(start, start + CHUNK)
        part = _rows(found, names[rows], rows)
        checked, lost = _checked(part.assign(_repeated=repeated[rows]), found, rows, source)
        rejected += lost
        for name, column in checked.items():
            columns.setdefault(str(name), []).append(column.copy())
    # Joined column by column, so that no second copy of the whole table is in memory
    joined = {name: pd.concat(columns.pop(name), ignore_index=True) for name in list(columns)}
    pairs = pd.DataFrame(joined, copy=False)
    pairs.attrs["rejected"] = Rejections(rejected)
    return pairs


def _checked(
    part: pd.DataFrame, found: NearBuildings, rows: slice, source: str
) -> tuple[pd.DataFrame, list[Rejection]]:
    """Return the good pairs of a block, and the rejections of the others."""
    clear, rejected = _without_overlaps(part, found, rows, source)
    repeated = clear.pop("_repeated").to_numpy(dtype=bool)
    checked = checked_pairs(clear, source, np.arange(2, len(clear) + 2), repeated)
    # Pairs have no line in the file
    rejected += [row._replace(row=None) for row in checked.attrs["rejected"]]
    checked.attrs = {}
    return _with_contact(checked), rejected


def pair_names(found: NearBuildings) -> pd.Series:
    """Return identifiers of pairs from those of the buildings."""
    identifiers = found.buildings["building_id"]
    first = identifiers.iloc[found.near.first].reset_index(drop=True)
    return first + "/" + identifiers.iloc[found.near.second].reset_index(drop=True)


def _rows(found: NearBuildings, names: pd.Series, rows: slice) -> pd.DataFrame:
    """Return some pairs before any check."""
    near = found.near.rows(rows)
    inside = near.inside_1 & near.inside_2
    # The pair
    columns: dict[str, Any] = {
        "pair_id": names.reset_index(drop=True),
        "gap": near.gap,
        **found.drawn,
        "azimuth": _true_azimuth(near, found),
        "facing_length": near.facing_length,
        "position": np.where(inside, POSITIONS[1], POSITIONS[0]),
    }
    # Its buildings
    for i, numbers, is_inside in (
        (1, near.first, near.inside_1),
        (2, near.second, near.inside_2),
    ):
        columns[f"position_{i}"] = np.where(is_inside, POSITIONS[1], POSITIONS[0])
        chosen = found.buildings.iloc[numbers].reset_index(drop=True)
        names_of = [*_PLACE, *(name for name in chosen if name not in _PLACE)]
        columns |= {f"{name}_{i}": chosen[name] for name in names_of}
    table = _with_heights(pd.DataFrame(columns))
    return _with_notes(table) if f"{NOTES}_1" in table else table


def _with_notes(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with the notes on both buildings as notes on the pair."""
    notes = []
    for i in (1, 2):
        texts = table.pop(f"{NOTES}_{i}").fillna("").astype(str)
        # Columns of a pair have the number of the building
        notes.append(texts.str.replace(r"(^|; )(\w+) = ", rf"\g<1>\g<2>_{i} = ", regex=True))
    return table.assign(**{NOTES: (notes[0] + "; " + notes[1]).str.strip("; ")})


def _true_azimuth(near: Neighbours, found: NearBuildings) -> FloatArray:
    """Return azimuths from true north, degrees: a projection's north turns with the longitude."""
    first = found.buildings.iloc[near.first]
    east = first["longitude"].to_numpy() - found.central_meridian
    east -= 360.0 * np.round(east / 360.0)
    convergence = east * np.sin(np.deg2rad(first["latitude"].to_numpy()))
    return np.asarray((near.azimuth + convergence) % 360.0)


def _with_heights(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with missing heights from storeys and their given height."""
    unknown = pd.Series(np.nan, index=table.index)
    for i in (1, 2):
        if f"storey_height_{i}" in table:
            # A given height comes first
            storeys, height = (table.get(f"{name}_{i}", unknown) for name in ("storeys", "height"))
            table[f"height_{i}"] = height.fillna(storeys * table.pop(f"storey_height_{i}"))
    return table


def _with_contact(pairs: pd.DataFrame) -> pd.DataFrame:
    """Return checked pairs with contact height and floor offset where both buildings allow it."""
    names = ("height_1", "storeys_1", "height_2", "storeys_2")
    sizes = [numbers_in(pairs, name) for name in names]
    # Floors are known where heights and storeys of both are; 1 is a placeholder elsewhere
    is_known = ~np.isnan(sizes).any(axis=0)
    offset = np.where(is_known, floor_offset(*np.where(is_known, sizes, 1.0)), np.nan)
    pairs = pairs.assign(contact_height=np.minimum(sizes[0], sizes[2]), floor_offset=offset)
    # Columns of the schema first, in its order
    known = [name for name in COLUMNS if name in pairs]
    return pairs[[*known, *pairs.columns.difference(known, sort=False)]]


def _without_overlaps(
    table: pd.DataFrame, found: NearBuildings, rows: slice, source: str
) -> tuple[pd.DataFrame, list[Rejection]]:
    """Return the pairs without overlaps, and a rejection for each other."""
    faults = dict(_overlaps(found.near.rows(rows), table))
    # One reason at most
    rejected = []
    for row, reason in faults.items():
        name = str(table["pair_id"].iloc[row])
        rejected.append(Rejection("pair", name, source, None, (reason,)))
    clear = np.ones(len(table), dtype=bool)
    clear[list(faults)] = False
    return table[clear].reset_index(drop=True), rejected


def _overlaps(near: Neighbours, table: pd.DataFrame) -> Iterator[tuple[int, str]]:
    """Yield the pairs whose footprints overlap, with area and share."""
    smaller = np.fmin(table["area_1"].to_numpy(), table["area_2"].to_numpy())
    share = near.overlap / smaller
    for row in np.flatnonzero(share > OVERLAP).tolist():
        area = near.overlap[row]
        yield row, f"footprints overlap by {area:.3g} m2, {share[row]:.0%} of the smaller one"
