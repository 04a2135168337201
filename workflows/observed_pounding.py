"""
Try the classes of impact velocity on what was observed in Christchurch (one minute).

    python workflows/observed_pounding.py

A made-up centre of masonry buildings in rows stands under the amplitudes of the four instruments of
the centre, in February 2011 and in September 2010. The velocity that a share of the buildings
exceeds in 2011 which was seen to have serious damage by pounding is the threshold that this
experiment supports; the share that exceeds it in 2010 is its only test. Writes the tables of
``docs/observed.md``.
"""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from paper_records import CHECKOUT, data_folder

from per_obspy.checks import FloatArray
from per_obspy.config import Building, Screening
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.inventory.checking import checked_pairs
from per_obspy.inventory.completion import completed_pairs
from per_obspy.screening.shakemap import DAMPINGS, damping_factor
from per_obspy.screening.spectral_demand import SpectralMotion, spectral_rows
from per_obspy.screening.station_motion import LogSpectra

#: Instruments of the centre, and the lists of both earthquakes.
STATIONS = ("CBGS", "CCCC", "CHHC", "REHS")
EARTHQUAKES = {"February 2011": "christchurch2011", "September 2010": "canterbury2010"}

#: Share of the buildings of the centre with serious damage by pounding (Cole and others 2012).
OBSERVED = 0.06

#: Shortest period of the spectra, at which they are the peak acceleration, s.
STIFF = 0.03

#: Rows of buildings per instrument, buildings of a row.
ROWS, LENGTH = 150, 6

#: Shares of buildings of 1 to 4 storeys, and storey height (m): made up, see docs/observed.md.
STOREYS, STOREY_HEIGHT = (0.25, 0.5, 0.2, 0.05), 3.8

#: Lines between which the page is written by this workflow.
START, END = "<!-- below: workflows/observed_pounding.py -->", "<!-- above -->"


class Stock(NamedTuple):
    """Ranges of the made-up buildings: period per storey, s, and gap, m."""

    period: tuple[float, float] = (0.05, 0.1)
    gap: tuple[float, float] = (0.0, 0.05)


#: The stock of the experiment, and others that show what it depends on.
STOCKS = {
    "as stated": Stock(),
    "gaps 0 to 2 cm": Stock(gap=(0.0, 0.02)),
    "gaps 0 to 10 cm": Stock(gap=(0.0, 0.1)),
    "0.05 to 0.07 s a storey": Stock(period=(0.05, 0.07)),
    "0.08 to 0.1 s a storey": Stock(period=(0.08, 0.1)),
}


class Motion(NamedTuple):
    """Amplitudes of an instrument: ln period (s), and PSA of its larger horizontal, m/s2."""

    ln_period: FloatArray
    psa: FloatArray


def peaks(earthquake: str) -> dict[str, dict[str, float]]:
    """Return the largest horizontal amplitudes of the instruments, in g and m/s."""
    file = data_folder() / "stationlists" / f"{EARTHQUAKES[earthquake]}.json"
    found: dict[str, dict[str, float]] = {}
    for feature in json.loads(file.read_text(encoding="utf-8"))["features"]:
        name = str(feature["id"]).split(".")[-1]
        if name in STATIONS:
            largest = found.setdefault(name, {})
            for channel in feature["properties"]["channels"]:
                for amplitude in channel["amplitudes"] if channel["name"][-1] != "Z" else ():
                    value = amplitude["value"]
                    if value not in (None, "null"):
                        measure = amplitude["name"]
                        largest[measure] = max(largest.get(measure, 0.0), float(value) / 100.0)
    return found


def motions(earthquake: str) -> dict[str, Motion]:
    """
    Return the spectra of the instruments.

    Those of 2010 have peaks only: each takes the shape of its instrument in 2011.
    """
    shapes, largest = peaks("February 2011"), peaks(earthquake)
    spectra = {}
    for name in STATIONS:
        shape = shapes[name]
        psa = np.array([shape["pga"], shape["sa(0.3)"], shape["sa(1.0)"]])
        psa *= largest[name]["pga"] / shape["pga"] * STANDARD_GRAVITY
        spectra[name] = Motion(np.log([STIFF, 0.3, 1.0]), psa)
    return spectra


def masonry_centre(stock: Stock, seed: int) -> pd.DataFrame:
    """Return neighbours in rows of made-up masonry buildings, with ``row`` and ``place``."""
    random = np.random.default_rng(seed)
    storeys = random.choice(np.arange(1, 5), size=(ROWS, LENGTH), p=STOREYS)
    period = storeys * random.uniform(*stock.period, size=storeys.shape)
    area = random.uniform(100.0, 300.0, size=storeys.shape)
    row, place = np.indices((ROWS, LENGTH - 1))
    columns = {"row": row, "place": place, "gap": random.uniform(*stock.gap, size=row.shape)}
    for i, side in ((1, slice(None, -1)), (2, slice(1, None))):
        columns |= {f"storeys_{i}": storeys[:, side], f"period_{i}": period[:, side]}
        columns |= {f"area_{i}": area[:, side]}
        columns |= {f"height_{i}": STOREY_HEIGHT * storeys[:, side]}
    table = pd.DataFrame({name: np.ravel(column) for name, column in columns.items()})
    places = {f"longitude_{i}": 172.63 + 1e-4 * i for i in (1, 2)}
    places |= {f"latitude_{i}": -43.53 for i in (1, 2)}
    return table.assign(**places, pair_id=table.index.astype(str))


