"""Simulated pairs predicted from stations, and their outcome in the true motion."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from paper_records import CHECKOUT

from per_obspy import pounding_histories, process, station_spectra
from per_obspy.checks import FloatArray
from per_obspy.config import Building, Interpolation, Scenario, Screening, Simulation, load
from per_obspy.errors import RecordRejected
from per_obspy.inventory.checking import checked_pairs
from per_obspy.screening.assignment import nearest_station, stations_of
from per_obspy.screening.motion_field import great_circle, residual_correlation
from per_obspy.screening.risk import risk_rows
from per_obspy.screening.site_motion import (
    Hypocentre,
    RegionalMotion,
    prepared_field,
)
from per_obspy.screening.values import both, values
from per_obspy.simulation.buildings import simulated_pairs
from per_obspy.simulation.earthquake import GAIN, simulate

#: Magnitudes of the earthquakes, one after the other.
MAGNITUDES = (6.5, 7.0, 7.5)

#: Metres between a pair and its site, share of pairs that touch, share of pairs whose buildings
#: yield.
NEAR, TOUCHING_SHARE, YIELDING_SHARE = 1.0, 0.1, 0.15

#: Share of pairs whose gap was estimated only, and how well: standard deviation over mean.
ESTIMATED, GAP_STD = 0.3, 0.3

#: Base shear coefficients of the buildings that yield, and their hardening.
STRENGTHS, HARDENING = (0.03, 0.3), 0.05

#: Where pairs stand: the last in motion that varies over the city as the interpolation assumes.
PLACES = ("at a station", "between stations", "between, motion varied")

#: Kinds of pairs; periods count as given where both are. All but the last leave a gap.
APART, YIELDING, TOUCHING = "all that leave a gap", "buildings that yield", "touching"
KINDS = (
    APART, "periods and gap given", "periods given, gap estimated", "periods derived",
    "of these, equal buildings",
    YIELDING, TOUCHING,
)  # fmt: skip

#: What is kept of the risk table.
KEPT = (
    "site", "probability", "demand_rule", "demand_exact", "demand_two_sided", "critical_gap_per",
    "critical_gap_record",
    "critical_gap_sd", "critical_gap_linearized",
)  # fmt: skip

#: What is assumed of buildings.
BUILDING = Building()

#: Log-standard deviation of amplitudes that vary over the city, and the period (s) whose spatial
#: correlation they have.
AMPLITUDE, CORRELATED_AS = 0.5, 1.0


class Site(NamedTuple):
    """A place with its true motion: degrees, kind of ground, north and east (m/s²), step (s)."""

    longitude: float
    latitude: float
    site_class: str
    motion: FloatArray
    dt: float


class Network(NamedTuple):
    """An earthquake at places with and without a station, and the true motion of all of them."""

    scenario: Scenario
    stations: list[xr.Dataset]
    recorded: list[Site]
    hidden: list[Site]


def cases(event: int, stations: int, hidden: int, count: int) -> pd.DataFrame:
    """
    Return pairs of one earthquake: columns of the risk table, and whether they ``pounded``.

    Parameters
    ----------
    event : int
        Number of the earthquake, and the seed of its random numbers.
    stations, hidden : int
        Number of places with a station and without.
    count : int
        Number of pairs at the former, at the latter, and at the latter once more in motion that
        varies as assumed.

    Returns
    -------
    DataFrame
        ``event``, ``place`` (one of ``PLACES``), ``site`` (its number there), ``pounded``, the
        columns ``KEPT`` of the risk table, and whether each pair is of each of the ``KINDS``.
    """
    plain, varied = (network(event, stations, hidden, varies) for varies in (False, True))
    places = ((plain, plain.recorded), (plain, plain.hidden), (varied, varied.hidden))
    told = []
    for place, (known, sites) in zip(PLACES, places, strict=True):
        rows = predicted(known, sites, count, event)
        pounded = outcomes(rows, sites, event)
        told.append(rows[[*KEPT]].assign(event=event, place=place, pounded=pounded, **kinds(rows)))
    return pd.concat(told, ignore_index=True)


def kinds(rows: pd.DataFrame) -> dict[str, NDArray[np.bool_]]:
    """Return which pairs are of each of the ``KINDS``."""
    apart, estimated = values(rows, "gap") > 0, values(rows, "gap_std") > 0
    spread, period = np.stack(both(rows, "period_log_std")), both(rows, "period")
    given, alike = ~(spread > 0).any(axis=0), (spread > 0).all(axis=0) & (period[0] == period[1])
    yields = np.isfinite(np.stack(both(rows, "yield_displacement"))).any(axis=0)
    masks = (
        apart,
        apart & given & ~estimated,
        apart & given & estimated,
        apart & ~given & ~yields,
        apart & alike & ~yields,
        apart & yields,
        ~apart,
    )
    return dict(zip(KINDS, masks, strict=True))


def network(event: int, stations: int, hidden: int, varied: bool) -> Network:
    """
    Simulate an earthquake of the demonstration's city.

    Parameters
    ----------
    event : int
        Its number, and the seed of its random numbers.
    stations, hidden : int
        Number of places with a station and without.
    varied : bool
        Whether amplitudes vary over the city as the interpolation assumes; the simulation alone
        gives every place noise of its own.
    """
    magnitude = MAGNITUDES[event % len(MAGNITUDES)]
    demo = load(CHECKOUT / "catalogs" / "demo" / "scenario.toml", Simulation).scenario
    scenario = demo.model_copy(
        update={"seed": event, "magnitude": magnitude, "stations": stations + hidden}
    )
    stream = simulate(scenario).stream
    codes = [f"S{number + 1:03d}" for number in range(stations + hidden)]
    places = [stream.select(station=code) for code in codes]
    if varied:
        for place, factor in zip(places, _amplitudes(places, event), strict=True):
            for trace in place:
                trace.data = trace.data * factor
    sites = [_site(place) for place in places]
    known, recorded = [], []
    for place, site in zip(places[:stations], sites[:stations], strict=True):
        try:
            known.append(station_spectra(process(place)))
        except RecordRejected as error:
            # as in a run: a simulated lakebed can move in steps that look clipped
            print(error)
        else:
            recorded.append(site)
    return Network(scenario, known, recorded, sites[stations:])


def _site(place) -> Site:
    north, east = (place.select(channel=f"HN{direction}")[0] for direction in "NE")
    where, motion = north.stats.coordinates, np.stack([north.data, east.data]) / GAIN
    return Site(where.longitude, where.latitude, north.stats.site_class, motion, north.stats.delta)


def _amplitudes(places: Sequence, seed: int) -> FloatArray:
    """Return one factor a place, lognormal with median 1, correlated in space."""
    where = [place[0].stats.coordinates for place in places]
    east, north = (
        np.array([getattr(one, name) for one in where]) for name in ("longitude", "latitude")
    )
    between = great_circle(east[:, None], north[:, None], east[None, :], north[None, :])
    root = np.linalg.cholesky(residual_correlation(between, CORRELATED_AS, vs30_clustered=False))
    return np.exp(AMPLITUDE * root @ np.random.default_rng([seed, 2]).standard_normal(len(places)))


def predicted(
    known: Network, sites: Sequence[Site], count: int, seed: int, building: Building = BUILDING
) -> pd.DataFrame:
    """Return the risk table of pairs at sites, made from the stations alone, and their ``site``."""
    east, north = (
        np.array([getattr(site, name) for site in sites]) for name in ("longitude", "latitude")
    )
    raw = simulated_pairs(east, north, count, seed, NEAR, TOUCHING_SHARE)
    site = nearest_station(values(raw, "longitude_1"), values(raw, "latitude_1"), east, north)[0]
    raw = raw.assign(
        site=site, site_class=[sites[one].site_class for one in site], **_more(raw, seed)
    )
    pairs = checked_pairs(raw, "simulated pairs")
    stations, _ = stations_of(known.stations)
    source = Hypocentre(known.scenario.longitude, known.scenario.latitude, known.scenario.depth)
    field = prepared_field(known.stations, Interpolation(), source)
    rows, _ = risk_rows(pairs, RegionalMotion(stations, field, None), building, Screening())
    return rows.sort_values("pair_id", ignore_index=True)


def _more(raw: pd.DataFrame, seed: int) -> dict[str, FloatArray]:
    """Return columns missing from the simulated inventory: estimated gaps, yielding buildings."""
    generator = np.random.default_rng([seed, 3])
    estimated, yields = (
        generator.random(len(raw)) < ESTIMATED,
        generator.random(len(raw)) < YIELDING_SHARE,
    )
    strengths = np.where(yields, generator.uniform(*STRENGTHS, (2, len(raw))), np.nan)
    columns = {f"yield_coefficient_{i}": strengths[i - 1] for i in (1, 2)}
    columns |= {f"hardening_{i}": np.where(yields, HARDENING, np.nan) for i in (1, 2)}
    return columns | {"gap_std": np.where(estimated, GAP_STD * values(raw, "gap"), 0.0)}


def outcomes(rows: pd.DataFrame, sites: Sequence[Site], seed: int) -> NDArray[np.bool_]:
    """Return whether each pair pounds, with its true gap and buildings in its site's motion."""
    true = _true_pairs(rows, np.random.default_rng([seed, 4]))
    pounded = np.empty(len(rows), dtype=bool)
    for number, some in true.groupby("site"):
        site = sites[number]
        history = pounding_histories(site.motion, site.dt, *_arguments(some))
        pounded[some.index] = history.impact_velocity > 0.0
    return pounded


