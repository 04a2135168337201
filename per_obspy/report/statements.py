"""Sentences and numbers of a screening, the same on page, summary and console."""

import math
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any, NamedTuple

import pandas as pd

from per_obspy.errors import shortened
from per_obspy.report.results import Results, Revision
from per_obspy.report.style import class_colours
from per_obspy.report.tally import HARD
from per_obspy.report.texts import LANGUAGES, counted, fixed_phrases, texts_of, written
from per_obspy.report.words import chance_text, name_text, number, speed_text

#: Pairs and buildings that a summary lists.
LISTED = 10

#: Names in a sentence, and the longest of them, characters.
NAMED, LONGEST_NAME = 5, 40

#: Stations in a sentence, and the longest reason of one that is not used, characters.
NAMED_STATIONS, LONGEST_REASON = 12, 90

#: Colour of an alert without a level.
NO_LEVEL = "#5C5C5C"

#: Flags that are counted, with the keys of their sentences.
DOUBTS = {
    "beyond_elastic": "sure_beyond_elastic",
    "derived_inputs": "sure_derived",
    "outside_usable_periods": "sure_periods",
    "far_station": "sure_far",
    "record_from_other_site_class": "sure_station_class",
    "record_warning": "sure_record",
    "shakemap_demand": "sure_map",
}


class Alert(NamedTuple):
    """
    What has happened, or would happen, in one sentence.

    Attributes
    ----------
    level, colour : str
        Worst class of impact that at least one pair is expected to reach, in words, and its colour.
    sentence : str
        How many pairs hit each other, how many of them hard, and how many of these at columns.
    status : str
        When and how the results were made, and that nobody has reviewed them.
    levels : str
        What the levels mean.
    """

    level: str
    colour: str
    sentence: str
    status: str
    levels: str


def alert(results: Results) -> Alert:
    """Return the alert of a screening."""
    texts, tally = texts_of(results.language, results.stem), results.tally
    colours, classes = class_colours(results.region.classes), results.region.classes
    # One pair is expected where the probabilities of a class add up to a half or more
    worst = next((name for name in classes if tally.expected_by_class[name] >= 0.5), None)
    known = tally.pairs > tally.states["unknown"]
    key = "alert_level" if known else "alert_level_unknown"
    if results.coverage.lacks_many and known:
        key = "alert_level_least"
    name = class_text(worst, texts) if worst else texts["alert_none"]
    status = [texts["alert_status" if not tally.yielding else "alert_status_yielding"]]
    if results.revision.time:
        status.insert(0, texts["alert_issued"].format(time=shortened(results.revision.time, 20)))
    limits = results.class_limits.items()
    bounds = [
        f"{class_text(name, texts)} ≥ {speed_text(limit, results.language)}"
        for name, limit in limits
        if limit > 0.0
    ]
    return Alert(
        texts[key].format(name=name),
        colours[worst] if worst else NO_LEVEL,
        _alert_sentence(results) if known else texts["alert_unknown"],
        " ".join(status),
        texts["alert_levels"].format(limits=", ".join(bounds)) if bounds else "",
    )


def alert_line(results: Results) -> str:
    """Return level and sentence of the alert of a screening on one line."""
    level, _, sentence, *_ = alert(results)
    return f"{level}. {sentence}"


def _alert_sentence(results: Results) -> str:
    """Return how many pairs hit each other, and how many of them how hard."""
    tally, stem, language = results.tally, results.stem, results.language
    known = tally.pairs - tally.states["unknown"]
    expected = _rounded(tally.expected)
    share = 100.0 * tally.expected / known
    # 100 only if it is all, 0 only if it is none
    percent = written(share if share in (0.0, 100.0) else min(share, 99.0), 0, language)
    if 0.0 < share < 1.0:
        percent = LANGUAGES[language]["alert_under"]
    whole = {"all": written(known, 0, language), "share": percent}
    if expected < 1:
        return f"{counted(language, 'alert_none_hit', known, stem, **whole)}."
    clauses = [counted(language, "alert_hit", expected, stem, **whole)]
    # Fewer and fewer of them, until there is none
    for key, count in (("alert_hard", tally.hard), ("alert_columns", tally.columns)):
        if _rounded(count) < 1:
            break
        clauses.append(counted(language, key, _rounded(count), stem))
    return f"{'; '.join(clauses)}."


def _rounded(count: float) -> float:
    """Return a whole number, beyond 1 000 with three digits: more are never known."""
    return float(f"{count:.3g}") if count >= 1000.0 else float(round(count))


def class_text(name: str, texts: Mapping[str, str]) -> str:
    """Return a class in words; classes of a configuration have their own names."""
    return texts.get(f"class_{name}", shortened(name, LONGEST_NAME))


