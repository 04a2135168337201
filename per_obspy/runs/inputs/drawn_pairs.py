"""Pairs of a run from footprints: found once and written into the output folder."""

from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from per_obspy.config import Run, Totals
from per_obspy.config.pairs import Footprints
from per_obspy.errors import require_extra
from per_obspy.files import content_hash, file_hash, remove_file
from per_obspy.progress import Progress
from per_obspy.resume import earlier_status, write_status

if TYPE_CHECKING:
    from per_obspy.inventory.footprints.footprint_pairs import FootprintPairs
    from per_obspy.results.coverage import Search

#: Table of the pairs, its rejections, and the status file by which they are kept.
PAIRS, REJECTED, STATUS = "pairs.parquet", "pairs.rejected.csv", "pairs.json"

#: Buildings with usable outlines, to which the pairs refer.
BUILDINGS = "pairs.buildings.parquet"

#: Names of the counts of a search.
COUNTED = ("pairs", "rejected")

#: Further files of a Shapefile.
_PARTS = (".dbf", ".shx", ".prj", ".cpg")


def write_drawn_pairs(settings: Run, folder: Path, progress: Progress) -> dict[str, int]:
    """
    Find the pairs of the configured footprints unless the output folder has them already.

    Parameters
    ----------
    settings : Run
        The settings; without footprints the function returns at once.
    folder : Path
        Of the results; ``pairs.parquet`` and ``pairs.rejected.csv`` are written there.
    progress : callable
        Called when the search begins and ends.

    Returns
    -------
    counts : dict
        Numbers of pairs and of rejected buildings and pairs; empty without footprints.

    Raises
    ------
    CatalogError
        If the layer cannot be read or holds no pair.
    MissingExtra
        If the libraries of footprints are not installed.
    """
    footprints = settings.pairs.footprints if settings.pairs else None
    if footprints is None:
        return {}
    require_extra("gis", "pyogrio", "pyproj", "shapely")
    if footprints.heights:
        require_extra("raster", "rasterio")
    # The same layer and options give the same pairs
    key = _key(footprints)
    if earlier := earlier_status(folder / STATUS, key):
        return {name: earlier[name] for name in COUNTED}
    progress("finding pairs", 0, 1)
    remove_file(folder / STATUS)
    counts = _write_found(footprints, folder)
    # Written last: a killed search is done again
    hashes = {name: file_hash(folder / name) for name in (PAIRS, REJECTED, BUILDINGS)}
    write_status(folder / STATUS, key, hashes, counts)
    progress("finding pairs", 1, 1)
    return counts


def _write_found(footprints: Footprints, folder: Path) -> dict[str, int]:
    """Find pairs, write them with their buildings and rejections, and return the numbers."""
    # A finished run does not wait for this
    from per_obspy.inventory.footprints.footprint_pairs import find_footprint_pairs

    options, raster = _options(footprints), footprints.heights
    found = find_footprint_pairs(footprints.file, **options, heights=raster)
    write_search(found, folder / PAIRS)
    return dict(zip(COUNTED, (len(found.pairs), len(found.pairs.attrs["rejected"])), strict=True))


def write_search(found: "FootprintPairs", path: Path) -> "Search":
    """
    Write found pairs, and their buildings and rejections next to them.

    Returns
    -------
    Search
        Account of neighbours and of those that are left out, which a Parquet table holds too.
    """
    from per_obspy.inventory.files.writing import write_pairs
    from per_obspy.inventory.footprints.footprint_pairs import write_buildings
    from per_obspy.results.coverage import as_metadata, search_account
    from per_obspy.results.table_files import write_rejected
    from per_obspy.results.totals import named_cells

    # What is left out belongs to the cells of a run's totals
    rejected, places = found.pairs.attrs["rejected"], found.left_out
    areas = list(named_cells(places[:, 0], places[:, 1], Totals().cell).cell) if len(places) else []
    search = search_account(len(found.pairs), rejected, areas, found.restricted)
    write_pairs(found.pairs, path, as_metadata(search))
    write_buildings(found.buildings, path.with_suffix(".buildings.parquet"))
    write_rejected(rejected, path.with_suffix(".rejected.csv"))
    return search


def pair_table(settings: Run, folder: Path) -> Path | None:
    """Return the pair table of a run: the configured file, or that made from footprints."""
    pairs = settings.pairs
    if pairs and pairs.footprints:
        return folder / PAIRS
    return pairs.file if pairs else None


def footprint_files(footprints: Footprints) -> list[Path]:
    """Return the files of the layer, and the raster of its heights."""
    return [*layer_files(footprints.file), *filter(None, [footprints.heights])]


def layer_files(layer: Path) -> list[Path]:
    """Return all files of a layer; a Shapefile has several."""
    parts = [layer.with_suffix(suffix) for suffix in _PARTS] if layer.suffix == ".shp" else []
    return [layer, *(part for part in parts if part.is_file())]


def _options(footprints: Footprints) -> dict[str, Any]:
    """Return the configured options of the search for pairs; others keep their defaults."""
    return footprints.model_dump(exclude={"file", "heights"}, exclude_none=True)


def _key(footprints: Footprints) -> str:
    """Return the hash of the program, the options and the content of the layer."""
    files = [path for path in footprint_files(footprints) if path.is_file()]
    content = {
        "version": version("per_obspy"),
        "options": _options(footprints),
        "files": {path.suffix: file_hash(path) for path in files},
    }
    return content_hash(content)
