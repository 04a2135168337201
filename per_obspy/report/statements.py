"""Sentences and numbers of a screening, the same on page, summary and console."""

import math
import re
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any, NamedTuple

import pandas as pd

from per_obspy.errors import shortened
from per_obspy.report.results import Results, Revision
from per_obspy.report.style import class_colours
from per_obspy.report.tally import HARD
from per_obspy.report.texts import LANGUAGES, counted, fixed_phrases, written
from per_obspy.report.words import chance_text, length_text, name_text, number, speed_text

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
    "assumed_strength": "sure_assumed_strength",
    "beyond_elastic": "sure_beyond_elastic",
    "unknown_strength": "sure_unknown_strength",
    "derived_inputs": "sure_derived",
    "outside_usable_periods": "sure_periods",
    "far_station": "sure_far",
    "record_from_other_site_class": "sure_station_class",
    "record_warning": "sure_record",
    "amplitudes_only": "sure_amplitudes",
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
    texts, tally, level = results.texts, results.tally, _level(results)
    is_known = tally.pairs > tally.states["unknown"]
    # Pairs without a verdict may be worse; what is at least none is unknown
    key = "alert_level"
    if results.coverage.lacks_many:
        key = "alert_level_least" if level else "alert_level_unknown"
    # When and how the results were made, and that nobody has reviewed them
    time, issued = shortened(results.revision.time, 20), texts["alert_issued"]
    status = texts["alert_status_yielding" if tally.yielding else "alert_status"]
    return Alert(
        texts[key if is_known else "alert_level_unknown"].format(
            name=class_text(level, texts) if level else texts["alert_none"]
        ),
        class_colours(results.region.classes)[level] if level else NO_LEVEL,
        _alert_sentence(results) if is_known else texts["alert_unknown"],
        f"{issued.format(time=time)} {status}" if time else status,
        texts["alert_levels"].format(limits=_limits(results)) if results.class_limits else "",
    )


def _limits(results: Results) -> str:
    """Return the smallest impact velocity of each class but the mildest."""
    return ", ".join(
        f"{class_text(name, results.texts)} ≥ {speed_text(limit, results.language)}"
        for name, limit in results.class_limits.items()
        if limit > 0.0
    )


def _level(results: Results) -> str:
    """Return the worst class that a pair is expected to reach, empty if none is."""
    expected = 0.0
    for name in results.region.classes:
        expected += results.tally.expected_by_class[name]
        # Rounded it is one pair of this class or a worse one
        if expected >= 0.5:
            return name
    return ""


def alert_line(results: Results) -> str:
    """Return level and sentence of the alert of a screening on one line."""
    level, _, sentence, *_ = alert(results)
    return f"{level}. {sentence}"


def _alert_sentence(results: Results) -> str:
    """Return how many pairs hit each other, and how many of them how hard."""
    tally = results.tally
    known = tally.pairs - tally.states["unknown"]
    # Of the number that is written; 100 only if it is all, 0 only if it is none
    share = 100.0 * (_rounded(tally.expected) or tally.expected) / known
    share = min(share, 100.0) if tally.expected == known else min(share, 99.0)
    percent = results.written(share)
    if 0.0 < share < 1.0:
        percent = results.texts["alert_under"]
    key = "alert_pairs" if results.coverage.pairs == known else "alert_screened"
    whole = {"all": results.counted(key, known), "share": percent}
    if round(tally.expected) < 1:
        return f"{results.counted('alert_none_hit', known, **whole)}."
    clauses = [results.counted("alert_hit", _rounded(tally.expected), **whole)]
    # Fewer and fewer of them, until there is none
    for key, count in (("alert_hard", tally.hard), ("alert_columns", tally.columns)):
        if round(count) < 1:
            break
        clauses.append(results.counted(key, _rounded(count)))
    return f"{'; '.join(clauses)}."


def _rounded(count: float) -> float:
    """Return a whole number, beyond 1 000 with three digits: more are never known."""
    return float(f"{count:.3g}") if count >= 1000.0 else float(round(count))


def class_text(name: str, texts: Mapping[str, str]) -> str:
    """Return a class in words; classes of a configuration have their own names."""
    return texts.get(f"class_{name}", shortened(name, LONGEST_NAME))


def key_numbers(results: Results) -> list[tuple[str, str]]:
    """Return four numbers of a screening, each with its meaning."""
    tally, texts = results.tally, results.texts
    # From the pairs that surely hit to those that possibly do
    sure, likely, possible = (tally.states[state] for state in ("yes", "likely", "possible"))
    least = results.written(min(sure, math.floor(tally.expected)))
    most = results.written(max(sure + likely + possible, tally.expected))
    hit = f"{results.written(_rounded(tally.expected))} ({least}–{most})"
    hard = texts["number_hard"].format(limit=speed_text(HARD, results.language))
    # Buildings are known where rows of buildings were screened
    count, key = results.buildings_hit, "number_buildings"
    if count is None:
        count, key = tally.states["unknown"], "number_unknown"
    return [
        (hit, texts["number_hit"]),
        (results.written(_rounded(tally.hard)), hard),
        (results.written(count), results.counted(key, count)),
        (speed_text(_fastest(results), results.language), texts["number_velocity"]),
    ]


