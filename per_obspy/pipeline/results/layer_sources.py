"""Map layers of a run: pairs, buildings, stations and areas, with the optional libraries."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pandas as pd

from per_obspy.report.overview import Region
from per_obspy.tables.totals import RegionTotals


def layer_paths(folder: Path, stem: str) -> tuple[Path, Path, Path]:
    """Return the files of the layers: GeoPackage, project of QGIS, GeoParquet."""
    return folder / f"{stem}.gpkg", folder / f"{stem}.qgz", folder / f"{stem}.geoparquet"


def outlines_beside(*pairs: Path | None) -> Path | None:
    """Return the first file of outlines that lies next to one of these pair tables, if any."""
    for table in pairs:
        if table is not None and (found := table.with_suffix(".buildings.parquet")).is_file():
            return found
    return None


def write_map_layers(
    pieces: Iterator[pd.DataFrame],
    region: Region,
    stations: pd.DataFrame,
    totals: Callable[[], RegionTotals | None],
    outlines: Path | None,
    files: tuple[Path, Path, Path],
) -> None:
    """Write the layers of a table; see :func:`per_obspy.report.layers.map_layers.write_layers`."""
    from per_obspy.report.layers.map_layers import MapSources, write_layers

    facts = {"name": region.title, "simulated": str(region.simulated).lower()}
    ranked = files[0].with_name("buildings.parquet")
    sources = MapSources(region.classes, facts, stations, totals, ranked, outlines)
    write_layers(pieces, sources, files)
