"""Measure the reliability of critical gap and single hit on real records (two minutes)."""

import argparse
from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
from paper_records import CHECKOUT, Record, broad_band, data_folder, mexico_city_1985

from per_obspy.pounding.reliability import (
    SingleHitComparison,
    amplifications,
    compare_gaps,
    compare_single_hit,
    summary,
)

SHORTEST, LONGEST = 0.3, 4.0  # s
GAP_RATIOS = (0.95, 0.8, 0.5, 0.05)
DAMPING, RESTITUTION = 0.05, 0.65  # of every structure and impact
MASS_RATIOS = (1.0, 5.0, 0.2)
BELOW = 1.0 - 1e-9  # so that equality but for rounding is no under-estimate
MEASURED = "## Measured"  # the heading below which the page is the script's
ESTIMATES = {
    "(16) with SD": "ddc_sd",
    "(16) with PER": "ddc_per",
    "record correlation with PER": "record_per",
    "SRSS of SD": "srss_sd",
    "absolute sum of SD": "absolute_sd",
    "larger of both with PER": "larger_per",
}


def gap_table(groups: dict[str, list[Record]], pairs: np.ndarray) -> Iterator[str]:
    """Yield the rows on the critical gap: estimate / exact max |u1 - u2|, 5 % damping."""
    yield "| estimate / exact | " + " | ".join(groups) + " |"
    yield "|---|" + "---|" * len(groups)
    compared = {
        name: [compare_gaps(record.acceleration, record.dt, *pairs, DAMPING) for record in records]
        for name, records in groups.items()
    }
    for title, field in ESTIMATES.items():
        ratios = [
            np.concatenate([getattr(one, field) / one.exact for one in all_])
            for all_ in compared.values()
        ]
        yield f"| {title} | " + " | ".join(cell(ratio, (BELOW, 0.9)) for ratio in ratios) + " |"


def hit_table(groups: dict[str, list[Record]], pairs: np.ndarray) -> Iterator[str]:
    """Yield the rows on the single hit: predicted over actual largest amplification of the pair."""
    columns = [(name, mass_ratio) for mass_ratio in MASS_RATIOS for name in groups]
    yield (
        "| gap / critical | "
        + " | ".join(f"{name}, m2 = {ratio:g} m1" for name, ratio in columns)
        + " |"
    )
    yield "|---|" + "---|" * len(columns)
    for gap_ratio in GAP_RATIOS:
        compared = [
            list(both_ways(groups[name], pairs, gap_ratio, mass_ratio))
            for name, mass_ratio in columns
        ]
        ratios = [
            np.concatenate([np.divide(*amplifications(one)) for one in all_]) for all_ in compared
        ]
        yield f"| {gap_ratio:g} | " + " | ".join(cell(ratio, (0.99,)) for ratio in ratios) + " |"


def both_ways(
    records: Sequence[Record], pairs: np.ndarray, gap_ratio: float, mass_ratio: float
) -> Iterator[SingleHitComparison]:
    """Compare every record as it is and reversed: either structure may stand on the left."""
    for record in records:
        for sign in (1.0, -1.0):
            motion = sign * record.acceleration
            yield compare_single_hit(
                motion, record.dt, *pairs, gap_ratio, mass_ratio, RESTITUTION, DAMPING
            )


def cell(ratio: np.ndarray, limits: tuple[float, ...]) -> str:
    """Return median, scatter and shares below the limits."""
    found = summary(ratio, limits)
    return ", ".join(f"{number:.2f}" for number in (found.median, found.log_std, *found.below))


def left_out(groups: dict[str, list[Record]], pairs: np.ndarray) -> Iterator[str]:
    """Yield how many cases have no grazing state, which does not depend on gap and mass."""
    for name, records in groups.items():
        status = np.concatenate([one.status for one in both_ways(records, pairs, 0.5, 1.0)])
        yield f"* {name}: {np.mean(status == 'no_grazing_state'):.1%} of {status.size} cases"


def page(groups: dict[str, list[Record]], pairs: np.ndarray) -> Iterable[str]:
    """Yield the measured part of the page."""
    yield from ("### Critical gap", "", "Median, sigma of ln, share below 1, share below 0.9.", "")
    yield from gap_table(groups, pairs)
    yield from (
        "",
        "### Single hit",
        "",
        "Median, sigma of ln, share under-predicted by more than 1 %.",
        "",
    )
    yield from hit_table(groups, pairs)
    yield from (
        "",
        "Left out, because the exact critical gap of the record allows no grazing state:",
        "",
    )
    yield from left_out(groups, pairs)
    yield from ("", "### Records", "")
    for name, records in groups.items():
        yield f"* {name}, {len(records)}: " + ", ".join(record.name for record in records)


def main() -> None:
    """Print the tables and write them into the page, below its text by hand."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=CHECKOUT / "docs" / "reliability.md")
    parser.add_argument(
        "-n",
        "--periods",
        type=int,
        default=14,
        help="all pairs of so many periods; 14 make 91 pairs",
    )
    arguments = parser.parse_args()
    if not data_folder().is_dir():
        parser.exit(2, f"real records are not at {data_folder()}: set PER_OBSPY_DATA\n")
    groups = {"broad band": broad_band(), "SCT 1985": mexico_city_1985()}
    pairs = np.array(list(combinations(np.geomspace(SHORTEST, LONGEST, arguments.periods), 2))).T
    measured = "\n".join(page(groups, pairs))
    print(measured)
    said = arguments.output.read_text(encoding="utf-8").split(MEASURED)[0]
    arguments.output.write_text(f"{said}{MEASURED}\n\n{measured}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
