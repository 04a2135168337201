"""Files of a plan of visits: a table, routes for receivers (GPX), and layers for QGIS."""

from collections.abc import Hashable, Mapping
from pathlib import Path

import pandas as pd

from per_obspy.errors import printable
from per_obspy.files import written_whole
from per_obspy.inventory.schema import Column
from per_obspy.tables.rounding import rounded_table
from per_obspy.tables.table_files import write_csv, write_described

#: Columns of the table of visits; those of the building follow.
VISITS = (
    Column("team", "int64", "1", "number of the team"),
    Column("visit", "int64", "1", "number of the visit of this team"),
    Column("arrival", "float64", "min", "after the start, estimated"),
    Column("departure", "float64", "min", "after the start, estimated"),
    Column("way", "float64", "m", "from the place before: great circle times the detour factor"),
)

#: Seconds in a minute.
MINUTE = 60.0


def visit_table(visits: pd.DataFrame, buildings: pd.DataFrame) -> pd.DataFrame:
    """
    Return the visits with the columns of their buildings, times in minutes.

    Parameters
    ----------
    visits : DataFrame
        From :func:`per_obspy.report.plan.visits.planned_visits`.
    buildings : DataFrame
        The same as for the plan.
    """
    visited = buildings.iloc[visits["building"]].reset_index(drop=True)
    leading = pd.DataFrame(
        {
            "team": visits["team"],
            "visit": visits["visit"],
            "arrival": (visits["arrival"] / MINUTE).round(1),
            "departure": (visits["departure"] / MINUTE).round(1),
            "way": visits["way"].round(),
        }
    )
    return pd.concat([leading, visited], axis=1)


def write_plan(table: pd.DataFrame, described: list[Column], folder: Path) -> list[Path]:
    """
    Write ``plan.csv``, ``plan.columns.csv`` and ``plan.gpx``.

    Parameters
    ----------
    table : DataFrame
        From :func:`visit_table`.
    described : list of Column
        Meanings of the columns of the buildings.
    folder : Path
        Where to.
    """
    files = [folder / name for name in ("plan.csv", "plan.columns.csv", "plan.gpx")]
    text, columns, routes = files
    write_csv(rounded_table(table, own=[column.name for column in described]), text)
    write_described([*VISITS, *described], columns)
    with written_whole(routes) as part:
        part.write_text(gpx_routes(table), encoding="utf-8")
    return files


def gpx_routes(table: pd.DataFrame) -> str:
    """Return one route per team, as GPX 1.1."""
    from gpxpy.gpx import GPX, GPXRoute, GPXRoutePoint

    document = GPX()
    document.creator = "per_obspy"
    for team, visits in table.groupby("team"):
        route = GPXRoute(name=f"team {team}")
        for visit in visits.to_dict("records"):
            # Names are data: only printable letters
            name = printable(f"{visit['visit']}: {visit['building_id']}")
            point = GPXRoutePoint(visit["latitude"], visit["longitude"], name=name)
            point.description = printable(_description(visit))
            route.points.append(point)
        document.routes.append(route)
    return str(document.to_xml("1.1"))


def _description(visit: Mapping[Hashable, object]) -> str:
    """Return the reason of a visit as one line."""
    return f"rank {visit['rank']}, {visit['risk_class']}, next to {visit['worst_neighbour']}"
