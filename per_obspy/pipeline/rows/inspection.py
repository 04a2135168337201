"""Plan of inspection: order in which teams visit the worst buildings of a run."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.errors import CatalogError, NothingUsable, require_extra
from per_obspy.report.plan.plan_files import visit_table, write_plan
from per_obspy.report.plan.visits import Teams, largest_number, planned_visits
from per_obspy.resume import StatusError, read_status
from per_obspy.screening.building_rows.row_columns import BUILDINGS
from per_obspy.screening.ground_motion.spatial_correlation import great_circle

#: Columns of the buildings that the plan carries.
CARRIED = (
    "rank", "building_id", "risk_class", "severity", "worst_neighbour", "worst_azimuth",
    "prevention", "position", "occupants", "area", "longitude", "latitude", "flags",
)  # fmt: skip

#: Buildings that are read for each visit that is possible: some lie too far.
READ = 2

#: Buildings that are read together.
ROWS = 50_000


class Plan(NamedTuple):
    """
    Plan of inspection.

    Attributes
    ----------
    files : list of Path
        ``plan.csv``, ``plan.columns.csv``, ``plan.gpx``, and ``plan.gpkg`` on request.
    visits : DataFrame
        One row per visit, in the order of teams and visits.
    buildings : int
        Buildings that a neighbour can hit.
    facts : dict
        Name of the run, and whether its motion is simulated.
    """

    files: list[Path]
    visits: pd.DataFrame
    buildings: int
    facts: Mapping[str, str]


def plan_inspection(results: Path, teams: Teams, output: Path, layer: bool = False) -> Plan:
    """
    Plan the visits of teams to the buildings of a run that a neighbour can hit.

    Parameters
    ----------
    results : Path
        Folder of a finished run with ``buildings.parquet``.
    teams : Teams
        Teams and their pace.
    output : Path
        Folder of the plan.
    layer : bool
        Whether to write ``plan.gpkg`` too.

    Raises
    ------
    CatalogError
        If the run is unfinished or has no buildings, or a start is far from all of them.
    MissingExtra
        If an optional library is not installed.
    NothingUsable
        If no neighbour can hit any building.
    """
    require_extra("plan", "pyvrp", "gpxpy")
    if layer:
        require_extra("gis", "pyogrio", "shapely")
    facts = _facts(results)
    buildings, count = _buildings(results / "buildings.parquet", READ * largest_number(teams))
    if buildings.empty:
        raise NothingUsable(str(results), "no neighbour can hit any building")
    _check_starts(teams, buildings)
    # Visits, then their files
    table = visit_table(planned_visits(buildings, teams), buildings)
    meanings = {column.name: column for column in BUILDINGS}
    files = write_plan(table, [meanings[name] for name in CARRIED], output)
    if layer:
        files.append(_write_layer(table, output / "plan.gpkg", facts))
    return Plan(files, table, count, facts)


def _facts(results: Path) -> dict[str, str]:
    """Return name of a finished run and whether its motion is simulated."""
    file = results / "run.json"
    # The run is whole, and has buildings
    try:
        record = read_status(file)
    except StatusError as error:
        raise CatalogError(str(file), "no finished run here: run `per-obspy run` first") from error
    if record.get("state") == "unfinished":
        raise CatalogError(str(file), "no finished run here: the last one is unfinished, run again")
    if not (results / "buildings.parquet").is_file():
        raise CatalogError(
            str(results),
            "has no buildings.parquet: the pair table needs building_id_1 and building_id_2",
        )
    simulated = str(bool(record.get("simulated"))).lower()
    return {"name": str(record.get("name", "")), "simulated": simulated}


def _buildings(path: Path, wanted: int) -> tuple[pd.DataFrame, int]:
    """Return the worst buildings that a neighbour can hit, and the number of all of them."""
    pieces, found, count = list[pd.DataFrame](), 0, 0
    try:
        with pq.ParquetFile(path.absolute(), pre_buffer=False) as file:
            for batch in file.iter_batches(ROWS, columns=[*CARRIED, "neighbours_that_can_hit"]):
                piece = batch.to_pandas()
                hit = piece[piece["neighbours_that_can_hit"] > 0]
                count += len(hit)
                # The table is ordered, worst first
                if found < wanted:
                    pieces.append(hit.head(wanted - found))
                    found += len(pieces[-1])
    except (pa.ArrowException, KeyError) as error:
        raise CatalogError(str(path), f"is no table of buildings: {error}") from error
    return pd.concat(pieces, ignore_index=True)[[*CARRIED]], count


def _check_starts(teams: Teams, buildings: pd.DataFrame) -> None:
    """Raise ``CatalogError`` if no building can be reached in time, as from swapped coordinates."""
    reach = teams.speed * (teams.shift - teams.inspection) / teams.detour
    east, north = (buildings[name].to_numpy(np.float64) for name in ("longitude", "latitude"))
    for longitude, latitude in teams.starts:
        nearest = float(np.nanmin(great_circle(longitude, latitude, east, north)))
        # A start far from everything is a mistake
        if nearest > reach:
            raise CatalogError(
                "start",
                f"{longitude:g},{latitude:g} is {nearest / 1000:.3g} km from the nearest building, "
                f"{reach / 1000:.3g} km are possible in the time of a team: give longitude, then "
                "latitude, in degrees",
            )


def _write_layer(table: pd.DataFrame, path: Path, facts: Mapping[str, str]) -> Path:
    """Write the visits as points and the routes as lines, for QGIS."""
    from per_obspy.report.plan.plan_layers import write_plan_layers

    write_plan_layers(table, path, facts)
    return path
