"""
Order in which teams visit buildings: by rank, and by distance among buildings of similar rank.

The buildings are taken in blocks of falling rank, as many as all teams visit in a few hours. Within
a block PyVRP finds the routes with the least walking; each team begins a block where the block
before ended. Distances are great circles times a factor for the way along streets.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.screening.ground_motion.spatial_correlation import great_circle

if TYPE_CHECKING:
    from pyvrp import Client, ProblemData

#: Iterations of PyVRP for a block, and the seed of its random numbers: the same visits every time.
ITERATIONS, SEED = 300, 1

#: Value of a visit over the longest way in a block, so that no visit is left out to save a way.
PRIZE = 10

Place = tuple[float, float]


class Teams(NamedTuple):
    """
    Teams and their pace.

    Attributes
    ----------
    starts : sequence of (float, float)
        Longitude and latitude where each team starts, degrees.
    shift : float
        Time of each team, s.
    inspection : float
        Time in a building, s.
    speed : float
        m/s.
    detour : float
        Way along streets over the great circle.
    block : int
        Visits of a team between which the order is by distance.
    """

    starts: Sequence[Place]
    shift: float
    inspection: float
    speed: float
    detour: float
    block: int


class _State(NamedTuple):
    """Longitude, latitude (degrees) and time left (s) of each team."""

    longitude: FloatArray
    latitude: FloatArray
    left: FloatArray


def largest_number(teams: Teams) -> int:
    """Return the largest number of buildings that the teams can visit, without travel time."""
    return int(teams.shift // teams.inspection) * len(teams.starts)


def planned_visits(buildings: pd.DataFrame, teams: Teams) -> pd.DataFrame:
    """
    Plan the visits of teams to buildings.

    Parameters
    ----------
    buildings : DataFrame
        Worst first, with ``severity``, ``longitude`` and ``latitude``.
    teams : Teams
        Teams and their pace.

    Returns
    -------
    DataFrame
        One row per visit: ``team`` and ``visit`` from 1, ``building`` (row of ``buildings``),
        ``way`` from the place before (m), ``arrival`` and ``departure`` (s after the start), in the
        order of teams and visits.
    """
    # Where each team is, and its time
    starts = np.array(teams.starts, dtype=np.float64)
    left = np.full(len(starts), float(teams.shift))
    state = _State(starts[:, 0].copy(), starts[:, 1].copy(), left)
    rows = np.flatnonzero(buildings[["longitude", "latitude"]].notna().all(axis=1))
    visits: list[dict[str, float]] = []
    size = teams.block * len(starts)
    for first in range(0, rows.size, size):
        # A team without time for one more building has ended
        if state.left.max() < teams.inspection:
            break
        block = rows[first : first + size]
        for team, route in enumerate(_routes(buildings.iloc[block], state, teams)):
            visits += _walked(buildings, block[route], team, state, teams)
    return _in_order(pd.DataFrame(visits, columns=["team", "building", "way", "departure"]), teams)


def _routes(block: pd.DataFrame, state: _State, teams: Teams) -> list[NDArray[np.intp]]:
    """Return the rows of a block in the order in which each team visits them."""
    from pyvrp import solve
    from pyvrp.stop import MaxIterations

    # The same random numbers every time
    found = solve(_problem(block, state, teams), MaxIterations(ITERATIONS), seed=SEED).best
    routes = [np.empty(0, dtype=np.intp) for _ in teams.starts]
    for route in found.routes() if found.is_feasible() else ():
        clients = [place.idx for place in route if place.is_client()]
        routes[route.vehicle_type()] = np.array(clients, dtype=np.intp)
    return routes


def _problem(block: pd.DataFrame, state: _State, teams: Teams) -> "ProblemData":
    """Return a block as a problem of routes: one vehicle per team, one client per building."""
    from pyvrp import Depot, Location, ProblemData, VehicleType

    # Places: the teams, the end of all routes, the buildings
    end = len(teams.starts)
    longitude = np.concatenate([state.longitude, [0.0], block["longitude"]])
    latitude = np.concatenate([state.latitude, [0.0], block["latitude"]])
    ways = _ways(longitude, latitude, end, teams.detour)
    places = [Location(*place) for place in zip(longitude, latitude, strict=True)]
    depots = [Depot(place) for place in range(end + 1)]
    # Every team starts where it is, with the time that it has left
    vehicles = [
        VehicleType(1, [teams.block], team, end, shift_duration=int(left))
        for team, left in enumerate(state.left.tolist())
    ]
    clients = _clients(block, end + 1, int(ways.max()), round(teams.inspection))
    matrices: list[Any] = [[ways], [np.rint(ways / teams.speed).astype(np.int64)]]
    return ProblemData(places, clients, depots, vehicles, *matrices)


def _clients(block: pd.DataFrame, first: int, longest: int, inspection: int) -> "list[Client]":
    """Return the buildings as optional clients of the routes, each with its prize."""
    from pyvrp import Client

    return [
        Client(first + row, [1], service_duration=inspection, prize=prize, required=False)
        for row, prize in enumerate(_prizes(block, longest))
    ]


def _prizes(block: pd.DataFrame, longest: int) -> list[int]:
    """Return the values of visits, m: up to twice as much for a worse building."""
    severity = block["severity"].fillna(0.0).to_numpy(np.float64)
    worth = 1.0 + severity / max(float(severity.max()), np.finfo(np.float64).tiny)
    prizes: list[int] = np.rint(PRIZE * (1 + longest) * worth).astype(np.int64).tolist()
    return prizes


def _ways(
    longitude: FloatArray, latitude: FloatArray, end: int, detour: float
) -> NDArray[np.int64]:
    """Return the distances between all places along streets, m; 0 to the end of a route."""
    apart = great_circle(longitude[:, None], latitude[:, None], longitude, latitude)
    ways = np.rint(detour * apart).astype(np.int64)
    ways[end, :] = ways[:, end] = 0
    return ways


def _walked(
    buildings: pd.DataFrame, route: NDArray[np.intp], team: int, state: _State, teams: Teams
) -> list[dict[str, float]]:
    """Return the visits of a team in a block, and move the team to its last building."""
    visits = []
    for row in route.tolist():
        longitude, latitude = buildings[["longitude", "latitude"]].iloc[row]
        from_place = state.longitude[team], state.latitude[team]
        way = float(round(teams.detour * float(great_circle(*from_place, longitude, latitude))))
        # The building is the place from which the next way begins
        state.longitude[team], state.latitude[team] = longitude, latitude
        state.left[team] -= way / teams.speed + teams.inspection
        ended = teams.shift - state.left[team]
        visits.append({"team": team, "building": row, "way": way, "departure": ended})
    return visits


def _in_order(visits: pd.DataFrame, teams: Teams) -> pd.DataFrame:
    """Return visits by team and time, numbered from 1, with their arrivals."""
    ordered = visits.sort_values(["team", "departure"]).reset_index(drop=True)
    # Numbers from 1, per team
    number = ordered.groupby("team").cumcount() + 1
    return pd.DataFrame(
        {
            "team": ordered["team"].astype(np.int64) + 1,
            "visit": number.astype(np.int64),
            "building": ordered["building"].astype(np.int64),
            "way": ordered["way"].astype(np.float64),
            "arrival": ordered["departure"].astype(np.float64) - teams.inspection,
            "departure": ordered["departure"].astype(np.float64),
        }
    )
