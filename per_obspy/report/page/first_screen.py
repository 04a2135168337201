"""Sentences and numbers of the first screen: event, five numbers, actions, uncertainty."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import pandas as pd

from per_obspy.errors import shortened
from per_obspy.report.page.texts import LANGUAGES, Language, counted, fixed_phrases, written
from per_obspy.report.results import Event, Results
from per_obspy.report.tally import PairTally

#: Names in a sentence.
NAMED = 5

#: Longest name in a sentence, characters.
LONGEST_NAME = 40

#: Stations in a sentence, and the longest reason of one that is not used, characters.
NAMED_STATIONS, LONGEST_REASON = 12, 90

#: Longest text on a scenario or spectrum in place of an earthquake, characters.
LONGEST_SOURCE = 500

#: Flags that are counted on the first screen, with the keys of their sentences.
DOUBTS = {
    "derived_inputs": "sure_derived",
    "outside_usable_periods": "sure_periods",
    "far_station": "sure_far",
    "record_from_other_site_class": "sure_station_class",
    "record_warning": "sure_record",
    "shakemap_demand": "sure_map",
}


class FirstScreen(NamedTuple):
    """
    Texts of the first screen in one language.

    Attributes
    ----------
    event, revision : str
        One line each; the revision is empty if there is none.
    expected : str
        Which stations are expected, used, and missing or rejected, with their names.
    numbers : list of (str, str)
        Value and meaning.
    first, sure : list of str
        Sentences on first actions, and on uncertainty.
    """

    event: str
    revision: str
    expected: str
    numbers: list[tuple[str, str]]
    first: list[str]
    sure: list[str]


def first_screen(results: Results) -> FirstScreen:
    """Write the first screen of the page of some results."""
    language, event = results.language, results.event
    return FirstScreen(
        _event_line(event, language),
        revision_line(event.revision, event.revised, event.event_id, language),
        _expected(results.stations, language),
        _numbers(results),
        _first(results),
        _sure(results.tally, results.areas, language) if results.tally.pairs else [],
    )


def _event_line(event: Event, language: Language) -> str:
    """Return time, place and stations in one line."""
    if event.source:
        return shortened(event.source, LONGEST_SOURCE)
    # Facts that are unknown are left out
    texts, parts = LANGUAGES[language], list[str]()
    if math.isfinite(event.magnitude):
        parts.append(texts["event_magnitude"].format(value=written(event.magnitude, 1, language)))
    if event.time:
        parts.append(f"{event.time} UTC")
    elif event.start:
        parts.append(texts["event_time"].format(time=event.start))
    parts += _place_texts(event, language)
    return f"{', '.join(parts)}." if parts else ""


def revision_line(revision: int, revised: str, event_id: str, language: Language) -> str:
    """
    Return number and time of a revision, empty if there is none.

    Parameters
    ----------
    revision : int
        Its number; 0 if there is none.
    revised : str
        Its time, UTC, as text; empty if unknown.
    event_id : str
        Identifier of its earthquake; empty if unknown.
    language : {'en', 'es'}
        Of the line.

    Examples
    --------
    >>> revision_line(3, "04:12", "us7000abcd", "en"), revision_line(0, "", "", "en")
    ('us7000abcd: Revision 3, 04:12 UTC', '')
    """
    if not revision:
        return ""
    key = "revision_time" if revised else "revision"
    value = written(revision, 0, language)
    line = LANGUAGES[language][key].format(value=value, time=shortened(revised, 20))
    return f"{shortened(event_id, LONGEST_NAME)}: {line}" if event_id else line


def _expected(stations: pd.DataFrame, language: Language) -> str:
    """Return the number of expected stations, and the names of used and missing ones."""
    if stations.empty or not {"station", "state"} <= set(stations):
        return ""
    # Whatever is not used serves no pair
    is_used = (stations["state"] == "used").to_numpy()
    used, missing = stations[is_used], stations[~is_used]
    parts = [counted(language, "stations_expected", len(stations))]
    for key, chosen in (("stations_used", used), ("stations_missing", missing)):
        if len(chosen):
            names = _station_names(chosen, language, with_reasons=key == "stations_missing")
            parts.append(f"{counted(language, key, len(chosen))}: {names}")
    return "; ".join(parts) + "."


def _station_names(stations: pd.DataFrame, language: Language, *, with_reasons: bool) -> str:
    """Return the names of the first stations, with reasons where they are known."""
    shown = list[str]()
    for _, station in stations.head(NAMED_STATIONS).iterrows():
        name, reason = shortened(str(station["station"]), LONGEST_NAME), station.get("rejected")
        if with_reasons and isinstance(reason, str) and reason:
            name += f" ({shortened(fixed_phrases(reason, language), LONGEST_REASON)})"
        shown.append(name)
    # Names of all of them are in the table of stations
    others = len(stations) - len(shown)
    more = counted(language, "and_more", others)
    return ", ".join(shown) + (f" {more}" if others else "")


def _place_texts(event: Event, language: Language) -> list[str]:
    """Return epicentre and depth, as far as they are known."""
    if event.place is None:
        return []
    # Latitude first, as in speech
    texts, (longitude, latitude, depth) = LANGUAGES[language], event.place
    place = {"latitude": latitude, "longitude": longitude}
    numbers = {name: written(degrees, 2, language) for name, degrees in place.items()}
    epicentre = texts["event_place"].format(**numbers)
    if not math.isfinite(depth):
        return [epicentre]
    return [epicentre, texts["event_depth"].format(value=written(depth / 1000.0, 0, language))]


def _numbers(results: Results) -> list[tuple[str, str]]:
    """Return numbers after that of the pairs: pounding, expected or buildings, class, velocity."""
    # Numbers that a decision needs, the last one in a unit
    language, tally, worst = results.language, results.tally, results.worst
    texts = LANGUAGES[language]
    sure = tally.states["yes"] + tally.states["likely"]
    numbers = [(float(sure), "number_pounding")]
    if results.buildings_hit is not None:
        numbers.append((float(results.buildings_hit), "number_buildings"))
    else:
        numbers.append((tally.expected, "number_expected"))
    counts = [
        (written(value, 0, language), _meaning(key, value, language)) for value, key in numbers
    ]
    # The class of the worst pair is the worst that occurs
    if "risk_class" in worst and len(worst):
        name = str(worst["risk_class"].iloc[0])
        label = texts.get(f"class_{name}", shortened(name, LONGEST_NAME))
        meaning = texts["number_severe"].format(name=label)
        counts.append((written(tally.classes[name], 0, language), meaning))
    return [*counts, *_fastest(worst, language)]


def _meaning(key: str, value: float, language: Language) -> str:
    """Return the meaning of a number, in the singular if the number is 1."""
    texts = LANGUAGES[language]
    return texts[f"{key}_one"] if written(value, 0, language) == "1" else texts[key]


def _fastest(worst: pd.DataFrame, language: Language) -> list[tuple[str, str]]:
    """Return the fastest expected impact as text, empty if there is none."""
    fastest = float(worst["expected_impact_velocity"].max()) if len(worst) else math.nan
    if not math.isfinite(fastest):
        return []
    value = f"{written(100.0 * fastest, 0, language)} cm/s"
    return [(value, LANGUAGES[language]["number_velocity"])]


def _first(results: Results) -> list[str]:
    """Return sentences on first actions."""
    language, worst, tally = results.language, results.worst, results.tally
    texts = LANGUAGES[language]
    said = [texts["todo_exercise"]] if results.region.simulated else []
    hit = worst[worst["state"].isin(("yes", "likely"))] if "state" in worst else worst
    said += _inspected(hit, results) if len(hit) else [texts["todo_none"]]
    # Gaps to be measured, and pairs that come later
    for state in ("unknown", "possible"):
        if tally.states[state]:
            said.append(counted(language, f"todo_{state}", tally.states[state]))
    return said


def _inspected(hit: pd.DataFrame, results: Results) -> list[str]:
    """Return sentences on the first inspections: buildings or pairs, and areas."""
    language, areas, buildings = results.language, results.areas, results.buildings
    texts, said = LANGUAGES[language], list[str]()
    if len(buildings):
        said.append(texts["todo_buildings"].format(names=_names(buildings["building_id"])))
    else:
        said.append(texts["todo_worst"].format(names=_names(hit["pair_id"])))
    # One area is no choice
    if len(areas) > 1 and "expected_pounding" in areas:
        most = areas.sort_values("expected_pounding", ascending=False)[:3]
        said.append(texts["todo_areas"].format(names=_placed_names(most, language)))
    return said


def _sure(tally: PairTally, areas: pd.DataFrame, language: Language) -> list[str]:
    """Return sentences on uncertainty."""
    texts, said = LANGUAGES[language], _spread(tally, areas, language)
    whole = written(tally.pairs, 0, language)
    for flag, key in DOUBTS.items():
        if tally.flags[flag]:
            said.append(counted(language, key, tally.flags[flag], all=whole))
    # The nearer the records, the surer the motion
    distance = tally.median_distance()
    if math.isfinite(distance):
        value = written(distance / 1000.0, 1, language)
        said.append(texts["sure_distance"].format(value=value))
    return [*said, texts["sure_nature"]]


def _spread(tally: PairTally, areas: pd.DataFrame, language: Language) -> list[str]:
    """Return the expected number of pounding pairs with the limits of its deviation."""
    names = ("expected_pounding_std_independent", "expected_pounding_std_common")
    if areas.empty or not set(names) <= set(areas):
        return []
    # Areas are independent of each other, or else of one cause
    low = float((areas[names[0]].fillna(0.0) ** 2).sum() ** 0.5)
    high = float(areas[names[1]].fillna(0.0).sum())
    values = {"mean": tally.expected, "low": low, "high": high}
    texts = {name: written(value, 0, language) for name, value in values.items()}
    key = "sure_expected_one" if texts["mean"] == "1" else "sure_expected"
    return [LANGUAGES[language][key].format(**texts)]


def _placed_names(areas: pd.DataFrame, language: Language) -> str:
    """Return the names of areas with the coordinates of their centres."""
    named = []
    for _, area in areas.iterrows():
        place = (written(area[name], 3, language) for name in ("latitude", "longitude"))
        named.append(f"{_names([area['area']])} ({' / '.join(place)})")
    return ", ".join(named)


def _names(names: Sequence[object] | pd.Series) -> str:
    """Return the first names in one text, long ones cut."""
    return ", ".join(shortened(str(name), LONGEST_NAME) for name in list(names)[:NAMED])
