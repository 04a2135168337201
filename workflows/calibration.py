"""
Measure the calibration of the probability of pounding: 100 000 pairs in simulated motion.

Run: ``python workflows/calibration.py``; prints the tables of the simulated part of
docs/calibration.md, writes them into it and draws its figures. The part on real records is that of
``calibration_real.py``.
"""

import argparse
from pathlib import Path

import pandas as pd
from calibration_cases import cases
from calibration_figures import draw_demands, draw_reliability
from calibration_scores import by_place, demands, page
from paper_records import CHECKOUT

MEASURED = (
    "## Measured in simulated earthquakes"  # the heading below which the page is the script's
)


def main() -> None:
    """Simulate, print the tables, write them into the measured part of the page, draw figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=CHECKOUT / "docs" / "calibration.md")
    parser.add_argument("-e", "--events", type=int, default=20, help="simulated earthquakes")
    parser.add_argument(
        "-n",
        "--pairs",
        type=int,
        default=1700,
        help="an earthquake and place; there are three places",
    )
    parser.add_argument(
        "-s",
        "--stations",
        type=int,
        default=8,
        help="of each earthquake; three times as many sites",
    )
    arguments = parser.parse_args()
    told = []
    for event in range(1, arguments.events + 1):
        told.append(cases(event, arguments.stations, 3 * arguments.stations, arguments.pairs))
        print(f"earthquake {event} of {arguments.events}", flush=True)
    pairs = pd.concat(told, ignore_index=True)
    measured = "\n".join(page(pairs))
    print(measured)
    said = arguments.output.read_text(encoding="utf-8").split(MEASURED)[0]
    arguments.output.write_text(f"{said}{MEASURED}\n\n{measured}\n", encoding="utf-8")
    figures = arguments.output.parent / "figures"
    draw_reliability(list(by_place(pairs)), figures / "calibration_reliability.png")
    draw_demands(demands(pairs, "demand_exact"), figures / "calibration_demand.png")


if __name__ == "__main__":
    main()
