"""
A real earthquake from start to end: a recorded session, written as docs/start/earthquake.md.

Run it as ``python workflows/real_earthquake.py``; real data are those of PER_OBSPY_DATA, else of
``../shared/data``. The records are those of Ridgecrest 2019 (M7.1). The outlines are a quarter of
San José as OpenStreetMap would have it, moved to Ridgecrest, so that records and buildings meet.
Commands, answers, numbers in sentences and pictures are those of this version; the pictures of the
page need Chromium and keep their old state without it.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd
import pyogrio
import shapely
from PIL import Image

CHECKOUT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("PER_OBSPY_DATA", CHECKOUT.parent / "shared" / "data"))
PAGE = CHECKOUT / "docs" / "start" / "earthquake.md"
FIGURES = CHECKOUT / "docs" / "figures"

#: Ridgecrest, longitude and latitude, degrees.
TOWN = np.array([-117.67, 35.625])

#: Lines of an answer that the page shows, and letters of a line; more end with an ellipsis.
LINES, LETTERS = 26, 120

HEAD = """# A real earthquake from start to end

<!-- no block is run: workflows/real_earthquake.py records this page from real records -->

Ridgecrest, California, 6 July 2019, magnitude 7.1: from eleven records and a layer of
outlines to a list of joints to look at first, as it was typed and printed on {date} with
version {version}. `python workflows/real_earthquake.py` records it again.

**The records are real. The quarter is not in Ridgecrest**: its outlines are those of a
surveyed quarter of San José (Costa Rica), as OpenStreetMap would have them, moved under the
records. The numbers describe no town.

"""


INPUTS = """## What there is

Records. With a network one command fetches them from the data centres:

```console
per-obspy fetch ci38457511 -o records --provider SCEDC
```

The session used eleven stations that were stored before; a fetch brings what the data centre
has on its day.

"""

OUTLINES = """\
Outlines. An export of OpenStreetMap (Overpass, GDAL) has `building` and, here and there,
`building:levels`; this one has it for seven of ten buildings:

"""

FIRST_RUN = """\
Seven of ten outlines have storeys, none has a height, a structural system or a period. What
is missing is derived, marked and taken as uncertain; where nothing is known the pair is left
out and counted.

## The first run

`rows.enabled=false` leaves out the rows of buildings, which take longest: they can follow when
the first list is on its way.

"""

FIRST_LOOK = """\
The first lines say what was screened and what was not. Then look at the worst pair before you
believe it:

"""

ERROR = """## An error of the survey

Two houses of {storeys} storeys, wall to wall? The layer has {tall} such buildings, among
houses of one and two storeys, and its survey notes metal roofs on them. No check can find a
survey's error that agrees with itself: storeys are possible, heights follow from them. **So
look at the worst pairs first.** Take the wrong storeys out, and run again; the program now
takes the median of the other houses, with its deviation:

"""

PICTURES = """![First screen of the page](../figures/earthquake_page.png)

`out/report.html` has the same and more; on a telephone it looks like this:

![The page on a telephone](../figures/earthquake_telephone.png)

The worst pair, in words and as a picture: its record, its spectrum, and the circles of both
motions.

"""

CONCLUSIONS = """\
![The record, the spectrum and the circles of the worst pair](../figures/earthquake_pair.png)

## What an assessor concludes

* **How many.** {rows} pairs have a verdict: {touching} are drawn wall to wall, {open} with a gap.
  {expected} are expected to hit, {apart} of them across a gap: some centimetres are enough for
  low houses in this motion.
* **How hard.** {worst} pairs are `severe` or `high`; {low} are `low`, below 0.05 m/s.
  Touching is not harm. The worst expected impact velocity is {velocity} m/s. Class and rank count
  half as much again where a tall house stands beside a low one ({tall} pairs): a pair may be
  `high`, from 0.2 m/s, without being one of those that hit hard.
