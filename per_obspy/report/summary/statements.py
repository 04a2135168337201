"""Sentences and numbers of the summary of a screening."""

import math
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

import pandas as pd

from per_obspy.report.coverage import coverage_number
from per_obspy.report.page.texts import Language
from per_obspy.report.results import Results
from per_obspy.report.summary.wording import WORDING, in_language
from per_obspy.report.words import chance_text, name_text, number, speed_text

#: Pairs and buildings that the summary lists.
LISTED = 10

#: Stations that are named; of more their number is given.
NAMED = 8


def event_sentences(facts: Mapping[str, Any], language: Language = "en") -> list[str]:
    """
    Return sentences on an earthquake: time, size and place, as far as they are known.

    Parameters
    ----------
    facts : mapping of str to object
        ``time`` (text), ``magnitude``, ``longitude``, ``latitude`` (degrees), ``depth`` (m), and
        ``start``, the first record; ``map`` and ``version`` of a ShakeMap.
    language : {'en', 'es'}
        Of the sentences.
    """
    texts, sentences = WORDING[language], list[str]()
    if facts.get("time"):
        day = str(facts["time"])[:19].replace("T", " ")
        sentences.append(texts["event_time"].format(time=day))
    elif facts.get("start"):
        day = str(facts["start"])[:16].replace("T", " ")
        sentences.append(texts["first_record"].format(time=day))
    # Size and place
    if math.isfinite(size := number(facts, "magnitude")):
        sentences.append(texts["magnitude"].format(value=f"{size:.1f}"))
    return [*sentences, *_epicentre(facts, language), *_map_name(facts, texts)]


def _epicentre(facts: Mapping[str, Any], language: Language) -> list[str]:
    """Return a sentence on the epicentre, which needs both coordinates."""
    east, north = number(facts, "longitude"), number(facts, "latitude")
    if not (math.isfinite(east) and math.isfinite(north)):
        return []
    # The depth may be unknown
    place, depth = place_text(north, east, 3, language), number(facts, "depth") / 1000.0
    key = "epicentre_depth" if math.isfinite(depth) else "epicentre"
    return [WORDING[language][key].format(place=place, depth=f"{depth:.0f}")]


def _map_name(facts: Mapping[str, Any], texts: Mapping[str, str]) -> list[str]:
    """Return a sentence on the ShakeMap, if there is one."""
    if not facts.get("map"):
        return []
    version = name_text(facts.get("version") or "?")
    return [texts["shakemap"].format(name=name_text(facts["map"]), version=version)]


def five_numbers(results: Results) -> list[tuple[str, str]]:
    """Return the five numbers of the summary, each with its meaning."""
    tally, first, language = results.tally, results.region.classes[0], results.language
    texts, worst = WORDING[language], results.listed.head(LISTED)
    # Of all pairs the worst ones are the fastest
    fastest = worst["expected_impact_velocity"].max() if len(worst) else math.nan
    return [
        coverage_number(results.coverage, language),
        (str(tally.states["yes"] + tally.states["likely"]), texts["number_pounding"]),
        (f"{tally.expected:.0f}", texts["number_expected"]),
        (str(tally.classes[first]), texts["number_class"].format(name=name_text(first))),
        (in_language(speed_text(float(fastest)), language), texts["number_velocity"]),
    ]


def station_sentences(table: pd.DataFrame, language: Language) -> list[str]:
    """Return sentences on the stations that were used and those that are missing."""
    texts = WORDING[language]
    if table.empty:
        return [texts["no_station"]]
    # Rejected stations are as good as missing
    used = table.loc[table["state"] == "used", "station"].tolist()
    missing = table.loc[table["state"] != "used", "station"].tolist()
    sentences = [texts["stations_used"].format(count=len(used), names=_named(used, texts))]
    if missing:
        names = _named(missing, texts)
        sentences.append(texts["stations_missing"].format(count=len(missing), names=names))
    else:
        sentences.append(texts["none_missing"])
    return sentences


