"""Facts of a screening that its summary states."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import pandas as pd

from per_obspy.report.overview import Region
from per_obspy.report.words import chance_text, name_text, number, speed_text

#: Pairs and buildings that the summary lists.
LISTED = 10

#: Stations that are named; of more their number is given.
NAMED = 8


class Counts(NamedTuple):
    """
    Numbers of the whole risk table.

    Attributes
    ----------
    states, classes : mapping of str to int
        Number of pairs of each state and class.
    expected : float
        Expected number of pounding pairs, those of unknown gap left out.
    derived, far : int
        Number of pairs with derived inputs, and of pairs far from their station.
    """

    states: Mapping[str, int]
    classes: Mapping[str, int]
    expected: float
    derived: int
    far: int

    @property
    def pairs(self) -> int:
        """Return the number of pairs."""
        return sum(self.states.values())


class SummaryFacts(NamedTuple):
    """
    Everything that a summary states.

    Attributes
    ----------
    region : Region
        Title, classes, whether the motion is simulated, stations and epicentre.
    source : list of str
        Sentences on the earthquake, spectrum or scenarios.
    counts : Counts
        Of all pairs.
    worst : DataFrame
        The worst pairs.
    buildings : DataFrame
        The worst buildings; empty where there is no table of buildings.
    stations : DataFrame
        Rows of ``stations.csv``; empty where there are none.
    area : str
        Name and place of the area with most expected pounding; empty if there are no areas.
    made : str
        When and with which version the results were made.
    """

    region: Region
    source: list[str]
    counts: Counts
    worst: pd.DataFrame
    buildings: pd.DataFrame
    stations: pd.DataFrame
    area: str
    made: str


def event_sentences(facts: Mapping[str, Any]) -> list[str]:
    """
    Return sentences on an earthquake: time, size and place, as far as they are known.

    Parameters
    ----------
    facts : mapping of str to object
        ``time`` (text), ``magnitude``, ``longitude``, ``latitude`` (degrees), ``depth`` (m), and
        ``start``, the first record.
    """
    sentences = list[str]()
    if facts.get("time"):
        day = str(facts["time"])[:19].replace("T", " ")
        sentences.append(f"Earthquake of {day} UTC.")
    elif facts.get("start"):
        day = str(facts["start"])[:16].replace("T", " ")
        sentences.append(f"Origin time unknown; first record {day} UTC.")
    # Size and place
    if math.isfinite(size := number(facts, "magnitude")):
        sentences.append(f"Magnitude {size:.1f}.")
    # A place needs both coordinates
    east, north = number(facts, "longitude"), number(facts, "latitude")
    if math.isfinite(east) and math.isfinite(north):
        place = place_text(north, east, 3)
        depth = number(facts, "depth") / 1000.0
        deep = f", depth {depth:.0f} km" if math.isfinite(depth) else ""
        sentences.append(f"Epicentre {place}{deep}.")
    return sentences


def five_numbers(facts: SummaryFacts) -> list[tuple[str, str]]:
    """Return the five numbers of the summary, each with its meaning."""
    counts, first = facts.counts, facts.region.classes[0]
    pounding = counts.states.get("yes", 0) + counts.states.get("likely", 0)
    # Of all pairs the worst ones are the fastest
    fastest = facts.worst["expected_impact_velocity"].max() if len(facts.worst) else math.nan
    return [
        (str(counts.pairs), "pairs of buildings screened"),
        (str(pounding), "pairs that pound or are likely to"),
        (f"{counts.expected:.0f}", "pairs expected to pound in all"),
        (str(counts.classes.get(first, 0)), f"pairs of the worst class, {name_text(first)}"),
        (speed_text(float(fastest)), "largest expected impact velocity"),
    ]


def station_sentences(facts: SummaryFacts) -> list[str]:
    """Say which stations were used and which are missing."""
    table = facts.stations
    if table.empty:
        return ["No station: the motion is not that of records."]
    # Rejected stations are as good as missing
    used = table.loc[table["state"] == "used", "station"].tolist()
    missing = table.loc[table["state"] != "used", "station"].tolist()
    sentences = [f"{len(used)} stations used{_named(used)}."]
    if missing:
        sentences.append(f"{len(missing)} stations missing or refused{_named(missing)}.")
    else:
        sentences.append("No station of the folder is missing.")
    return sentences


def _named(names: Sequence[str]) -> str:
    """Return the first names of a list."""
    if not names:
        return ""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ": " + ", ".join(map(name_text, names[:NAMED])) + more


def first_steps(facts: SummaryFacts) -> list[str]:
    """Return what to do first."""
    counts = facts.counts
    steps = ["Inspect the pairs below in their order, at the joint between them."]
    if facts.area:
        steps.append(f"Most pounding is expected in area {facts.area}: go there first.")
    if unknown := counts.states.get("unknown", 0):
        steps.append(f"Measure the gap of {unknown} pairs whose gap is unknown.")
    if facts.region.simulated:
        steps.append("Do not act on this as on an earthquake: its motion is simulated.")
    return steps


def sureness(facts: SummaryFacts) -> list[str]:
    """Say how sure the numbers are."""
    counts, sentences = facts.counts, list[str]()
    # States between yes and no
    middle = sum(counts.states.get(state, 0) for state in ("likely", "possible", "unlikely"))
    sentences.append(f"{middle} pairs are open: neither a clear yes nor a clear no.")
    if counts.derived:
        sentences.append(f"{counts.derived} pairs have derived inputs, such as periods by height.")
    if counts.far:
        sentences.append(f"{counts.far} pairs are far from their station.")
    sentences.append("This is a screening. It replaces no inspection, and a no is not a promise.")
    return sentences


def pair_sentence(pair: Mapping[str, Any]) -> str:
    """Return a pair of the list in one sentence."""
    parts = [f"{name_text(pair['pair_id'])}: {name_text(pair['risk_class'])}"]
    # What is unknown is left out
    parts.append(f"impact {speed_text(number(pair, 'expected_impact_velocity'))}")
    if math.isfinite(chance := number(pair, "probability")):
        parts.append(f"contact in {chance_text(chance)}")
    parts += _at(pair)
    return f"{', '.join(parts)}."


def _at(row: Mapping[str, Any]) -> list[str]:
    """Return the place of a pair or building, as a list that is empty where it is unknown."""
    north, east = number(row, "latitude"), number(row, "longitude")
    is_known = math.isfinite(north) and math.isfinite(east)
    return [f"at {place_text(north, east, 5)}"] if is_known else []


def place_text(north: float, east: float, decimals: int) -> str:
    """
    Return a place (degrees) without signs, which are lost on the radio.

    Examples
    --------
    >>> place_text(-0.07316, 0.3, 5)
    '0.07316 south, 0.30000 east'
    """
    east = (east + 180.0) % 360.0 - 180.0
    sides = "north" if north >= 0 else "south", "east" if east >= 0 else "west"
    return f"{abs(north):.{decimals}f} {sides[0]}, {abs(east):.{decimals}f} {sides[1]}"


def building_sentence(building: Mapping[str, Any]) -> str:
    """Return a building of the list in one sentence."""
    parts = [f"{name_text(building['building_id'])}: {name_text(building['risk_class'])}"]
    parts.append(f"severity {speed_text(number(building, 'severity'))}")
    parts += _at(building)
    return f"{', '.join(parts)}."