* **How sure.** {sure} pairs are sure to hit (`yes`). The others depend on an assumption: outlines
  are drawn, so that 85 in 100 that touch count as one wall, and each gap is uncertain by
  0.1 m. All periods are derived from storeys. The nearest station is {station}, {near} km away,
  and the ground of the houses is unknown. Buildings are elastic here.
* **What first.** Go to {first}:
  measure the joint, count the storeys, see whether floors meet floors. Then down the list.
  {alike} of the ten worst pairs are of equal storeys: they hit only if their periods differ.
  Look whether the two houses were built alike.
* **What is missing.** {missing:,} of {neighbours:,} neighbouring pairs have no verdict, because a
  building has no storeys. They are rows of `pairs.rejected.csv`. A survey of these buildings
  gives more than another digit of the others.

"""

LAST = """\
The same command again ends at once; with one more record or a corrected outline it computes
the changed parts. [How to read the table](reading.md) explains every word, [your first
table](assessment.md) is the same with your own files, and [limits](../limits.md) lists what
these numbers are not.
"""


def main() -> None:
    """Type the session in an empty folder, and write the page with its pictures."""
    with tempfile.TemporaryDirectory() as folder:
        desk = Path(folder)
        shutil.copytree(DATA / "records" / "ridgecrest2019_mseed", desk / "records")
        draw_quarter(desk / "quarter.geojson")
        page = session(desk)
    PAGE.write_text(page, encoding="utf-8")
    print(PAGE)


def session(desk: Path) -> str:
    """Return the page: what is typed, what is printed, and what an assessor sees in it."""
    head = HEAD.format(date=f"{datetime.now(UTC):%d %B %Y}".lstrip("0"), version=version(desk))
    parts = [head, INPUTS]
    parts += [typed("per-obspy info records", desk), OUTLINES]
    parts += [typed("per-obspy info quarter.geojson", desk), FIRST_RUN]
    run = "per-obspy run records quarter.geojson -o out --set rows.enabled=false"
    parts += [typed(run, desk), FIRST_LOOK, typed("per-obspy show '#1' out", desk)]
    towers = heights(desk)
    parts.append(ERROR.format(tall=len(towers), storeys=int(towers.max())))
    mend = 'sed -i \'s/, "building:levels": "32"//\' quarter.geojson'
    parts += [typed(f"{mend}\n{run} --quiet\ncat out/summary.txt", desk)]
    shutil.copy(desk / "out" / "figures" / "worst_pair.png", FIGURES / "earthquake_pair.png")
    shrink(FIGURES / "earthquake_pair.png")
    for name, width, height in (("page", 1280, 1300), ("telephone", 400, 900)):
        photograph(desk / "out" / "report.html", FIGURES / f"earthquake_{name}.png", width, height)
    parts += [PICTURES, typed("per-obspy show '#1' out", desk), conclusions(desk / "out"), LAST]
    return "".join(parts)


def version(desk: Path) -> str:
    """Return the version of the program."""
    return ask("per-obspy --version", desk).split()[-1]


def heights(desk: Path) -> pd.Series:
    """Return the storeys of all buildings of the tallest kind."""
    storeys = pd.read_parquet(desk / "out" / "pairs.buildings.parquet")["storeys"].astype(float)
    return storeys[storeys == storeys.max()]


def conclusions(out: Path) -> str:
    """Return what an assessor concludes, with the numbers of the table."""
    table = pd.read_parquet(out / "risk.parquet")
    touching, classes = table["gap"] == 0.0, table["risk_class"]
    search = json.loads((out / "run.json").read_text(encoding="utf-8"))["coverage"]["search"]
    missing = sum(search["left_out"].values())
    return CONCLUSIONS.format(
        rows=len(table),
        missing=missing,
        neighbours=search["pairs"] + missing,
        expected=f"{table['probability'].sum():.0f}",
        touching=touching.sum(),
        open=(~touching).sum(),
        apart=f"{table.loc[~touching, 'probability'].sum():.0f}",
        tall=table["configuration"].str.contains("tall_beside_low").sum(),
        worst=classes.isin(["severe", "high"]).sum(),
        low=f"{(classes == 'low').mean():.0%}",
        velocity=f"{table['expected_impact_velocity'].max():.2f}",
        sure=(table["state"] == "yes").sum(),
        station=table["station"].value_counts().index[0],
        near=f"{table['distance'].median() / 1000.0:.0f}",
        alike=(table["storeys_1"] == table["storeys_2"]).head(10).sum(),
        first=", ".join(f"`{pair}`" for pair in table["pair_id"].head(3)),
    )


def draw_quarter(path: Path) -> None:
    """Write the outlines as GeoJSON of OpenStreetMap, one feature per line, around the town."""
    layer = DATA / "inventories" / "footprints" / "san_jose_pilot_region_all_fields.gpkg"
    _, _, geometries, (numbers, storeys) = pyogrio.raw.read(layer, columns=["id", "n_storeys"])
    outlines = shapely.from_wkb(geometries)
    drawn = shapely.is_geometry(outlines) & ~np.isnan(numbers)
    # Longitudes widen with the latitude, so that widths in metres stay
    centre = shapely.get_coordinates(outlines[drawn]).mean(axis=0)[:2]
    wider = np.cos(np.deg2rad(centre[1])) / np.cos(np.deg2rad(TOWN[1]))
    moved = shapely.transform(outlines[drawn], lambda xy: TOWN + (xy - centre) * [wider, 1.0])
    features = []
    for outline, number, levels in zip(moved, numbers[drawn], storeys[drawn], strict=True):
        # What nobody surveyed has no storeys, and "yes" for a use
        tags = {"@id": f"way/{number:.0f}", "building": "yes"}
        if not np.isnan(levels):
            tags |= {"building": "residential", "building:levels": f"{levels:.0f}"}
        geometry = json.loads(shapely.to_geojson(shapely.set_precision(outline, 1e-8, "pointwise")))
        features.append(json.dumps({"type": "Feature", "properties": tags, "geometry": geometry}))
    text = ",\n".join(features)
    path.write_text(f'{{"type": "FeatureCollection", "features": [\n{text}\n]}}\n', "utf-8")


def photograph(page: Path, picture: Path, width: int, height: int) -> None:
    """Draw the first screen of a page by Chromium, if there is one."""
    browser = shutil.which("chromium")
    if browser is None:
        print(f"no chromium: {picture} stays as it is")
        return
    words = ["--headless", "--no-sandbox", "--hide-scrollbars", f"--window-size={width},{height}"]
    words += ["--virtual-time-budget=8000", f"--screenshot={picture}", page.as_uri()]
    subprocess.run([browser, *words], check=True, capture_output=True)
    shrink(picture)


def shrink(picture: Path) -> None:
    """Keep 256 colours of a picture, which makes its file half as large."""
    with Image.open(picture) as image:
        few = image.convert("RGB").quantize(256)
    few.save(picture, optimize=True)


def typed(commands: str, desk: Path) -> str:
    """Return a block of the page: commands and their answers."""
    lines = []
    for command in commands.splitlines():
        began = time.monotonic()
        answer = ask(command, desk)
        seconds = time.monotonic() - began
        lines.append(f"$ {command}" + (f"  # {seconds:.0f} s" if seconds > 10.0 else ""))
        lines += [line.rstrip() for line in answer.splitlines()[:LINES]]
        lines += ["…"] * (len(answer.splitlines()) > LINES)
    text = "\n".join(line if len(line) <= LETTERS else line[: LETTERS - 1] + "…" for line in lines)
    return f"```console\n{text}\n```\n\n"


def ask(command: str, desk: Path) -> str:
    """Return the answer of a command, with the folder of the desk as ~ and progress left out."""
    program = f"{sys.executable} -m per_obspy"
    done = subprocess.run(
        command.replace("per-obspy", program),
        shell=True,  # the commands are those of a shell
        cwd=desk,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    text = done.stdout.replace(str(desk), "~").replace("python -m per_obspy", "per-obspy")
    return "\n".join(line for line in text.splitlines() if not re.search(r": \d+ of \d+$", line))


if __name__ == "__main__":
    main()
