"""
The figures of the README, from the demonstration: a pair from its record on, region and page.

``make figures`` writes them to ``output/readme_figures``; with ``-o docs/figures`` they are those
of the README and of the first page of the docs, and the pair on a telephone of docs/page.md, which
needs the extra ``browser``. The demonstration is run first where it is not done.
"""

import argparse
import importlib.util
import shutil
from pathlib import Path

from real_earthquake import photograph, shrink

from per_obspy.runs.run import run

CHECKOUT = Path(__file__).resolve().parents[1]

#: Picture of the README -> figure of the demonstration.
FIGURES = {"walk.png": "worst_pair.png", "overview.png": "overview.png"}


def photograph_pair(page: Path, picture: Path) -> None:
    """Draw the panel of the worst pair on a telephone, by Chromium under Playwright."""
    browser = shutil.which("chromium")
    if browser is None or importlib.util.find_spec("playwright") is None:
        print(f"no chromium or playwright: {picture} stays as it is")
        return
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        program = driver.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        opened = program.new_page(viewport={"width": 400, "height": 900})
        opened.goto(page.as_uri())
        opened.click("#pairs tbody tr:first-child button")
        # The panel from its frame on
        top = opened.evaluate("document.getElementById('detail').offsetTop")
        clip = {"x": 0, "y": top - 8, "width": 400, "height": 1500}
        opened.screenshot(path=picture, full_page=True, clip=clip)
        program.close()
    shrink(picture)


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
    photograph_pair(result.folder / "report.html", folder / "page_400.png")
    print(f"figures are in {folder}")


if __name__ == "__main__":
    main()
