"""
Compare populations of pairs with draws of exact histories on real records (25 minutes).

    python workflows/population_accuracy.py

writes the tables below the heading ``Measured`` of ``docs/population.md``. Each pair is screened at
the station itself. Then periods, dampings and gap are drawn as uncertain as the pair table has them
and every draw is a pounding history in the same record: probability of contact, mean and quantile
of the impact velocity and mean amplification of the draws are what the population should be.
"""

import argparse
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from paper_records import CHECKOUT, data_folder

from per_obspy import pounding_histories, process, risk_table, station_spectra
from per_obspy.config import Screening
from per_obspy.inventory.checking import checked_pairs
from per_obspy.kernels.pairs.node_outcomes import QUANTILE
from per_obspy.records.folder import find_stations, read_station
from per_obspy.records.text_table import read_columns
from per_obspy.screening.population import COLUMNS, gap_dispersion, median_gap

#: Folders of records: events by which the loss of ``severity.py`` was fitted, and others.
FITTED = ("mexico1985_sct", "maule2010_renadic", "aomori2018_knet")
OTHERS = ("kaikoura2016_geonet", "ridgecrest2019_mseed", "itaca2009", "afad2023", "cwb2021")

#: Stations of an event and pairs of a station at most, draws of a pair, and the heading below which
#: the page is the script's.
STATIONS, PAIRS, DRAWS, MEASURED = 2, 16, 4096, "## Measured"

#: Columns that draws have too; the others are quantiles of the demand.
OUTCOMES = COLUMNS[:4]

#: Draws of pairs that can yield: their histories take ten times as long.
YIELDING_DRAWS = 256

#: Given periods (s), and heights (m) from which periods are derived.
PERIODS = ((0.5, 0.52), (0.4, 0.4), (1.2, 1.2), (0.3, 0.8), (0.7, 1.1), (2.0, 1.7), (1.0, 2.5))
HEIGHTS = ((9.0, 9.0), (18.0, 18.0), (9.0, 15.0), (30.0, 12.0), (45.0, 36.0))

#: Gap over the demand of SRSS.
GAPS = (0.0, 0.1, 0.4, 0.9)

#: Linear groups of pairs, in the order of the tables.
KINDS = ("damping assumed", "periods given with deviation", "periods derived", "yielding")


def stations(event: str) -> Iterator[xr.Dataset]:
    """Yield the strongest stations of an event with two horizontals."""
    folder = data_folder() / "records" / event
    if event == "mexico1985_sct":
        place = {"network": "MX", "station": "SCT", "latitude": 19.393, "longitude": -99.147}
        channels = {"HNN": 1, "HNE": 2}
        streams = [
            read_columns(
                folder / "sct190985.txt", **place, units="g", time_column=0, channels=channels
            )
        ]
    else:
        found = find_stations(folder)
        streams = [
            read_station(files, found.inventory, name)[0] for name, files in found.stations.items()
        ]
    usable = []
    for stream in streams:
        try:
            # some formats have no coordinates, which do not matter: all pairs are at the station
            placed = station_spectra(process(stream)).assign_coords(latitude=10.0, longitude=20.0)
            usable.append(placed)
        except ValueError as error:
            print(f"left out: {error}")
    usable = [station for station in usable if station.sizes["horizontal"] == 2]
    usable.sort(key=lambda station: -float(abs(station["acceleration"]).max()))
    yield from usable[:STATIONS]