def _named(names: Sequence[str], texts: Mapping[str, str]) -> str:
    """Return the first names of a list."""
    if not names:
        return ""
    more = texts["and_more"].format(count=len(names) - NAMED) if len(names) > NAMED else ""
    return ": " + ", ".join(map(name_text, names[:NAMED])) + more


def first_steps(results: Results) -> list[str]:
    """Return sentences on first actions."""
    texts, areas = WORDING[results.language], results.areas
    # The rest depends on the results
    steps = [texts["inspect"]]
    # The area with most pounding is worth a name where there are several
    if len(areas) > 1:
        most = areas.iloc[int(areas["expected_pounding"].argmax())]
        place = place_text(float(most["latitude"]), float(most["longitude"]), 4, results.language)
        area = texts["around"].format(name=name_text(most["area"]), place=place)
        steps.append(texts["area_first"].format(area=area))
    if unknown := results.tally.states["unknown"]:
        steps.append(texts["measure"].format(count=unknown))
    if results.region.simulated:
        steps.append(texts["exercise"])
    return steps


def sureness(results: Results) -> list[str]:
    """Return sentences on uncertainty."""
    tally, texts = results.tally, WORDING[results.language]
    # States between yes and no
    middle = sum(tally.states[state] for state in ("likely", "possible", "unlikely"))
    sentences = [texts["open"].format(count=middle)]
    if tally.derived:
        sentences.append(texts["derived"].format(count=tally.derived))
    if far := tally.flags["far_station"]:
        sentences.append(texts["far"].format(count=far))
    return [*sentences, texts["nature"]]


def made_sentence(results: Results) -> str:
    """Return a sentence on the program and the table of all pairs."""
    texts = WORDING[results.language]
    return texts["made"].format(version=version("per_obspy"), table=results.stem)


def pair_sentence(pair: Mapping[str, Any], language: Language) -> str:
    """Describe a listed pair in one sentence."""
    texts, parts = WORDING[language], [_headline(pair, "pair_id")]
    # Values that are unknown are left out
    speed = in_language(speed_text(number(pair, "expected_impact_velocity")), language)
    parts.append(texts["impact"].format(speed=speed))
    if math.isfinite(chance := number(pair, "probability")):
        shares = in_language(chance_text(chance), language)
        parts.append(texts["contact"].format(chance=shares))
    parts += _at(pair, language)
    return f"{', '.join(parts)}."


def _headline(row: Mapping[str, Any], name: str) -> str:
    """Return name and class of a pair or building."""
    return f"{name_text(row[name])}: {name_text(row['risk_class'])}"


def _at(row: Mapping[str, Any], language: Language) -> list[str]:
    """Return the place of a pair or building, as a list that is empty where it is unknown."""
    north, east = number(row, "latitude"), number(row, "longitude")
    is_known = math.isfinite(north) and math.isfinite(east)
    if not is_known:
        return []
    return [WORDING[language]["at"].format(place=place_text(north, east, 5, language))]


def place_text(north: float, east: float, decimals: int, language: Language = "en") -> str:
    """
    Return a place (degrees) with compass directions instead of signs, for the radio.

    Examples
    --------
    >>> place_text(-0.07316, 0.3, 5)
    '0.07316 south, 0.30000 east'
    """
    texts = WORDING[language]
    # Longitudes may go beyond 180 degrees
    east = (east + 180.0) % 360.0 - 180.0
    sides = "north" if north >= 0 else "south", "east" if east >= 0 else "west"
    return (
        f"{abs(north):.{decimals}f} {texts[sides[0]]}, {abs(east):.{decimals}f} {texts[sides[1]]}"
    )


def building_sentence(building: Mapping[str, Any], language: Language) -> str:
    """Describe a listed building in one sentence."""
    speed = in_language(speed_text(number(building, "severity")), language)
    severity = WORDING[language]["severity"].format(speed=speed)
    parts = [_headline(building, "building_id"), severity, *_at(building, language)]
    return f"{', '.join(parts)}."
