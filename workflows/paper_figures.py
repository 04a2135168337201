"""
The figures of the paper, on Mexico City 1985 (SCT, EW) and on Taft 1952, in less than a minute.

Where the real records are absent (see PER_OBSPY_DATA), a simulated record on a lakebed replaces
them.
"""

import argparse
from pathlib import Path

import numpy as np
import paper_plots
from paper_cases import (
    DAMPING,
    MASS,
    comparisons,
    correlation_panels,
    critical_cases,
    damping_needs,
    history_of,
    hit_of,
    pair_of,
)
from paper_records import (
    BROAD_BAND,
    CHECKOUT,
    Record,
    broad_band,
    data_folder,
    mexico_city_1985,
    simulated_lakebed,
)

from per_obspy import per_spectrum

LAKEBED, FIRM = (1.8, 2.4), (0.6, 0.9)  # s: periods of the pair on either ground


def figures(record: Record, periods: tuple[float, float], count: int, folder: Path) -> None:
    """Draw Figs. 1 to 8 on one record."""

    def sheet(number: int, text: str) -> paper_plots.Sheet:
        path = folder / f"fig{number}_{record.name.replace(' ', '_').lower()}.png"
        return paper_plots.Sheet(f"Fig. {number}, {record.name}: {text}", path, record.simulated)

    two = "T = {:g} s and {:g} s".format(*periods)
    pair = pair_of(record, periods, 0.5)

    # Two structures trade energy in impacts; without impacts, each has a largest radius.
    history, apart = (
        history_of(record, periods, pair.gap),
        history_of(record, periods, sum(pair.per)),
    )
    counted = history.impacts["counted"].sum()
    paper_plots.draw_energy_exchange(
        history, sheet(1, f"{two}, half of the critical gap, {counted} impacts")
    )
    paper_plots.draw_radius_and_energies(
        apart, periods[0], MASS, sheet(2, f"T = {periods[0]:g} s, damping {DAMPING:.0%}")
    )

    # That radius over period and damping is the PER spectrum.
    grid, dampings = np.linspace(0.05, 5.0, 200), (0.02, 0.05, 0.1, 0.2)
    spectra = per_spectrum(record.acceleration, record.dt, grid, dampings)
    paper_plots.draw_per_spectra(grid, dampings, spectra, sheet(3, "pseudo energy radius"))

    # Two radii and a correlation give the critical gap.
    all_periods = [(periods[0], periods[0] * ratio) for ratio in (1.05, 1.2, 1.5, 2.5)]
    paper_plots.draw_critical_gaps(
        list(critical_cases(record, all_periods)), sheet(4, "critical gaps by (15) and (16)")
    )

    # A smaller gap: one impact at full energy, beside the exact histories of many pairs.
    near = pair_of(record, periods, 0.8)
    paper_plots.draw_single_hit(
        hit_of(near, near.gap), near, sheet(5, f"single hit, {two}, gap 0.8 of the critical one")
    )
    paper_plots.draw_comparison(
        comparisons(record, count), sheet(6, "single hit against exact histories")
    )

    # What helps: bumpers, which lower the restitution, and damping.
    shares, restitutions = np.linspace(0.4, 1.0, 301), (1.0, 0.75, 0.5, 0.25, 0.0)
    hits = [hit_of(pair, shares * pair.critical_gap, restitution) for restitution in restitutions]
    paper_plots.draw_restitution(shares, restitutions, hits, sheet(7, f"restitution, {two}"))
    paper_plots.draw_supplemental_damping(
        *damping_needs(record, near), sheet(8, f"added damping, {two}")
    )


def yielding(folder: Path) -> None:
    """Draw the correlation of yielding pairs, which (16) does not know."""
    ratios = 1.0 + 2.0 * np.linspace(0.0, 1.0, 25) ** 2
    title = f"correlation of bilinear pairs, damping {DAMPING:.0%}, hardening 5%"
    sheet = paper_plots.Sheet(title, folder / "correlation_ductility.png", simulated=False)
    paper_plots.draw_ductility_correlation(ratios, dict(correlation_panels(ratios)), sheet)


def main() -> None:
    """Draw everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=CHECKOUT / "output" / "paper_figures")
    parser.add_argument(
        "-n", "--periods", type=int, default=24, help="Fig. 6 takes all pairs of so many periods"
    )
    arguments = parser.parse_args()
    if data_folder().is_dir():
        grounds = [
            (mexico_city_1985()[1], LAKEBED),
            (broad_band(BROAD_BAND[:1])[0]._replace(name="Taft 1952"), FIRM),
        ]
    else:
        print(f"real records are not at {data_folder()}: a simulated one is drawn")
        grounds = [(simulated_lakebed(), LAKEBED)]
    for record, periods in grounds:
        figures(record, periods, arguments.periods, arguments.output)
    yielding(arguments.output)
    print(f"figures are in {arguments.output}")


if __name__ == "__main__":
    main()
