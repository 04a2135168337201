"""
Measure the errors of critical gaps by PER and SD, and of impacts of the population (7 minutes).

    python workflows/estimate_errors.py

Estimates by eq. (15) and (16) are compared with the exact one-sided critical gap at all stations of
all real earthquakes, in both components and both orders of the structures. The constants of
``per_obspy/pounding/reliability.py`` are fitted to all earthquakes, which count alike; the page
shows each half of the earthquakes against a fit to the other half. Writes that part of
``docs/reliability.md`` and its figure.

Velocities and amplifications of the impacts of a node, by the formulas of
``per_obspy/screening/population.py``, are compared and fitted likewise with exact histories of
made-up pairs at the same stations.
"""

import argparse
import tempfile
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from calibration_events import real_events
from matplotlib.figure import Figure
from paper_records import CHECKOUT, data_folder
from population_accuracy import stations
from scipy.optimize import least_squares

from per_obspy import (
    critical_gap,
    ddc_correlation,
    pounding_histories,
    relative_displacement,
    response_spectra,
)
from per_obspy.checks import FloatArray
from per_obspy.kernels.pairs.node_outcomes import LOSS, LOSS_BETWEEN, RADIUS_SHARE, WEAK_SHARE
from per_obspy.pounding.relative import approach
from per_obspy.pounding.reliability import EstimateError, per_error, sd_error
from per_obspy.report.style import save
from per_obspy.screening.station_motion import station_motion

#: Earthquakes whose stations have no place, which needs none here.
WITHOUT_PLACE = ("maule2010_renadic", "mexico1985_sct")

#: Shorter periods and the longest of all (s), ratios of both periods, dampings of both structures.
SHORTEST, LONGEST, PERIODS, LONGEST_OF_ALL = 0.15, 3.0, 6, 6.0
RATIOS = np.array([1.01, 1.02, 1.05, 1.1, 1.2, 1.35, 1.5, 1.7, 2.0, 2.5, 3.0, 4.0, 5.0])
DAMPINGS = ((0.05, 0.05), (0.02, 0.02), (0.1, 0.1), (0.03, 0.08), (0.08, 0.03))

#: Lines between which the page is written by this workflow.
START, END = "<!-- below: workflows/estimate_errors.py -->", "## Contact law"


#: Pairs of a station with histories, their gaps over the demand, and constants of the kernel
#: ``node_outcomes.py`` from which the fit begins.
HISTORIES, SHARES = 240, (0.0, 0.0, 0.1, 0.3, 0.6, 0.9)
LOSSES, GROWTHS = (LOSS, LOSS_BETWEEN), (RADIUS_SHARE, WEAK_SHARE)

#: Halves of the earthquakes.
HALVES = ("first half", "second half")


class Estimate(NamedTuple):
    """An estimate, its error by a fit, and the constant error that it had before."""

    column: str
    error: Callable[..., EstimateError]
    ln_median: Callable[[FloatArray, pd.DataFrame], FloatArray]
    first: tuple[float, ...]
    before: float


def _ln_per(constants: FloatArray, rows: pd.DataFrame) -> FloatArray:
    """Return ln of the median error of PER."""
    near, exponent, forced = constants
    damping = rows["damping"] ** exponent
    return np.asarray(forced * damping + near * np.sqrt(rows["correlation"]) / damping)


def _ln_sd(constants: FloatArray, rows: pd.DataFrame) -> FloatArray:
    """Return ln of the median error of SD."""
    near, exponent = constants
    return np.asarray(near * np.sqrt(rows["correlation"]) / rows["damping"] ** exponent)


ESTIMATES = {
    "PER": Estimate("per", per_error, _ln_per, (0.3, 0.5, 0.1), 1.16),
    "SD": Estimate("sd", sd_error, _ln_sd, (0.3, 0.3), 0.97),
}