def velocities(earthquake: str, stock: Stock, seed: int) -> FloatArray:
    """Return the largest expected impact velocity of each building of the centre, m/s."""
    buildings = []
    for number, motion in enumerate(motions(earthquake).values()):
        centre = masonry_centre(stock, 10 * seed + number)
        pairs = completed_pairs(checked_pairs(centre, "made-up centre"), Building())
        rows = spectral_rows(pairs, _spectral_motion(motion, pairs), Screening())
        velocity = rows["expected_impact_velocity"].to_numpy().reshape(ROWS, LENGTH - 1)
        # a building is hit from both sides
        largest = np.zeros((ROWS, LENGTH))
        largest[:, :-1] = velocity
        largest[:, 1:] = np.maximum(largest[:, 1:], velocity)
        buildings.append(largest.ravel())
    return np.concatenate(buildings)


def _spectral_motion(motion: Motion, pairs: pd.DataFrame) -> SpectralMotion:
    """Return the spectral displacements of pairs, without deviation: at the instrument itself."""

    def ln_sd(ln_period: FloatArray) -> FloatArray:
        # PSA is a power of the period between its three values
        ln_psa = np.interp(ln_period, motion.ln_period, np.log(motion.psa))
        return np.asarray(ln_psa + 2.0 * (ln_period - np.log(2.0 * np.pi)))

    sides = [
        np.exp(ln_sd(np.log(pairs[f"period_{i}"]))) * damping_factor(pairs[f"damping_{i}"])
        for i in (1, 2)
    ]
    nothing = np.zeros(len(pairs))
    grid = np.linspace(*motion.ln_period[[0, -1]], 60)
    dampings = np.log(damping_factor(DAMPINGS))[None, :, None]
    spectra = LogSpectra(grid, np.log(DAMPINGS), ln_sd(grid)[None, None, :] + dampings)
    rows = np.zeros(len(pairs), dtype=np.intp)
    return SpectralMotion((sides[0], sides[1]), (nothing, nothing), spectra, rows)


def page(seeds: int) -> Iterator[str]:
    """Yield the measured part of the page."""
    yield "| instrument | February 2011: PGA, g; PGV, m/s | September 2010: PGA, g; PGV, m/s |"
    yield "|---|---|---|"
    before, after = peaks("September 2010"), peaks("February 2011")
    for name in STATIONS:
        cells = [f"{one[name]['pga']:.2f}; {one[name]['pgv']:.2f}" for one in (after, before)]
        yield f"| {name} | {' | '.join(cells)} |"
    found = {name: centres(name, Stock(), seeds) for name in EARTHQUAKES}
    limit = threshold(found["February 2011"])
    limits = sorted([*(value for value in Screening().classes.values() if value > 0.0), limit])
    yield ""
    yield f"| share of the buildings hit faster than | {' | '.join(EARTHQUAKES)} |"
    yield "|---|---|---|"
    for value in limits:
        mark = f"**{value:.2f} m/s**" if value == limit else f"{value:g} m/s"
        yield f"| {mark} | {' | '.join(f'{(found[name] > value).mean():.1%}' for name in found)} |"
    yield ""
    yield f"| stock | threshold that {OBSERVED:.0%} exceed in 2011 | share in 2010 |"
    yield "|---|---|---|"
    for name, stock in STOCKS.items():
        limit = threshold(centres("February 2011", stock, seeds))
        later = (centres("September 2010", stock, seeds) > limit).mean()
        yield f"| {name} | {limit:.2f} m/s | {later:.1%} |"


def centres(earthquake: str, stock: Stock, seeds: int) -> FloatArray:
    """Return the velocities of all buildings of several made-up centres."""
    return np.concatenate([velocities(earthquake, stock, seed) for seed in range(seeds)])


def threshold(velocity: FloatArray) -> float:
    """Return the velocity that the observed share of the buildings exceeds, m/s."""
    return float(np.quantile(velocity, 1.0 - OBSERVED))


def main() -> None:
    """Print the tables and write them into the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=CHECKOUT / "docs" / "observed.md")
    parser.add_argument("-n", "--seeds", type=int, default=3, help="made-up centres")
    arguments = parser.parse_args()
    if not data_folder().is_dir():
        parser.exit(2, f"lists of stations are not at {data_folder()}: set PER_OBSPY_DATA\n")
    measured = "\n".join(page(arguments.seeds))
    print(measured)
    before, rest = arguments.output.read_text(encoding="utf-8").split(START, 1)
    text = f"{before}{START}\n\n{measured}\n\n{END}{rest.split(END, 1)[1]}"
    arguments.output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
