"""
Compare estimates for yielding pairs with the exact demand, in simulated motion and SCT 1985.

Run: ``python workflows/yielding_estimates.py``; prints the table of docs/screening.md: median of
estimate / exact, sigma of its logarithm, share that is too small, and share where the linearization
found no ductility.
"""

import argparse
from collections.abc import Iterator

import numpy as np
import obspy
import xarray as xr
from paper_records import CHECKOUT, data_folder

from per_obspy import process, station_spectra
from per_obspy.config import Simulation, load
from per_obspy.records.text_table import read_columns
from per_obspy.screening.estimates import demand_columns
from per_obspy.screening.station_motion import motion_along_azimuths, station_motion
from per_obspy.screening.values import Columns
from per_obspy.simulation.earthquake import simulate

#: Periods of the buildings, s; how many times weaker than elastic they are; slope after yielding /
#: before.
PERIODS, WEAKNESS, HARDENING = (0.25, 3.0), (1.5, 6.0), 0.05
ESTIMATES = {
    "elastic PER and eq. (16)": "critical_gap_per",
    "equivalent linear": "critical_gap_linearized",
    "the one that governs": "demand_estimated",
}


def simulated(stations: int) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield the stations of the demonstration's earthquake with the name of their ground."""
    scenario = load(CHECKOUT / "catalogs" / "demo" / "scenario.toml", Simulation).scenario
    stream = simulate(scenario.model_copy(update={"stations": stations})).stream
    for name in sorted({trace.stats.station for trace in stream}):
        station = station_spectra(process(stream.select(station=name)))
        yield str(station["site_class"].item()), station


def mexico_city_1985() -> Iterator[tuple[str, xr.Dataset]]:
    """Yield the station SCT, if its record is available."""
    path = data_folder() / "records" / "mexico1985_sct" / "sct190985.txt"
    if path.exists():
        place = {"network": "MX", "station": "SCT", "latitude": 19.393, "longitude": -99.147}
        stream = read_columns(
            path, **place, units="g", time_column=0, channels={"HNN": 1, "HNE": 2}
        )
        yield "SCT 1985", station_spectra(process(obspy.Stream(stream)))


def yielding_pairs(station: xr.Dataset, count: int, draw: np.random.Generator) -> Columns:
    """Return random pairs at a station, each with a yielding building, with all demands."""
    every = np.ones(count)
    pairs: Columns = {
        "azimuth": draw.uniform(0.0, 180.0, count),
        "derived": np.full(count, "", dtype=object),
    }
    pairs |= {"gap": 0.02 * every, "restitution": 0.65 * every}
    for i in (1, 2):
        pairs[f"period_{i}"] = np.exp(draw.uniform(*np.log(PERIODS), count))
        pairs |= {
            f"damping_{i}": 0.05 * every,
            f"participation_{i}": every,
            f"contact_mass_{i}": 1e6 * every,
        }
        pairs[f"hardening_{i}"] = HARDENING * every
    record = station_motion(station)
    motion = motion_along_azimuths(record, pairs, pairs["azimuth"])
    for i in (1, 2):
        pairs[f"yield_displacement_{i}"] = motion.sd[i - 1][:, 0] / np.exp(
            draw.uniform(*np.log(WEAKNESS), count)
        )
    return demand_columns(record, pairs, motion, "given", exact=True)


def row(name: str, estimate: str, tables: list[Columns]) -> str:
    """Return a line of the table."""
    ratio = np.concatenate([table[ESTIMATES[estimate]] / table["demand_exact"] for table in tables])
    failed = 1.0 - np.concatenate([table["linearized_converged"] for table in tables]).mean()
    spread = f"{np.median(ratio):.2f}, {np.log(ratio).std():.2f}, {(ratio < 1).mean():.0%}"
    return (
        f"| {name}, {ratio.size} pairs | {estimate} | {spread} | {ratio.min():.2f} | {failed:.0%} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "-s", "--stations", type=int, default=24, help="of the simulated earthquake"
    )
    parser.add_argument(
        "-n", "--pairs", type=int, default=50, help="a simulated station; ten times as many at SCT"
    )
    arguments = parser.parse_args()
    draw, groups = np.random.default_rng(5), dict[str, list[Columns]]()
    for name, station in simulated(arguments.stations):
        groups.setdefault(f"simulated {name}", []).append(
            yielding_pairs(station, arguments.pairs, draw)
        )
    for name, station in mexico_city_1985():
        groups.setdefault(name, []).append(yielding_pairs(station, 10 * arguments.pairs, draw))
    print(
        "| motion | estimate | median, σ_ln, too small | smallest | not converged "
        "|\n|---|---|---|---|---|"
    )
    for name, tables in groups.items():
        print("\n".join(row(name, estimate, tables) for estimate in ESTIMATES))


if __name__ == "__main__":
    main()