def key_numbers(results: Results) -> list[tuple[str, str]]:
    """Return four numbers of a screening, each with its meaning."""
    tally, stem, language = results.tally, results.stem, results.language
    texts, worst = texts_of(language, stem), results.worst if len(results.worst) else results.listed
    # From the pairs that surely hit to those that possibly do
    sure = min(tally.states["yes"], math.floor(tally.expected))
    possible = sum(tally.states[state] for state in ("yes", "likely", "possible"))
    ends = written(sure, 0, language), written(max(possible, tally.expected), 0, language)
    expected, limit = written(_rounded(tally.expected), 0, language), speed_text(HARD, language)
    numbers = [
        (f"{expected} ({ends[0]}–{ends[1]})", texts["number_hit"]),
        (written(_rounded(tally.hard), 0, language), texts["number_hard"].format(limit=limit)),
    ]
    if results.buildings_hit is not None:
        hit = results.buildings_hit
        numbers.append(
            (written(hit, 0, language), counted(language, "number_buildings", hit, stem))
        )
    else:
        unknown = tally.states["unknown"]
        numbers.append((written(unknown, 0, language), texts["number_unknown"]))
    fastest = float(worst["expected_impact_velocity"].max()) if len(worst) else math.nan
    return [*numbers, (speed_text(fastest, language), texts["number_velocity"])]


def first_steps(results: Results) -> list[str]:
    """Return sentences on what to do first."""
    language, stem, tally = results.language, results.stem, results.tally
    texts = texts_of(language, stem)
    worst = results.worst if len(results.worst) else results.listed
    steps = [texts["todo_exercise"]] if results.region.simulated else []
    hit = worst[worst["state"].isin(("yes", "likely"))] if "state" in worst else worst
    steps += _inspections(hit, results, texts) if len(hit) else [texts["todo_none"]]
    # Gaps to be measured, and pairs that come later
    for state in ("unknown", "possible"):
        if tally.states[state]:
            steps.append(counted(language, f"todo_{state}", tally.states[state], stem))
    return steps


def _inspections(hit: pd.DataFrame, results: Results, texts: Mapping[str, str]) -> list[str]:
    """Return sentences on the first buildings or pairs, areas, and the joints of a plan."""
    areas, buildings, hard = results.areas, results.buildings, _rounded(results.tally.hard)
    if len(buildings):
        steps = [texts["todo_buildings"].format(names=_names(buildings["building_id"]))]
    else:
        steps = [texts["todo_worst"].format(names=_names(hit["pair_id"]))]
    if hard >= 1 and results.stem != "risk":
        steps.append(counted(results.language, "todo_retrofit", hard))
    # One area is no choice
    if len(areas) > 1 and "expected_pounding" in areas:
        most = areas.sort_values("expected_pounding", ascending=False)[:3]
        places = [_placed_name(area, results.language) for _, area in most.iterrows()]
        steps.append(texts["todo_areas"].format(names=", ".join(places)))
    return steps


def _placed_name(area: "pd.Series[Any]", language: str) -> str:
    """Return the name of an area with the coordinates of its centre."""
    place = (written(area[name], 3, language) for name in ("latitude", "longitude"))
    return f"{_names([area['area']])} ({' / '.join(place)})"


def _names(names: Sequence[object] | pd.Series) -> str:
    """Return the first names in one text, long ones cut."""
    return ", ".join(shortened(str(name), LONGEST_NAME) for name in list(names)[:NAMED])


def sureness(results: Results) -> list[str]:
    """Return sentences on uncertainty."""
    tally, language, stem = results.tally, results.language, results.stem
    texts = texts_of(language, stem)
    if not tally.pairs:
        return []
    counts = {name: written(tally.states[name], 0, language) for name in ("yes", "likely")}
    counts["possible"] = written(tally.states["possible"], 0, language)
    said, whole = [texts["sure_states"].format(**counts)], written(tally.pairs, 0, language)
    for flag, key in DOUBTS.items():
        if tally.flags[flag]:
            said.append(counted(language, key, tally.flags[flag], all=whole))
    # The nearer the records, the surer the motion
    distance = tally.median_distance()
    if math.isfinite(distance):
        said.append(texts["sure_distance"].format(value=written(distance / 1000.0, 1, language)))
    if not tally.yielding:
        said.append(texts["sure_elastic"])
    return [
        *said,
        texts["sure_hard"].format(limit=speed_text(HARD, language)),
        texts["sure_nature"],
    ]


def event_sentences(facts: Mapping[str, Any], language: str = "en") -> list[str]:
    """
    Return sentences on an earthquake: time, size and place, as far as they are known.

    Parameters
    ----------
    facts : mapping of str to object
        ``time`` (text), ``magnitude``, ``longitude``, ``latitude`` (degrees), ``depth`` (m), and
        ``start``, the first record; ``map`` and ``version`` of a ShakeMap.
    language : str
        Of the sentences.
    """
    texts, sentences = LANGUAGES[language], list[str]()
    # Origin time, else the first record
    for name, key, length in (("time", "event_time", 19), ("start", "first_record", 16)):
        if facts.get(name):
            day = str(facts[name])[:length].replace("T", " ")
            sentences.append(texts[key].format(time=day))
            break
    if math.isfinite(size := number(facts, "magnitude")):
        sentences.append(texts["magnitude"].format(value=f"{size:.1f}"))
    # An epicentre has both coordinates; its depth may be unknown
    east, north = number(facts, "longitude"), number(facts, "latitude")
    if math.isfinite(east) and math.isfinite(north):
        place, depth = place_text(north, east, 3, language), number(facts, "depth") / 1000.0
        key = "epicentre_depth" if math.isfinite(depth) else "epicentre_at"
        sentences.append(texts[key].format(place=place, depth=f"{depth:.0f}"))
    if facts.get("map"):
        issue = name_text(facts.get("version") or "?")
        sentences.append(texts["shakemap"].format(name=name_text(facts["map"]), version=issue))
    return sentences


