"""Stations of real earthquakes left out one by one: demand as the table has it, and as it was."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import pandas as pd
import xarray as xr
from calibration_events import RealEvent

from per_obspy.config import Building, Screening
from per_obspy.inventory.checking import checked_pairs
from per_obspy.screening.assignment import stations_of
from per_obspy.screening.risk import risk_rows
from per_obspy.screening.site_motion import (
    RegionalMotion,
    hypocentre_of,
    prepared_field,
)
from per_obspy.screening.station_motion import station_motion
from per_obspy.screening.uncertain_motion import median_at_site, site_demand
from per_obspy.screening.values import values

#: Periods whose pairs are screened, s: shortest, longest, number.
PERIODS = (0.2, 4.0, 9)

#: Dampings of both buildings, taken in turn.
DAMPINGS = ((0.05, 0.05), (0.02, 0.05), (0.05, 0.1))

#: Axes from 1 to 2, degrees, and one that is unknown.
AZIMUTHS = (0.0, 90.0, 180.0, 270.0, np.nan)

#: Gaps over the demand of the record that serves the pair, which is known before.
GAPS = (0.35, 0.6, 1.0, 1.6, 2.8)

#: Kinds of pairs by what decides their demand.
EXACT, WORST, ESTIMATE = "exact, azimuth given", "exact, azimuth unknown", "estimate"

#: A gap that no pair closes, m.
OPEN = 9.0

#: Building, and screening without a limit of the distance.
BUILDING = Building()
SCREENING = Screening(largest_distance=2e7)


def left_out(event: RealEvent, screening: Screening = SCREENING) -> pd.DataFrame:
    """
    Leave every station of an earthquake out, and predict the demand at its place from the others.

    Parameters
    ----------
    event : RealEvent
        At least two stations.
    screening : Screening
        Settings of the screening.

    Returns
    -------
    DataFrame
        One row per pair, place and gap: ``event``, ``station``, ``record``, ``distance`` (m),
        ``kind``, ``gap`` (m), ``true`` (demand of the left-out record, m), ``probability``,
        ``ln_median`` and ``log_std`` of the demand (exact kinds), and of the same record without a
        weight and without the deviation of the transfer ``ln_record``, ``record_log_std``.
    """
    tables = []
    for index, station in enumerate(event.stations):
        others = [*event.stations[:index], *event.stations[index + 1 :]]
        source = hypocentre_of(other.attrs for other in event.stations)
        field = prepared_field(others, screening.interpolation, source)
        ground = RegionalMotion(stations_of(others)[0], field, None)
        place = {"event": event.name, "station": str(station["station"].item())}
        # a record may support no pair at all
        tables += [table.assign(**place) for table in _at_place(station, others, ground, screening)]
    return pd.concat(tables, ignore_index=True)


def _at_place(
    station: xr.Dataset, others: list[xr.Dataset], ground: RegionalMotion, screening: Screening
) -> Iterator[pd.DataFrame]:
    """Yield the rows of one place, those decided by the exact demand and those by an estimate."""
    # the truth is the exact demand of the record that was left out
    pairs = _pairs(station)
    itself = prepared_field([station], screening.interpolation)
    own = RegionalMotion(stations_of([station])[0], itself, None)
    true = _exact(pairs, own, screening)["demand_exact"]
    rows = _exact(pairs, ground, screening)
    known = rows.index.intersection(true.index)
    rows, true = rows.loc[known], true.loc[known]
    if not len(rows):
        return
    # gaps at several multiples of a demand that is known without the left-out record
    names = [str(other["station"].item()) for other in others]
    predicted = _predicted(rows, dict(zip(names, others, strict=True)), screening).assign(true=true)
    for share in GAPS:
        gaps = share * rows["demand_exact"]
        spread = pairs.set_index("pair_id").loc[known].assign(gap=gaps).reset_index()
        exact = _probability(spread, ground, screening)
        kinds = np.where(rows["azimuth"].isna(), WORST, EXACT)
        yield predicted.assign(gap=gaps, probability=exact, kind=kinds)
        estimates = screening.model_copy(update={"exact": False})
        estimate = _probability(spread, ground, estimates)
        known_axis = rows["azimuth"].notna()
        rest = predicted.assign(gap=gaps, probability=estimate, kind=ESTIMATE)
        yield rest.assign(ln_median=np.nan, log_std=np.nan)[known_axis]


def _pairs(station: xr.Dataset) -> pd.DataFrame:
    """Return pairs of buildings at a station: pairs of periods, each along every axis."""
    rows = []
    shortest, longest, count = PERIODS
    periods = combinations(np.geomspace(shortest, longest, count).tolist(), 2)
    for number, (period_1, period_2) in enumerate(periods):
        for turn, azimuth in enumerate(AZIMUTHS):
            damping_1, damping_2 = DAMPINGS[(number + turn) % len(DAMPINGS)]
            rows.append((period_1, period_2, damping_1, damping_2, azimuth))
    names = ["period_1", "period_2", "damping_1", "damping_2", "azimuth"]
    table = pd.DataFrame(rows, columns=names)
    # both buildings are oscillators at the station itself
    east, north = float(station["longitude"]), float(station["latitude"])
    places = {f"longitude_{i}": east for i in (1, 2)} | {f"latitude_{i}": north for i in (1, 2)}
    shape = {f"{name}_{i}": 10.0 for name in ("height",) for i in (1, 2)}
    shape |= {f"participation_{i}": 1.0 for i in (1, 2)}
    table = table.assign(**places, **shape, gap=OPEN)
    velocity = float(station["vs30"])
    if np.isfinite(velocity):
        table = table.assign(vs30=velocity)
    return table.assign(pair_id=[f"P{number:04d}" for number in range(len(table))])


def _table(pairs: pd.DataFrame, ground: RegionalMotion, screening: Screening) -> pd.DataFrame:
    """Return the rows of the risk table by the names of the pairs."""
    checked = checked_pairs(pairs, "pairs of the calibration")
    rows, _ = risk_rows(checked, ground, BUILDING, screening)
    return rows.set_index("pair_id").sort_index()


def _exact(pairs: pd.DataFrame, ground: RegionalMotion, screening: Screening) -> pd.DataFrame:
    """Return the rows whose exact demand decides: the record supports both periods."""
    rows = _table(pairs, ground, screening)
    return rows[(rows["demand_rule"] == "exact") & (rows["demand_exact"] > 0)]


def _probability(pairs: pd.DataFrame, ground: RegionalMotion, screening: Screening) -> pd.Series:
    """Return the probability of pounding by the names of the pairs."""
    return _table(pairs, ground, screening)["probability"]


def _predicted(
    rows: pd.DataFrame, stations: dict[str, xr.Dataset], screening: Screening
) -> pd.DataFrame:
    """Return median and deviation of ln of the demand at the place, as the probability has it."""
    parts = []
    for name, some in rows.groupby("station"):
        station = station_motion(stations[str(name)])
        site, exact = site_demand(station, some, screening), values(some, "demand_exact")
        median = median_at_site(exact, site.weight, site.ln_ratio, site.ln_field)
        table = pd.DataFrame(
            {
                "record": name,
                "distance": values(some, "distance"),
                "ln_median": np.log(median),
                "log_std": site.log_std,
                "ln_record": np.log(exact) + site.ln_ratio,
                "record_log_std": site.field_log_std,
                "ln_field": site.ln_field,
            },
            index=some.index,
        )
        parts.append(table)
    return pd.concat(parts).loc[rows.index]