def real_stations(cache: Path) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield the stations of all earthquakes, each with the name of its earthquake."""
    folders = sorted(path for path in (data_folder() / "records").iterdir() if path.is_dir())
    events = {event.name: event.stations for event in real_events(folders, cache)}
    for name in WITHOUT_PLACE:
        events[name] = list(stations(name))
    yield from ((name, station) for name in sorted(events) for station in events[name])


def compared(event: str, station: xr.Dataset) -> Iterator[pd.DataFrame]:
    """Yield ln(estimate / exact) of pairs whose periods are usable in the record."""
    motion = station_motion(station).records[0]
    shortest, longest = motion.usable_periods
    periods = np.geomspace(max(SHORTEST, shortest), LONGEST, PERIODS)
    period_1, ratio = (column.ravel() for column in np.meshgrid(periods, RATIOS))
    usable = period_1 * ratio <= min(longest, LONGEST_OF_ALL)
    period_1, ratio = period_1[usable], ratio[usable]
    if not ratio.size:
        return
    for record, (damping_1, damping_2) in product((motion.north, motion.east), DAMPINGS):
        structures = period_1, damping_1, period_1 * ratio, damping_2
        correlation = ddc_correlation(*structures)
        gap = relative_displacement(record, motion.dt, *structures)
        # radii of both structures, each period once
        spectra = [_spectra(record, motion.dt, *structures[first : first + 2]) for first in (0, 2)]
        for exact in (gap.one_before_two, gap.two_before_one):
            rows = {"event": event, "ratio": ratio, "correlation": correlation}
            rows["damping"] = np.sqrt(damping_1 * damping_2) / 0.05
            rows["alike"] = damping_1 == damping_2
            for name in ("per", "sd"):
                estimate = critical_gap(*(one[name] for one in spectra), correlation)
                rows[name] = np.log(estimate / np.where(exact > 0.0, exact, np.nan))
            yield pd.DataFrame(rows).dropna()


def _spectra(
    record: FloatArray, dt: float, period: FloatArray, damping: float
) -> dict[str, FloatArray]:
    """Return PER and SD at periods in any order, m."""
    periods, index = np.unique(period, return_inverse=True)
    spectra = response_spectra(record, dt, periods, damping)
    return {"per": spectra.per[index], "sd": spectra.sd[index]}


def fitted(estimate: Estimate, rows: pd.DataFrame) -> FloatArray:
    """Return the constants that fit the rows, those far off counting less."""
    weight = np.sqrt(rows["weight"].to_numpy())
    errors = rows[estimate.column].to_numpy()

    def residual(constants: FloatArray) -> FloatArray:
        return weight * (estimate.ln_median(constants, rows) - errors)

    return np.asarray(least_squares(residual, estimate.first, loss="soft_l1", f_scale=0.1).x)


def with_errors(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows with the error that is left after the fit to the other half."""
    # earthquakes count alike
    count = rows.groupby("event")["event"].transform("count")
    rows = rows.assign(weight=(1.0 / count) / (1.0 / count).mean())
    events = sorted(rows["event"].unique())
    is_first = rows["event"].isin(events[::2])
    for estimate in ESTIMATES.values():
        left = pd.Series(0.0, rows.index)
        for half in (is_first, ~is_first):
            constants = fitted(estimate, rows[~half])
            left[half] = rows.loc[half, estimate.column] - estimate.ln_median(constants, rows[half])
        rows[f"{estimate.column}_left"] = left
    return rows.assign(half=np.where(is_first, "first", "second"))


def scatter(rows: pd.DataFrame, column: str) -> tuple[float, float]:
    """Return the median, and the standard deviation of the logarithm."""
    order = np.argsort(rows[column].to_numpy())
    value, weight = rows[column].to_numpy()[order], rows["weight"].to_numpy()[order]
    median = value[np.searchsorted(np.cumsum(weight), weight.sum() / 2.0)]
    variance = np.average((value - np.average(value, weights=weight)) ** 2, weights=weight)
    return float(np.exp(median)), float(np.sqrt(variance))


def page(rows: pd.DataFrame) -> Iterator[str]:
    """Yield the measured part of the page."""
    events = {name: sorted(some["event"].unique()) for name, some in rows.groupby("half")}
    yield f"{len(rows)} cases; first half of the earthquakes: {', '.join(events['first'])}; "
    yield f"second half: {', '.join(events['second'])}."
    yield ""
    yield "![Errors of the estimates by the ratio of the periods](figures/estimate_errors.png)"
    yield ""
    titles = [f"{name} before | {name} now | predicted σ" for name in ESTIMATES]
    yield f"| T2 / T1 | {' | '.join(titles)} |"
    yield "|---" * 7 + "|"
    for ratio, some in rows.groupby("ratio"):
        cells = []
        for estimate in ESTIMATES.values():
            median, deviation = scatter(some, estimate.column)
            left, deviation_left = scatter(some, f"{estimate.column}_left")
            predicted = _predicted(estimate, some)
            cells += [f"{median / estimate.before:.2f}, {deviation:.2f}"]
            cells += [f"{left:.2f}, {deviation_left:.2f}", f"{predicted:.2f}"]
        yield f"| {ratio:g} | {' | '.join(cells)} |"
    yield ""
    for name, estimate in ESTIMATES.items():
        parts = {"all": rows} | dict(iter(rows.groupby("half")))
        constants = "; ".join(
            f"{part}: {', '.join(f'{value:.3f}' for value in fitted(estimate, some))}"
            for part, some in parts.items()
        )
        yield f"* Constants of {name}, fitted to {constants}."


