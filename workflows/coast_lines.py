"""
Make the coast lines and borders that come with the package, from Natural Earth.

Natural Earth 1:10 million is in the public domain. It is taken as TopoJSON from the npm package
world-atlas 2.0.2 (`npm pack world-atlas@2.0.2`, ISC licence)::

    python workflows/coast_lines.py package/countries-10m.json
"""

import json
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import shapely

OUTPUT = Path(__file__).parents[1] / "per_obspy" / "report" / "page" / "assets" / "coast_lines.npz"

#: Degrees: of the stored coordinates, by which lines are simplified, and of the longest step.
UNIT, TOLERANCE, LONGEST = 0.002, 0.003, 60.0


def arcs_of(geometry: Any) -> Iterator[int]:
    """Yield the number of every arc of a geometry, however nested; ~n is n backwards."""
    if isinstance(geometry, int):
        yield geometry if geometry >= 0 else ~geometry
    else:
        for part in geometry:
            yield from arcs_of(part)


def main() -> None:
    """Write the lines: an arc of two countries is a border, of one a coast."""
    atlas = json.loads(Path(sys.argv[1]).read_text())
    countries = atlas["objects"]["countries"]["geometries"]
    uses = Counter(arc for country in countries for arc in set(arcs_of(country["arcs"])))
    scale, shift = (np.array(atlas["transform"][name]) for name in ("scale", "translate"))

    # Arcs are stored as steps from their first point; some are points
    arcs = [shapely.linestrings(np.cumsum(arc, axis=0) * scale + shift) for arc in atlas["arcs"]]
    simple = shapely.remove_repeated_points(shapely.simplify(arcs, TOLERANCE))
    number = np.flatnonzero(shapely.length(simple) > 0)
    lines = shapely.segmentize(simple[number], LONGEST)
    corners = [np.rint(shapely.get_coordinates(line) / UNIT).astype(np.int32) for line in lines]
    steps = [np.diff(line, axis=0, prepend=line[:1]) for line in corners]

    np.savez_compressed(
        OUTPUT,
        unit=np.array(UNIT),
        starts=np.array([line[0] for line in corners], dtype=np.int32),
        lengths=np.array([len(line) for line in corners], dtype=np.int32),
        steps=np.concatenate(steps).astype(np.int16),
        is_border=np.array([uses[arc] > 1 for arc in number.tolist()]),
    )
    print(f"{OUTPUT.name}: {len(lines)} lines, {OUTPUT.stat().st_size} bytes")


if __name__ == "__main__":
    main()
