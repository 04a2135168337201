"""``per-obspy plan``: order of inspection of the buildings that a neighbour can hit."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from per_obspy.commands.endings import AsJson, output_option
from per_obspy.commands.printing import print_table

if TYPE_CHECKING:
    from per_obspy.pipeline.rows.inspection import Plan

#: Columns of the visits that are printed, with their titles.
SHOWN = {
    "team": "team",
    "visit": "visit",
    "arrival": "arrival (min)",
    "building_id": "building",
    "rank": "rank",
    "risk_class": "class",
    "way": "way (m)",
    "worst_neighbour": "next to",
}

#: Visits of each team that are printed.
PRINTED = 3


def plan(
    results: Annotated[Path, typer.Argument(help="Folder of a finished run.")],
    start: Annotated[
        list[str],
        typer.Option(help="Where the teams start: LONGITUDE,LATITUDE in degrees; repeat per team."),
    ],
    output: Annotated[
        Path | None, output_option("Folder of the plan; that of the run if not given.")
    ] = None,
    teams: Annotated[int, typer.Option(min=1, max=1000, help="Number of teams.")] = 1,
    hours: Annotated[float, typer.Option(min=0.1, max=24, help="Time of each team.")] = 8.0,
    minutes: Annotated[float, typer.Option(min=1, max=600, help="Time in a building.")] = 20.0,
    speed: Annotated[float, typer.Option(min=0.1, max=120, help="On the way, km/h.")] = 4.0,
    detour: Annotated[
        float, typer.Option(min=1, max=5, help="Way along streets over the straight line.")
    ] = 1.4,
    block: Annotated[
        int,
        typer.Option(
            min=1, max=100, help="Visits of a team ordered by distance; 1: strictly by rank."
        ),
    ] = 8,
    geopackage: Annotated[
        bool, typer.Option("--geopackage", help="Write plan.gpkg for QGIS too.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """
    Plan the visits of teams to the buildings that a neighbour can hit: a first order by rank.

    Streets, closures, daylight and damage are unknown to the plan: whoever dispatches the teams
    decides.

    Example: per-obspy plan output/san_jose --teams 4 --start=-84.08,9.93
    """
    from per_obspy.pipeline.rows.inspection import plan_inspection
    from per_obspy.report.plan.visits import Teams

    # One start for all teams, or one of each
    starts = [_place(text) for text in start]
    if len(starts) == 1:
        starts *= teams
    if len(starts) != teams:
        raise typer.BadParameter(f"{len(starts)} starts of {teams} teams: give one, or one a team")
    seconds = Teams(starts, 3600.0 * hours, 60.0 * minutes, speed / 3.6, detour, block)
    found = plan_inspection(results, seconds, output or results, geopackage)
    if as_json:
        counts = {"visits": len(found.visits), "buildings": found.buildings}
        print(json.dumps({**counts, **found.facts, "files": [str(path) for path in found.files]}))
    else:
        _print_plan(found)


def _place(text: str) -> tuple[float, float]:
    """Parse the start of a route as longitude and latitude, degrees."""
    try:
        longitude, latitude = (float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(f"start {text!r} is not LONGITUDE,LATITUDE") from None
    if not (abs(longitude) <= 180.0 and abs(latitude) <= 90.0):
        raise typer.BadParameter(f"start {text!r} is outside 180 and 90 degrees")
    return longitude, latitude


def _print_plan(plan: "Plan") -> None:
    """Print the first visits of each team, and the files."""
    if plan.facts["simulated"] == "true":
        print("The ground motion is SIMULATED.")
    # The first visits of each team are enough on a screen
    visits = plan.visits
    later = plan.buildings - len(visits)
    print(
        f"{len(visits)} visits of {visits['team'].nunique()} teams; {later} buildings that a "
        "neighbour can hit are left for later"
    )
    first = visits[visits["visit"] <= PRINTED]
    rows = first[[*SHOWN]].itertuples(index=False)
    print_table(f"The first {PRINTED} visits of each team", list(SHOWN.values()), rows)
    print("A first order by rank and distance: streets and closures are not known to it.")
    for path in plan.files:
        print(f"  {path}")