def revision_line(revision: Revision, language: str) -> str:
    """
    Return number and time of a revision, empty if there is none.

    Examples
    --------
    >>> revision_line(Revision(3, "2026-01-02 04:12", "us7000abcd"), "en")
    'us7000abcd: Revision 3, 2026-01-02 04:12 UTC'
    """
    if not revision.number:
        return ""
    text = LANGUAGES[language]["revision_time" if revision.time else "revision"]
    value = written(revision.number, 0, language)
    line = text.format(value=value, time=shortened(revision.time, 20))
    name = shortened(revision.event_id, LONGEST_NAME)
    return f"{name}: {line}" if name else line


def station_sentences(stations: pd.DataFrame, language: str) -> list[str]:
    """Return a sentence on the expected stations, with the names of used and missing ones."""
    if stations.empty or not {"station", "state"} <= set(stations):
        return [LANGUAGES[language]["no_station"]]
    # Whatever is not used serves no pair
    is_used = (stations["state"] == "used").to_numpy()
    parts = [counted(language, "stations_expected", len(stations))]
    for key, chosen in (("used", stations[is_used]), ("missing", stations[~is_used])):
        if len(chosen):
            names = _station_names(chosen, language)
            parts.append(f"{counted(language, f'stations_{key}', len(chosen))}: {names}")
    return [f"{'; '.join(parts)}."]


def _station_names(stations: pd.DataFrame, language: str) -> str:
    """Return the names of the first stations, with the reasons of rejected ones."""
    names = list[str]()
    for _, station in stations.head(NAMED_STATIONS).iterrows():
        name, reason = shortened(str(station["station"]), LONGEST_NAME), station.get("rejected")
        if station["state"] != "used" and isinstance(reason, str) and reason:
            name += f" ({shortened(fixed_phrases(reason, language), LONGEST_REASON)})"
        names.append(name)
    # Names of all of them are in the table of stations
    others = len(stations) - len(names)
    return ", ".join(names) + (f" {counted(language, 'and_more', others)}" if others else "")


def made_sentence(results: Results) -> str:
    """Return a sentence on the program and the table of all pairs."""
    text = LANGUAGES[results.language]["made"]
    return text.format(version=version("per_obspy"), table=results.stem)


def pair_sentence(pair: Mapping[str, Any], language: str) -> str:
    """Describe a listed pair in one sentence."""
    texts, parts = LANGUAGES[language], [_headline(pair, "pair_id", language)]
    # Values that are unknown are left out
    speed = speed_text(number(pair, "expected_impact_velocity"), language)
    parts.append(texts["impact"].format(speed=speed))
    if math.isfinite(chance := number(pair, "probability")):
        parts.append(texts["contact"].format(chance=chance_text(chance, language)))
    return f"{', '.join(parts + _at(pair, language))}."


def building_sentence(building: Mapping[str, Any], language: str) -> str:
    """Describe a listed building in one sentence."""
    speed = speed_text(number(building, "severity"), language)
    severity = LANGUAGES[language]["severity"].format(speed=speed)
    parts = [_headline(building, "building_id", language), severity, *_at(building, language)]
    return f"{', '.join(parts)}."


def _headline(row: Mapping[str, Any], name: str, language: str) -> str:
    """Return name and class of a pair or building."""
    return f"{name_text(row[name])}: {class_text(str(row['risk_class']), LANGUAGES[language])}"


def _at(row: Mapping[str, Any], language: str) -> list[str]:
    """Return the place of a pair or building, as a list that is empty where it is unknown."""
    north, east = number(row, "latitude"), number(row, "longitude")
    if not (math.isfinite(north) and math.isfinite(east)):
        return []
    return [LANGUAGES[language]["at"].format(place=place_text(north, east, 5, language))]


def place_text(north: float, east: float, decimals: int, language: str = "en") -> str:
    """
    Return a place (degrees) with compass directions instead of signs, for the radio.

    Examples
    --------
    >>> place_text(-0.07316, 0.3, 5)
    '0.07316 south, 0.30000 east'
    """
    texts = LANGUAGES[language]
    # Longitudes may go beyond 180 degrees
    east = (east + 180.0) % 360.0 - 180.0
    sides = "north" if north >= 0 else "south", "east" if east >= 0 else "west"
    return (
        f"{abs(north):.{decimals}f} {texts[sides[0]]}, {abs(east):.{decimals}f} {texts[sides[1]]}"
    )