def screened(station: xr.Dataset, number: int) -> pd.DataFrame:
    """Return the risk table of pairs of every kind at a station."""
    rows = []
    for (period_1, period_2), gap in product(PERIODS, GAPS):
        given = {"period_1": period_1, "period_2": period_2, "share": gap}
        rows.append(given | {"kind": KINDS[0]})
        deviation = {"period_log_std_1": 0.2, "period_log_std_2": 0.2}
        rows.append(given | deviation | {"kind": KINDS[1]})
        if gap and period_1 != period_2:
            rows.append(given | {"kind": KINDS[3]})
    for (height_1, height_2), gap in product(HEIGHTS, GAPS):
        heights = {"height_1": height_1, "height_2": height_2}
        rows.append(heights | {"share": gap, "kind": KINDS[2]})
    random = np.random.default_rng(number)
    table = pd.DataFrame(rows).sample(PAIRS, random_state=random).reset_index(drop=True)
    table["pair_id"] = [f"{index:03}" for index in range(len(table))]
    table["azimuth"] = random.uniform(0.0, 360.0, len(table))
    table["mass_2"], table["mass_1"] = np.exp(random.normal(0.0, 0.5, len(table))) * 1e6, 1e6
    for i, side in ((1, -1e-6), (2, 1e-6)):
        table[f"latitude_{i}"] = float(station["latitude"])
        table[f"longitude_{i}"] = float(station["longitude"]) + side
        table[f"participation_{i}"] = 1.0
    # gaps relative to the demand, strengths relative to the displacement of elastic buildings
    first = risk_table(station, checked_pairs(table.assign(gap=0.0), "none")).set_index("pair_id")
    table = table[table["pair_id"].isin(first.index)]
    at = first.loc[table["pair_id"]]
    table["gap"] = table["share"].to_numpy() * at["srss_gap"].to_numpy()
    table["gap_std"] = np.where(table["share"] == 0.4, 0.2 * table["gap"], 0.0)
    yields = (table["kind"] == KINDS[3]).to_numpy()
    table["yield_displacement_1"] = np.where(yields, at["sd_1"] / 3.0, np.nan)
    pairs = checked_pairs(table, "none")
    screened = risk_table(station, pairs)
    # what the estimates alone give, as without a record that supports the pair
    estimated = risk_table(station, pairs, screening=Screening(exact=False)).set_index("pair_id")
    for name in OUTCOMES:
        screened[f"estimated_{name}"] = estimated.loc[screened["pair_id"], name].to_numpy()
    return screened


def drawn(station: xr.Dataset, pair: pd.Series, random: np.random.Generator) -> dict[str, float]:
    """Return the columns of a population from exact histories of drawn buildings and gaps."""
    count = YIELDING_DRAWS if pair["kind"] == KINDS[3] else DRAWS
    normal = random.normal(size=(5, count))
    # alike neighbours miss a period formula alike
    shared = pair["period_correlation"]
    normal[2] = shared * normal[0] + np.sqrt(1.0 - shared**2) * normal[2]
    row = pd.DataFrame([pair])
    gap = median_gap(row)[0] * np.exp(gap_dispersion(row)[0] * normal[4])
    oscillators = []
    for i in (1, 2):
        period = pair[f"period_{i}"] * np.exp(pair[f"period_log_std_{i}"] * normal[2 * i - 2])
        damping = pair[f"damping_{i}"] * np.exp(pair[f"damping_log_std_{i}"] * normal[2 * i - 1])
        oscillators += [period, np.minimum(damping, 0.99), pair[f"contact_mass_{i}"]]
    facts = {
        "restitution": pair["restitution"],
        "participation_1": pair["participation_1"],
        "participation_2": pair["participation_2"],
        "azimuth": np.full(count, pair["azimuth_used"]),
        "yield_displacement_1": pair["yield_displacement_1"] * pair["participation_1"],
        "hardening_1": pair["hardening_1"],
    }
    motion = station["acceleration"].to_numpy().astype(np.float64)
    dt = float(station["sampling_interval"])
    hit = pounding_histories(motion, dt, *oscillators, gap=gap, **facts)
    free = pounding_histories(motion, dt, *oscillators, gap=np.full(count, 1e3), **facts)
    amplification = np.maximum((hit.per / free.per).max(axis=0), 1.0)
    touched = hit.impact_velocity > 0.0
    values = (
        touched.mean(),
        hit.impact_velocity.mean(),
        np.quantile(hit.impact_velocity, QUANTILE),
        np.where(touched, amplification, 1.0).mean(),
    )
    return {f"drawn_{name}": float(value) for name, value in zip(OUTCOMES, values, strict=True)}


