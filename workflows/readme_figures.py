"""
The figures of the README, from the demonstration: a pair from its record on, and the region.

``make figures`` writes them to ``output/readme_figures``; with ``-o docs/figures`` they are those
of the README and of the first page of the docs. The demonstration is run first where it is not
done.
"""

import argparse
import shutil
from pathlib import Path

from real_earthquake import photograph

from per_obspy.runs.run import run

CHECKOUT = Path(__file__).resolve().parents[1]

#: Picture of the README -> figure of the demonstration.
FIGURES = {"walk.png": "worst_pair.png", "overview.png": "overview.png"}


def main() -> None:
    """Run the demonstration unless it is done, and copy its figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("-o", "--output", type=Path, default=CHECKOUT / "output" / "readme_figures")
    folder = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    result = run(CHECKOUT / "workflows" / "demo.toml")
    for name, figure in FIGURES.items():
        shutil.copyfile(result.folder / "figures" / figure, folder / name)
    photograph(result.folder / "report.html", folder / "page_1280.png", 1280, 1240)
    print(f"figures are in {folder}")


if __name__ == "__main__":
    main()