def impacts(event: str, station: xr.Dataset, number: int) -> pd.DataFrame:
    """Return exact histories of made-up pairs at a station, and what a node knows of them."""
    motion, random = station_motion(station).records[0], np.random.default_rng(number)
    shortest, longest = motion.usable_periods
    # nearly equal, alike and any periods, the longer ones usable
    spread = random.choice([0.1, 0.4, 1.0], HISTORIES)
    period = np.exp(random.uniform(*np.log([max(0.12, shortest), min(3.0, longest)]), HISTORIES))
    periods = np.stack([period, period * np.exp(spread * random.normal(size=HISTORIES))])
    periods = periods[:, (periods[1] < min(longest, LONGEST_OF_ALL)) & (periods[1] > shortest)]
    count = periods.shape[1]
    if not count:
        return pd.DataFrame()
    dampings = np.clip(0.05 * np.exp(0.3 * random.normal(size=(2, count))), 0.01, 0.2)
    masses = np.stack([np.ones(count), np.exp(0.5 * random.normal(size=count))])
    restitution, share = random.choice([0.4, 0.65, 0.8], count), random.choice(SHARES, count)
    azimuth = random.uniform(0.0, 360.0, count)
    oscillators = periods[0], dampings[0], periods[1], dampings[1]
    free = approach(*motion.components, *oscillators, azimuth)
    record = motion.horizontal
    pairs = [column for i in (0, 1) for column in (periods[i], dampings[i], masses[i])]
    given = {"restitution": restitution, "azimuth": azimuth}
    hit, apart = (
        pounding_histories(record, motion.dt, *pairs, gap=gap, **given)
        for gap in (share * free.displacement, np.full(count, 1e3))
    )
    # change of velocity over impact velocity, and over the speeds of the oscillators
    received = (1.0 + restitution) * masses[::-1] / masses.sum(axis=0)
    rows = {
        "event": event,
        "share": share,
        "correlation": np.maximum(ddc_correlation(*oscillators), 0.0),
        "harmonic": free.velocity * np.sqrt(1.0 - share**2),
        "velocity": hit.impact_velocity,
        "received": (received * periods / (2.0 * np.pi * np.stack(apart.per))).max(axis=0),
        "amplification": np.maximum((np.stack(hit.per) / np.stack(apart.per)).max(axis=0), 1.0),
    }
    table = pd.DataFrame(rows)
    return table[(table["velocity"] > 0.0) & (table["harmonic"] > 0.0)]


def _loss(constants: FloatArray, rows: pd.DataFrame) -> FloatArray:
    """Return minus ln of the loss of velocity by earlier impacts."""
    alike = rows["correlation"]
    loss = constants[0] * np.sqrt(alike) + constants[1] * alike * (1.0 - alike)
    return np.asarray(loss * (1.0 - rows["share"]))


def _velocity_error(constants: FloatArray, rows: pd.DataFrame) -> FloatArray:
    """Return ln of the velocity of a node over the exact one."""
    return np.asarray(np.log(rows["harmonic"] / rows["velocity"]) - _loss(constants, rows))


def _amplification_error(constants: FloatArray, rows: pd.DataFrame) -> FloatArray:
    """Return the error of the amplification of a node over the size of the amplification."""
    change = rows["received"] * rows["harmonic"] * np.exp(-_loss(np.array(LOSSES), rows))
    strong = (1.0 + (constants[0] * change) ** 4) ** 0.25
    error = strong + constants[1] * np.sqrt(change) - rows["amplification"]
    return np.asarray(error / np.hypot(1.0, 0.7 * change))


