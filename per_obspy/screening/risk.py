"""
Rows of the risk table, not ranked yet, and the table of an inventory that fits in memory.

A row depends on its pair, its station and the settings, and on no other row.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from pandas.api.types import is_numeric_dtype

from per_obspy.checks import FloatArray
from per_obspy.config import Building, Screening
from per_obspy.errors import CatalogError, Rejection
from per_obspy.inventory.checking import check_columns
from per_obspy.inventory.completion import completed_pairs
from per_obspy.inventory.suspicions import ODD
from per_obspy.screening.assignment import assigned, stations_of
from per_obspy.screening.codes import code_columns, rule_columns
from per_obspy.screening.columns import ORDER, RESULTS
from per_obspy.screening.estimates import demand_columns
from per_obspy.screening.exact import exact_decides, furthest_azimuth
from per_obspy.screening.exact_population import record_population
from per_obspy.screening.flags import (
    joined_flags,
    raised_by_pairs,
    raised_by_record,
)
from per_obspy.screening.meanings import FLAGS
from per_obspy.screening.mitigation import mitigation_columns
from per_obspy.screening.ranking import KEYS, kept_apart, state_columns, without_gap, worst_first
from per_obspy.screening.shakemap import shakemap_rows
from per_obspy.screening.site_motion import (
    RegionalMotion,
    hypocentre_of,
    motion_at_pairs,
    prepared_field,
)
from per_obspy.screening.station_amplitudes import (
    amplitude_rows,
    amplitudes_in_reach,
    served_by_amplitudes,
)
from per_obspy.screening.station_motion import (
    PairMotion,
    StationMotion,
    joined_stations,
    motion_along_azimuths,
    motion_along_every_azimuth,
    motion_found,
    motion_of_one_horizontal,
)
from per_obspy.screening.values import (
    Columns,
    IndexArray,
    at_contact,
    chosen,
    joined,
    stay_linear,
    strength_is_assumed,
    values,
)
from per_obspy.spectra.station import lacks_azimuths

#: Columns that other columns are computed from and that are dropped at the end; flags report what
#: a reader must know of them.
INTERMEDIATE = (
    "station_index",
    "other_site_class",
    "linearized_converged",
    "motion_from_other_site_class",
    *(f"equivalent_{name}_{i}" for name in ("period", "damping", "per") for i in (1, 2)),
)

#: Pairs from which on those of the next station are no longer computed with those of the ones
#: before, and stations at most whose pairs are computed together.
TOGETHER, STATIONS_TOGETHER = 1000, 64

#: Pairs of unknown azimuth that are computed together: at 180 azimuths every array of theirs stays
#: below 3 MB.
BLOCK = 2000


def risk_rows(
    pairs: pd.DataFrame, ground: RegionalMotion, building: Building, screening: Screening
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """
    Compute one row per pair, in no particular order, and the rejections of pairs out of reach.

    Parameters
    ----------
    pairs : DataFrame
        From :func:`per_obspy.read_pairs`, or some rows of it; its columns named as results are
        replaced.
    ground : RegionalMotion
        The ground motion; only stations that serve a pair are read.
    building, screening : Building, Screening
        Assumptions for missing values; thresholds.

    Returns
    -------
    rows : DataFrame
        Columns in the order of ``screening.columns.ORDER`` without ``rank``, then the other columns
        of the pair table.
    rejected : tuple of Rejection
        Pairs that neither a station, amplitudes nor the map serve.
    """
    rows, rejected = _rows(pairs, ground, building, screening, _record_columns)
    return _ordered(rows.reindex(columns=[*ORDER]) if rows.empty else rows), rejected


def contact_chances(
    pairs: pd.DataFrame, ground: RegionalMotion, building: Building, screening: Screening
) -> pd.DataFrame:
    """
    Return ``pair_id, probability, state`` of the rows of :func:`risk_rows`, in less time.

    Neither histories nor measures are computed, which change none of them.
    """
    rows, _ = _rows(pairs, ground, building, screening, _chance_columns)
    return rows.reindex(columns=["pair_id", "probability", "state"])


class _Served(NamedTuple):
    """A station and the rows of its pairs."""

    dataset: xr.Dataset
    motion: StationMotion
    rows: IndexArray


#: Computes columns of pairs at some stations.
_AtStations = Callable[[Sequence[_Served], Columns, Screening], Columns]


def _rows(
    pairs: pd.DataFrame,
    ground: RegionalMotion,
    building: Building,
    screening: Screening,
    at_stations: _AtStations,
) -> tuple[pd.DataFrame, tuple[Rejection, ...]]:
    """Return one row per pair, with the columns of its station, and the rejected pairs."""
    complete = kept_apart(completed_pairs(_without_results(pairs), building))
    placed, rejected = assigned(complete, ground.stations, screening.largest_distance)
    tables = []
    # pairs far from every record and nearer to a station with amplitudes
    if ground.amplitudes is not None:
        rows, placed, rejected = _by_amplitudes(complete, placed, rejected, ground, screening)
        tables += [rows] if len(rows) else []
    if len(placed):
        rows = _rows_at_stations(placed.reset_index(drop=True), ground, screening, at_stations)
        tables.append(rows)
    # pairs without a station in reach fall back on the map
    if ground.shakemap is not None and rejected:
        rest = complete[complete["pair_id"].isin([rejection.name for rejection in rejected])]
        mapped, rejected = shakemap_rows(ground.shakemap, rest, screening, rejected)
        tables += [mapped] if len(mapped) else []
    if not tables:
        return placed[:0], rejected
    return without_gap(pd.concat(tables, ignore_index=True)), rejected


def _by_amplitudes(
    pairs: pd.DataFrame,
    placed: pd.DataFrame,
    rejected: tuple[Rejection, ...],
    ground: RegionalMotion,
    screening: Screening,
) -> tuple[pd.DataFrame, pd.DataFrame, tuple[Rejection, ...]]:
    """Return the rows that amplitudes give, and the pairs with a station and the others left."""
    assert ground.amplitudes is not None  # asked for with amplitudes only
    near = amplitudes_in_reach(ground.amplitudes, pairs, screening.largest_distance)
    to_record = placed["distance"].reindex(pairs.index).fillna(np.inf)
    served = served_by_amplitudes(near.distance, to_record.to_numpy(np.float64), screening)
    chosen_pairs = pairs[served].reset_index(drop=True)
    rows = (
        amplitude_rows(ground.amplitudes, chosen_pairs, screening) if served.any() else placed[:0]
    )
    # the others, with the reason of the amplitudes after that of the stations
    names = {*chosen_pairs["pair_id"]}
    why = dict(zip(pairs["pair_id"], near.reasons, strict=True))
    is_alone = not ground.stations.names.size
    left = tuple(
        one._replace(reasons=(*(() if is_alone else one.reasons), why[one.name]))
        for one in rejected
        if one.name not in names
    )
    return rows, placed[~placed["pair_id"].isin(names)], left


def _without_results(pairs: pd.DataFrame) -> pd.DataFrame:
    """Return the pairs without columns of results: an earlier risk table may be the pair table."""
    flags = {f"raised_{flag}" for flag in FLAGS}
    results = {*RESULTS, *rule_columns(), *INTERMEDIATE, *KEYS, *flags}
    return pairs.drop(columns=[name for name in pairs if name in results])


def _rows_at_stations(
    pairs: pd.DataFrame, ground: RegionalMotion, screening: Screening, at_stations: _AtStations
) -> pd.DataFrame:
    index = pairs["station_index"].to_numpy(np.int64)
    if ground.field is not None:
        pairs = pairs.assign(**motion_at_pairs(ground.field, pairs, index))
    # as arrays: records need no other columns than these
    known: Columns = {}
    for name in pairs:
        if name == "derived" or is_numeric_dtype(pairs[name]):
            known[str(name)] = pairs[name].to_numpy()
    # some stations after the other
    parts = []
    for served in _served_together(index, ground):
        rows = np.concatenate([one.rows for one in served])
        parts.append((rows, at_stations(served, chosen(known, rows), screening)))
    # All at once: columns that are inserted one by one fragment a table
    columns = pd.DataFrame(joined(parts), index=pairs.index)
    return _with_states_and_flags(pd.concat([pairs, columns], axis=1), screening)


def _served_together(index: IndexArray, ground: RegionalMotion) -> Iterator[list[_Served]]:
    """Yield stations whose pairs are computed together: a call of NumPy on few takes as long."""
    order, numbers = np.argsort(index, kind="stable"), np.unique(index)
    starts = np.searchsorted(index[order], numbers)
    # in the order of their numbers
    together = list[_Served]()
    for number, rows in zip(numbers.tolist(), np.split(order, starts[1:]), strict=True):
        one = _Served(ground.stations.read(number), ground.stations.motion(number), rows)
        if together and not _goes_with(one, together):
            yield together
            together = []
        together.append(one)
    yield together


def _goes_with(one: _Served, together: Sequence[_Served]) -> bool:
    """Return whether the pairs of a station are computed with those of others."""
    first, count = together[0].motion, sum(other.rows.size for other in together)
    few = count < TOGETHER and len(together) < STATIONS_TOGETHER
    are_two = one.motion.horizontals == first.horizontals == 2
    return few and are_two and one.motion.grid == first.grid


def _record_columns(served: Sequence[_Served], pairs: Columns, screening: Screening) -> Columns:
    """
    Compute the columns that need the records of stations, flags as booleans ``raised_...``.

    Pairs are those of the first station, then those of the second and so on.
    """
    given, (station, pairs) = pairs, _joined(served, pairs)
    table = _demands(station, pairs, screening)
    # measures, flags and population follow from the demand
    table |= mitigation_columns(station, table, screening.target_amplification)
    raised = _raised(served, table, screening)
    table |= record_population(station, table, screening)
    table["probability"] = _not_less_by_assumption(station, pairs, table, screening)
    table |= {f"raised_{flag}": rows for flag, rows in raised.items()}
    return {name: column for name, column in table.items() if name not in given}


def _chance_columns(served: Sequence[_Served], pairs: Columns, screening: Screening) -> Columns:
    """Compute the columns that need records and decide the chance of contact; pairs as above."""
    given, (station, pairs) = pairs, _joined(served, pairs)
    table = _demands(station, pairs, screening, histories=False)
    table |= record_population(station, table, screening)
    table["probability"] = _not_less_by_assumption(station, pairs, table, screening)
    # Measures that flags are read from
    nothing = np.full(len(table["gap"]), np.nan)
    table |= dict.fromkeys(("supplemental_damping", "bumper_restitution"), nothing)
    return {name: column for name, column in table.items() if name not in given}


def _joined(served: Sequence[_Served], pairs: Columns) -> tuple[StationMotion, Columns]:
    """Return stations as one, and their pairs with the number of the station of each."""
    counts = [one.rows.size for one in served]
    # No azimuth of a pair is one of sensors that point nobody knows where
    lacking = np.repeat([lacks_azimuths(one.dataset) for one in served], counts)
    known = {
        "azimuth": np.where(lacking, np.nan, pairs["azimuth"]),
        "station_index": np.repeat(np.arange(len(served)), counts),
    }
    return joined_stations([one.motion for one in served]), pairs | known


def _raised(served: Sequence[_Served], table: Columns, screening: Screening) -> Columns:
    """Return a mask of rows per flag of the records, whose pairs follow each other."""
    parts, first = [], 0
    for dataset, _, rows in served:
        # views of its own rows
        own = slice(first, first + rows.size)
        some = {name: column[own] for name, column in table.items()}
        parts.append((np.arange(own.start, own.stop), raised_by_record(some, dataset, screening)))
        first = own.stop
    return joined(parts)


def _demands(
    station: StationMotion, pairs: Columns, screening: Screening, histories: bool = True
) -> Columns:
    """Compute the demand, by groups of pairs whose azimuth is found alike."""
    parts = []
    for rows, motion, azimuth_rule in _motions(station, pairs, screening.exact):
        group = chosen(pairs, rows)
        demands = demand_columns(station, group, motion, azimuth_rule, screening.exact, histories)
        parts.append((rows, demands))
    return joined(parts)


def _not_less_by_assumption(
    station: StationMotion, pairs: Columns, table: Columns, screening: Screening
) -> FloatArray:
    """
    Return the probability of contact, above a ``no`` where only an assumed strength makes it one.

    It is that of linear buildings there, up to the smallest of the next state.
    """
    probability, smallest = values(table, "probability").copy(), screening.states.unlikely
    # the same pairs under the same motion again, as if they stayed linear
    is_assumed = np.any(strength_is_assumed(pairs), axis=0)
    rows = np.flatnonzero(is_assumed & (probability < smallest))
    if rows.size:
        block, found = chosen(pairs, rows), chosen(table, rows)
        motion, azimuth_rule = motion_found(found), found["azimuth_rule"]
        pairs = block | stay_linear(block)
        linear = demand_columns(
            station, pairs, motion, azimuth_rule, screening.exact, histories=False
        )
        chance = record_population(station, linear, screening)["probability"]
        probability[rows] = np.maximum(probability[rows], np.minimum(chance, smallest))
    return probability


def _motions(
    station: StationMotion, pairs: Columns, exact: bool
) -> Iterator[tuple[IndexArray, PairMotion, str]]:
    """Yield rows of pairs with their motion and the rule by which their azimuth is found."""
    azimuth = values(pairs, "azimuth")
    if station.horizontals == 1:
        yield np.arange(azimuth.size), motion_of_one_horizontal(station, pairs), "station"
        return
    unknown, decides = np.isnan(azimuth), exact & exact_decides(station, pairs)
    given = np.flatnonzero(~unknown)
    if given.size:
        motion = motion_along_azimuths(station, chosen(pairs, given), azimuth[given])
        yield given, motion, "given"
    # unknown azimuth where the exact demand decides: the axis that the record makes worst
    worst = np.flatnonzero(unknown & decides)
    if worst.size:
        block = chosen(pairs, worst)
        yield (
            worst,
            motion_along_azimuths(station, block, furthest_azimuth(station, block)),
            "worst",
        )
    # unknown azimuth where an estimate decides: every azimuth
    worst = np.flatnonzero(unknown & ~decides)
    for first in range(0, worst.size, BLOCK):
        rows = worst[first : first + BLOCK]
        yield rows, motion_along_every_azimuth(station, chosen(pairs, rows)), "worst"


def _with_states_and_flags(table: pd.DataFrame, screening: Screening) -> pd.DataFrame:
    """Return the table with all columns that need no record: state, class, flags, code rules."""
    table = table.assign(**state_columns(table, screening))
    # flags of the record and of the pairs, joined to one text
    by_record = {flag: f"raised_{flag}" for flag in FLAGS if f"raised_{flag}" in table}
    raised = {flag: table[name].to_numpy(dtype=bool) for flag, name in by_record.items()}
    flags = joined_flags(raised_by_pairs(table) | raised)
    rules = code_columns(table, *at_contact(table, "sd"), codes=screening.codes)
    dropped = [*INTERMEDIATE, *by_record.values(), *(name for name in table if name == ODD)]
    return table.drop(columns=dropped).assign(flags=flags).join(rules)


def _ordered(table: pd.DataFrame) -> pd.DataFrame:
    """Return the leading columns in their order, then the others."""
    first = [name for name in ORDER if name != "rank"]
    return table[[*first, *(name for name in table if name not in ORDER)]]


#: Defaults of the configuration.
BUILDING, SCREENING = Building(), Screening()


def risk_table(
    spectra: xr.Dataset | Sequence[xr.Dataset],
    pairs: pd.DataFrame,
    building: Building = BUILDING,
    screening: Screening = SCREENING,
) -> pd.DataFrame:
    """
    Compute ground motion, demand, state and severity of pairs: one row per pair, worst first.

    Parameters
    ----------
    spectra : Dataset or sequence of Dataset
        Stations, from :func:`per_obspy.station_spectra`.
    pairs : DataFrame
        From :func:`per_obspy.read_pairs`.
    building : Building
        Assumptions for values that the inventory lacks.
    screening : Screening
        Distances, and thresholds of flags and classes.

    Returns
    -------
    DataFrame
        Columns in the order of ``screening.columns.ORDER``, then the other columns of the pair
        table. ``attrs["rejected"]`` holds a :class:`~per_obspy.errors.Rejection` for every pair
        without a station in reach.

    Raises
    ------
    TypeError
        If an argument is of another type.
    CatalogError
        If the pairs lack a column that every pair needs, as an empty DataFrame does.
    """
    datasets = _datasets(spectra)
    _require("pairs", pairs, pd.DataFrame, "a DataFrame from read_pairs")
    check_columns([str(name) for name in pairs], "pairs")
    if "pair_id" not in pairs:
        raise CatalogError("pairs", "missing column pair_id: read_pairs names rows without one")
    _require("building", building, Building, "a Building")
    _require("screening", screening, Screening, "a Screening")
    stations, unlocated = stations_of(datasets)
    located = [stations.read(index) for index in range(stations.names.size)]
    # motion between the stations, for pairs at a distance from theirs
    source = hypocentre_of(station.attrs for station in located)
    field = prepared_field(located, screening.interpolation, source) if located else None
    rows, unreached = risk_rows(pairs, RegionalMotion(stations, field, None), building, screening)
    # ranked as the tables of a run are
    table = worst_first(rows)
    table = table[["rank", *(name for name in table if name != "rank")]]
    table.attrs["rejected"] = (*pairs.attrs.get("rejected", ()), *unlocated, *unreached)
    return table


def _datasets(spectra: object) -> list[xr.Dataset]:
    expected = "a Dataset from station_spectra, or a sequence of such"
    if isinstance(spectra, xr.Dataset):
        return [spectra]
    # text and tables are iterable too, but hold no stations
    if not isinstance(spectra, Iterable) or isinstance(spectra, (str, pd.DataFrame, xr.DataArray)):
        raise TypeError(f"spectra must be {expected}, got {type(spectra).__name__}")
    stations = list(spectra)
    for index, station in enumerate(stations):
        _require(f"spectra[{index}]", station, xr.Dataset, "a Dataset from station_spectra")
    return stations


def _require(name: str, value: object, kind: type, expected: str) -> None:
    """Raise TypeError if an argument is of another type."""
    if not isinstance(value, kind):
        raise TypeError(f"{name} must be {expected}, got {type(value).__name__}")