def _fastest(results: Results) -> float:
    """Return the largest expected impact velocity, m/s: that of one of the worst pairs."""
    worst = _worst(results)
    return float(worst["expected_impact_velocity"].max()) if len(worst) else math.nan


def _worst(results: Results) -> pd.DataFrame:
    """Return the worst pairs, of the page or else of the summary."""
    return results.worst if len(results.worst) else results.listed


def first_steps(results: Results) -> list[str]:
    """Return sentences on what to do first."""
    texts, worst = results.texts, _worst(results)
    steps = [texts["todo_exercise"]] if results.region.simulated else []
    hit = worst[worst["state"].isin(("yes", "likely"))] if "state" in worst else worst
    steps += _inspections(hit, results) if len(hit) else [texts["todo_none"]]
    # Gaps to be measured, and pairs that come later
    for state in ("unknown", "possible"):
        if count := results.tally.states[state]:
            steps.append(results.counted(f"todo_{state}", count))
    return steps


def _inspections(hit: pd.DataFrame, results: Results) -> list[str]:
    """Return sentences on the first buildings or pairs, areas, and the joints of a plan."""
    areas, buildings, texts = results.areas, results.buildings, results.texts
    if len(buildings):
        steps = [texts["todo_buildings"].format(names=_names(buildings["building_id"]))]
    else:
        steps = [texts["todo_worst"].format(names=_names(hit["pair_id"]))]
    # A plan mends joints, an earthquake is over
    if round(results.tally.hard) >= 1 and results.stem != "risk":
        steps.append(results.counted("todo_retrofit", _rounded(results.tally.hard)))
    if "missing_gap_for_target" in hit:
        steps += _narrow_joints(hit, results)
    # One area is no choice
    if len(areas) > 1 and "expected_pounding" in areas:
        most = areas.sort_values("expected_pounding", ascending=False)[:3]
        places = [_placed_name(area) for _, area in most.iterrows()]
        steps.append(texts["todo_areas"].format(names="; ".join(places)))
    return steps


def _narrow_joints(hit: pd.DataFrame, results: Results) -> list[str]:
    """Return a sentence on the joints too narrow for the target that contact visits most often."""
    narrow = hit[hit["missing_gap_for_target"] > 0.0].nlargest(NAMED, "annual_probability")
    gaps = (length_text(gap, results.language) for gap in narrow["gap_for_target"])
    # Each with the gap that would do
    named = [f"{name} ({gap})" for name, gap in zip(narrow["pair_id"], gaps, strict=True)]
    return [results.texts["todo_target"].format(names=_names(named))] if named else []


def _placed_name(area: "pd.Series[Any]") -> str:
    """Return the name of an area with the coordinates of its centre, unless they are the name."""
    if re.fullmatch(r"[\d.]+ [NS], [\d.]+ [EW]", str(area["area"])):
        return str(area["area"])
    # As the search of the page and maps take it, with a decimal point
    return f"{_names([area['area']])} ({area['latitude']:.3f}, {area['longitude']:.3f})"


def _names(names: Sequence[object] | pd.Series) -> str:
    """Return the first names in one text, long ones cut."""
    return ", ".join(shortened(str(name), LONGEST_NAME) for name in list(names)[:NAMED])


def sureness(results: Results) -> list[str]:
    """Return sentences on uncertainty."""
    tally, texts = results.tally, results.texts
    if not tally.pairs:
        return []
    # Pairs by state, then those in doubt
    states = ("yes", "likely", "possible")
    counts = {name: results.written(tally.states[name]) for name in states}
    said, whole = [texts["sure_states"].format(**counts)], results.written(tally.pairs)
    for flag, key in DOUBTS.items():
        count = tally.flags[flag]
        # Where nothing yields no pair ranks high because it cannot
        if count and (tally.yielding or flag != "unknown_strength"):
            said.append(results.counted(key, count, all=whole))
    # The nearer the records, the surer the motion
    distance = tally.median_distance() / 1000.0
    if math.isfinite(distance):
        said.append(texts["sure_distance"].format(value=results.written(distance, 1)))
    if not tally.yielding:
        said.append(texts["sure_elastic"])
    limit = speed_text(HARD, results.language)
    return [*said, texts["sure_hard"].format(limit=limit), texts["sure_nature"]]


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
    # Size, place and map
    if math.isfinite(size := number(facts, "magnitude")):
        sentences.append(texts["magnitude"].format(value=written(size, 1, language)))
    sentences += _epicentre(facts, language)
    if facts.get("map"):
        issue = name_text(facts.get("version") or "?")
        sentences.append(texts["shakemap"].format(name=name_text(facts["map"]), version=issue))
    return sentences


def _epicentre(facts: Mapping[str, Any], language: str) -> list[str]:
    """Return a sentence on the epicentre, which needs both coordinates."""
    east, north = number(facts, "longitude"), number(facts, "latitude")
    if not (math.isfinite(east) and math.isfinite(north)):
        return []
    # The depth may be unknown
    place, depth = place_text(north, east, 3, language), number(facts, "depth") / 1000.0
    key = "epicentre_depth" if math.isfinite(depth) else "epicentre_at"
    return [LANGUAGES[language][key].format(place=place, depth=written(depth, 0, language))]


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
    at = (written(abs(degrees), decimals, language) for degrees in (north, east))
    return ", ".join(f"{number} {texts[side]}" for number, side in zip(at, sides, strict=True))