def impact_lines(rows: pd.DataFrame) -> Iterator[str]:
    """Yield constants of all earthquakes and of each half, and what is left in the other half."""
    # earthquakes count alike; where the linear estimate fails, 10 speeds and more, none does
    count = rows.groupby("event")["event"].transform("count")
    rows = rows.assign(weight=np.sqrt((1.0 / count) / (1.0 / count).mean()))
    rows = rows[rows["received"] * rows["velocity"] < 10.0]
    is_first = rows["event"].isin(sorted(rows["event"].unique())[::2])
    parts = {"all": rows, "first half": rows[is_first], "second half": rows[~is_first]}
    for name, error, first, loss in (
        ("velocity", _velocity_error, LOSSES, "soft_l1"),
        ("amplification", _amplification_error, GROWTHS, "linear"),
    ):
        found = {
            part: least_squares(
                lambda constants, some, error=error: some["weight"] * error(constants, some),
                first,
                loss=loss,
                f_scale=0.2,
                args=(some,),
            ).x
            for part, some in parts.items()
        }
        texts = [f"{part}: {one[0]:.3f}, {one[1]:.3f}" for part, one in found.items()]
        yield f"* Constants of the {name} of a node, {len(rows)} histories, {'; '.join(texts)}."
        left = [
            error(found[other], parts[half])
            for half, other in zip(HALVES, HALVES[::-1], strict=True)
        ]
        errors = ", ".join(f"{some.mean():+.3f} ± {some.std():.3f}" for some in left)
        yield f"  Error of each half with the constants of the other: {errors}."


def _predicted(estimate: Estimate, rows: pd.DataFrame) -> float:
    """Return the root mean square of the predicted deviations."""
    alike = rows[rows["alike"]]
    damping = 0.05 * alike["damping"].to_numpy()
    error = estimate.error(1.0, damping, alike["ratio"].to_numpy(), damping)
    return float(np.sqrt(np.mean(error.log_std**2)))


def draw(rows: pd.DataFrame, path: Path) -> None:
    """Draw the medians of both halves of the earthquakes and the fit, by damping."""
    figure = Figure(figsize=(7.0, 3.4), layout="constrained")
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    ratios = np.geomspace(RATIOS[0], RATIOS[-1], 100)
    colours = {0.02: "#0072B2", 0.05: "black", 0.1: "#D55E00"}
    for axes, (name, estimate) in zip(panels, ESTIMATES.items(), strict=True):
        for damping, colour in colours.items():
            label = f"{100 * damping:g} % damping"
            error = estimate.error(1.0, damping, ratios, damping)
            axes.plot(ratios, error.median, color=colour, label=label, linewidth=1.2)
            of_damping = rows[rows["alike"] & np.isclose(rows["damping"], damping / 0.05)]
            for half, marker in (("first", "o"), ("second", "x")):
                some = of_damping[of_damping["half"] == half].groupby("ratio")
                medians = [scatter(cases, estimate.column)[0] for _, cases in some]
                axes.plot(list(some.groups), medians, marker, color=colour, markersize=3.5)
        axes.axhline(estimate.before, color="#888888", linestyle=":", label="before")
        axes.set(xscale="log", xlabel="T2 / T1", title=f"{name} with (16)")
        axes.set_xticks([1, 1.5, 2, 3, 5], ["1", "1.5", "2", "3", "5"])
        axes.minorticks_off()
        axes.grid(alpha=0.25)
    panels[0].set_ylabel("median of estimate / exact")
    panels[0].legend(fontsize=7)
    save(figure, path, simulated=False)


def main() -> None:
    """Measure, print the tables, write them into the page, draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=CHECKOUT / "docs" / "reliability.md")
    cache = Path(tempfile.gettempdir()) / "per_obspy_calibration"
    parser.add_argument("-c", "--cache", type=Path, default=cache, help="keeps the spectra")
    arguments = parser.parse_args()
    if not data_folder().is_dir():
        parser.exit(2, f"real records are not at {data_folder()}: set PER_OBSPY_DATA\n")
    found = list(real_stations(arguments.cache))
    tables = [table for event, station in found for table in compared(event, station)]
    histories = [impacts(*one, number) for number, one in enumerate(found)]
    rows = with_errors(pd.concat(tables, ignore_index=True))
    lines = [*page(rows), *impact_lines(pd.concat(histories, ignore_index=True))]
    measured = "\n".join(lines)
    print(measured)
    before, rest = arguments.output.read_text(encoding="utf-8").split(START, 1)
    after = rest.split(f"{END}\n", 1)[1]
    text = f"{before}{START}\n\n{measured}\n\n{END}\n{after}"
    arguments.output.write_text(text, encoding="utf-8")
    draw(rows, arguments.output.parent / "figures" / "estimate_errors.png")


if __name__ == "__main__":
    main()