def _true_pairs(rows: pd.DataFrame, generator: np.random.Generator) -> pd.DataFrame:
    """Draw true periods, dampings and gaps from the table's uncertainties."""
    true = rows.copy()
    deviates = generator.standard_normal((6, len(rows)))
    # alike neighbours miss a period formula alike
    shared = values(rows, "period_correlation")
    deviates[2] = shared * deviates[0] + np.sqrt(1.0 - shared**2) * deviates[2]
    for i in (1, 2):
        for number, name in enumerate(("period", "damping"), start=2 * i - 2):
            scatter = values(rows, f"{name}_log_std_{i}") * deviates[number]
            true[f"{name}_{i}"] = values(rows, f"{name}_{i}") * np.exp(scatter)
        # a given strength is exact: the displacement at yield follows the true period; an assumed
        # one is that displacement
        assumed = values(rows, f"yield_log_std_{i}")
        follows = (true[f"period_{i}"] / rows[f"period_{i}"]) ** 2
        true[f"yield_displacement_{i}"] *= np.where(
            assumed > 0.0, np.exp(assumed * deviates[3 + i]), follows
        )
    spread = values(rows, "gap_std") / np.where(rows["gap"] > 0, rows["gap"], 1.0)
    width = np.sqrt(np.log1p(spread**2))
    true["gap"] *= np.exp(width * generator.standard_normal(len(rows)) - width**2 / 2.0)
    return true


def _arguments(pairs: pd.DataFrame) -> Iterator[FloatArray]:
    """Yield the arguments of a pounding history in their order."""
    for i in (1, 2):
        yield from (values(pairs, f"{name}_{i}") for name in ("period", "damping", "contact_mass"))
    yield from (values(pairs, name) for name in ("gap", "restitution"))
    shares = both(pairs, "participation")
    yield from (*shares, values(pairs, "azimuth"))
    for i, share in enumerate(shares, start=1):
        yield from (
            share * values(pairs, f"yield_displacement_{i}"),
            values(pairs, f"hardening_{i}"),
        )
