"""Facts of a screening for its summary, and sentences on them."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import pandas as pd

from per_obspy.report.coverage import coverage_number
from per_obspy.report.overview import Region
from per_obspy.report.page.texts import Language
from per_obspy.report.summary.wording import WORDING, in_language
from per_obspy.report.words import chance_text, name_text, number, speed_text
from per_obspy.tables.coverage import Coverage

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
    Facts for a summary.

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
    coverage : Coverage
        Rows of the pair tables, and those that are left out.
    language : Language
        Of its sentences.
    """

    region: Region
    source: list[str]
    counts: Counts
    worst: pd.DataFrame
    buildings: pd.DataFrame
    stations: pd.DataFrame
    area: str
    made: str
    coverage: Coverage
    language: Language = "en"

    @property
    def texts(self) -> Mapping[str, str]:
        """Return the sentences in the language of the summary by their keys."""
        return WORDING[self.language]


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


def five_numbers(facts: SummaryFacts) -> list[tuple[str, str]]:
    """Return the five numbers of the summary, each with its meaning."""
    counts, first, texts = facts.counts, facts.region.classes[0], facts.texts
    pounding = counts.states.get("yes", 0) + counts.states.get("likely", 0)
    # Of all pairs the worst ones are the fastest
    fastest = facts.worst["expected_impact_velocity"].max() if len(facts.worst) else math.nan
    return [
        coverage_number(facts.coverage, facts.language),
        (str(pounding), texts["number_pounding"]),
        (f"{counts.expected:.0f}", texts["number_expected"]),
        (str(counts.classes.get(first, 0)), texts["number_class"].format(name=name_text(first))),
        (in_language(speed_text(float(fastest)), facts.language), texts["number_velocity"]),
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


def first_steps(facts: SummaryFacts) -> list[str]:
    """Return sentences on first actions."""
    counts, texts = facts.counts, facts.texts
    # The rest depends on the results
    steps = [texts["inspect"]]
    if facts.area:
        steps.append(texts["area_first"].format(area=facts.area))
    if unknown := counts.states.get("unknown", 0):
        steps.append(texts["measure"].format(count=unknown))
    if facts.region.simulated:
        steps.append(texts["exercise"])
    return steps


def sureness(facts: SummaryFacts) -> list[str]:
    """Return sentences on uncertainty."""
    counts, sentences, texts = facts.counts, list[str](), facts.texts
    # States between yes and no
    middle = sum(counts.states.get(state, 0) for state in ("likely", "possible", "unlikely"))
    sentences.append(texts["open"].format(count=middle))
    if counts.derived:
        sentences.append(texts["derived"].format(count=counts.derived))
    if counts.far:
        sentences.append(texts["far"].format(count=counts.far))
    sentences.append(texts["nature"])
    return sentences


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