def compared(events: tuple[str, ...]) -> pd.DataFrame:
    """Return populations next to draws, of all pairs at all stations of some events."""
    rows = []
    for event in events:
        for station in stations(event):
            number = len(rows)
            table, random = screened(station, number), np.random.default_rng(number)
            names = (*OUTCOMES, *(f"estimated_{name}" for name in OUTCOMES), "kind", "gap", "share")
            for _, pair in table.iterrows():
                kept = {name: pair[name] for name in names}
                alike = abs(np.log(pair["period_1"] / pair["period_2"])) < 0.1
                rows.append(kept | {"event": event, "alike": alike} | drawn(station, pair, random))
            print(f"{event} {station.attrs.get('station', '')}: {len(table)} pairs", flush=True)
    return pd.DataFrame(rows)


def lines(table: pd.DataFrame) -> Iterator[str]:
    """Yield the rows of the table of errors by group."""
    yield (
        "| pairs | number | P: median error, 9 in 10 below | P: mean difference | within .03 | "
        "expected velocity: median error, 9 in 10 below | median ratio, ratio of sums | "
        "84 %: median error | amplification: median error, mean difference |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    fitted = table["event"].isin(FITTED)
    touching = table["share"] == 0.0
    groups = {
        "all": touching | True,
        "events of the fit": fitted,
        "other events": ~fitted,
        "touching": touching,
        "touching, periods alike": touching & table["alike"],
        "gap": ~touching,
        "gap, P from .01 to .99": ~touching & table["drawn_probability"].between(0.01, 0.99),
        **{kind: table["kind"] == kind for kind in KINDS},
    }
    for name, chosen in groups.items():
        yield f"| {name} | {_cells(table[chosen])} |"
    estimated = table.assign(**{name: table[f"estimated_{name}"] for name in OUTCOMES})
    yield f"| all, by estimates alone | {_cells(estimated)} |"
    derived = estimated["kind"] == KINDS[2]
    yield f"| periods derived, by estimates alone | {_cells(estimated[derived])} |"


def _cells(table: pd.DataFrame) -> str:
    """Return the errors of a group as cells."""
    chance = table["probability"] - table["drawn_probability"]
    # velocities of pairs that touch in one of a hundred draws
    hit = table[table["drawn_probability"] >= 0.01]
    ratio = hit["expected_impact_velocity"] / hit["drawn_expected_impact_velocity"]
    total = hit["expected_impact_velocity"].sum() / hit["drawn_expected_impact_velocity"].sum()
    high = hit[hit["drawn_impact_velocity_84"] > 0.0]
    upper = abs(high["impact_velocity_84"] / high["drawn_impact_velocity_84"] - 1.0)
    amplified = hit["expected_amplification"] - hit["drawn_expected_amplification"]
    return " | ".join(
        (
            str(len(table)),
            f"{abs(chance).median():.3f}, {abs(chance).quantile(0.9):.3f}",
            f"{chance.mean():+.3f}",
            f"{(abs(chance) <= 0.03).mean():.0%}",
            f"{_share(abs(ratio - 1.0), 0.5)}, {_share(abs(ratio - 1.0), 0.9)}",
            f"{ratio.median():.2f}, {total:.2f}",
            _share(upper, 0.5),
            f"{abs(amplified).median():.3f}, {amplified.mean():+.3f}",
        )
    )


def _share(errors: pd.Series, quantile: float) -> str:
    """Return a quantile of relative errors in per cent."""
    value: float = errors.quantile(quantile)
    return f"{value:.0%}"


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--page", type=Path, default=CHECKOUT / "docs" / "population.md")
    parser.add_argument("--pairs", type=Path, help="CSV file for the compared pairs")
    arguments = parser.parse_args()
    table = compared((*FITTED, *OTHERS))
    if arguments.pairs:
        table.to_csv(arguments.pairs, index=False)
    page = arguments.page.read_text()
    head = page[: page.index(MEASURED)]
    rest = page[page.index(MEASURED) + len(MEASURED) :]
    after = rest[rest.index("\n## ") :] if "\n## " in rest else "\n"
    arguments.page.write_text(head + "\n".join((MEASURED, "", *lines(table), after)))


if __name__ == "__main__":
    main()
