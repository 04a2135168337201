"""Descriptions of one pair and of numbers in words, for console, summary and figures."""

import math
from collections.abc import Mapping
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from per_obspy.checks import FloatArray
from per_obspy.errors import shortened
from per_obspy.inventory.places import with_towns
from per_obspy.report.texts import LANGUAGES, marks
from per_obspy.screening.meanings import DEMAND_RULES, FLAGS
from per_obspy.screening.ranking import NO_VERDICT, UNKNOWN_CLASS, UNKNOWN_STATE

if TYPE_CHECKING:
    import pandas as pd

#: Longest name of a pair, station or class in a sentence, characters.
LONGEST_NAME = 60

#: States of a pair in a sentence.
STATE_WORDS = {
    "yes": "pounds",
    "likely": "likely pounds",
    "possible": "possibly pounds",
    "unlikely": "is unlikely to pound",
    "no": "does not pound",
    "unknown": "may pound: its gap is unknown",
}

#: Measures for a pair that needs no wider gap as far as is known, by :func:`prevention_kind`.
PREVENTION_WORDS = {
    "unknown_gap": "Prevention: the gap is unknown and must be measured first.",
    "not_computed": "Prevention: not computed {motion}.",
    "in_doubt": (
        "Prevention: the gap is enough for the likeliest inputs; the probability counts others."
    ),
    "nothing": "Prevention: none needed {motion}.",
}

#: Reason of class and rank where the exact history has no impact.
NO_IMPACT = (
    "The likeliest values of this pair give no impact in the record. Class and rank count every "
    "outcome of uncertain periods, dampings, gap and motion at the site: {hit} of them hit."
)

#: Why a pair of unknown gap has a rank.
RANKED_BY_NEED = "It is ranked by the gap that it needs, as if the buildings touched."


def name_text(name: object) -> str:
    """Return a name of data on one line, shortened."""
    return shortened(str(name), LONGEST_NAME)


def length_text(metres: float, language: str = "en") -> str:
    """
    Return a length with two or three digits, in mm, cm or m; in words if it is unknown.

    Examples
    --------
    >>> length_text(0.0), length_text(0.0042), length_text(0.123), length_text(2.5, "es")
    ('0 cm', '4.2 mm', '12.3 cm', '2,5 m')
    """
    if not math.isfinite(metres):
        return LANGUAGES[language]["unknown"]
    # Half a unit of the last digit counts as the next one
    text = f"{metres:.3g} m"
    if abs(metres) < 0.9995:
        centimetres = abs(metres) >= 0.00995 or metres == 0.0
        text = f"{100 * metres:.3g} cm" if centimetres else f"{1000 * metres:.2g} mm"
    return text.translate(marks(language))


def speed_text(metres_per_second: float, language: str = "en") -> str:
    """
    Return a velocity in m/s with two digits; in words if it is unknown.

    Examples
    --------
    >>> speed_text(0.2154), speed_text(0.0), speed_text(0.0004), speed_text(1.234, "es")
    ('0.22 m/s', '0 m/s', '0.0004 m/s', '1,2 m/s')
    """
    if not math.isfinite(metres_per_second):
        return LANGUAGES[language]["unknown"]
    text = f"{float(f'{metres_per_second:.2g}'):f}".rstrip("0").rstrip(".")
    return f"{text.translate(marks(language))} m/s"


def chance_text(probability: float, language: str = "en") -> str:
    """
    Return a probability as a number of cases in 100; 0 and 100 only if exact.

    Examples
    --------
    >>> chance_text(1.0), chance_text(0.999), chance_text(0.004), chance_text(0.0, "es")
    ('100 of 100', 'over 99 of 100', 'under 1 of 100', '0 de 100')
    """
    texts = LANGUAGES[language]
    if not math.isfinite(probability):
        return texts["unknown"]
    if 0.0 < probability < 0.005:
        return texts["chance_under"]
    if 0.995 <= probability < 1.0:
        return texts["chance_over"]
    return texts["chance"].format(value=f"{100 * probability:.0f}")


def pair_lines(pair: Mapping[str, Any]) -> list[str]:
    """
    Return the numbers of a pair in words, one sentence per line.

    Parameters
    ----------
    pair : mapping of str to object
        A row of the table of a run, of a design spectrum or of an ensemble; missing columns are
        left out.
    """
    judged = [*_verdict(pair), *_gap_lines(pair), *_impact_lines(pair)]
    described = [*_building_lines(pair), *_motion_lines(pair)]
    return [*judged, *described, *_prevention_lines(pair), *_flag_lines(pair)]


def prevention_kind(
    gap: ArrayLike, missing: ArrayLike, state: ArrayLike, risk_class: ArrayLike
) -> NDArray[np.str_]:
    """
    Return the case of the measures for pairs.

    ``unknown_gap`` and ``not_computed`` (the table has no demand) are no promise; ``gap``: a wider
    one is needed; ``in_doubt``: the gap is enough for the likeliest inputs, but the pair may pound
    at others; ``nothing``: it does not pound.

    Parameters
    ----------
    gap, missing : (n_pairs,) array_like
        Gap, and its :func:`missing_gap`, m; NaN where it is unknown.
    state, risk_class : (n_pairs,) array_like of str
        Of the ranked table.

    Examples
    --------
    >>> prevention_kind([0.1, np.nan], [0.2, 0.0], "yes", "low").tolist()
    ['gap', 'unknown_gap']
    """
    # An assumed gap may be another one
    enough = np.where(np.equal(state, "no"), "nothing", "in_doubt")
    enough = np.where(np.equal(risk_class, UNKNOWN_CLASS), "unknown_gap", enough)
    kind = np.where(np.greater(missing, 0.0), "gap", enough)
    kind = np.where(np.isfinite(missing), kind, "not_computed")
    return np.where(np.isfinite(gap), kind, "unknown_gap")


def missing_gap(known: ArrayLike, demand: ArrayLike, gap: ArrayLike) -> FloatArray:
    """Return the missing gap of a table, else demand minus gap where it is positive, m, or NaN."""
    # Tables of other versions may lack the column
    short = np.maximum(np.subtract(demand, gap), 0.0)
    return np.where(np.isfinite(known), known, np.where(np.isfinite(short), short, np.nan))


def number(pair: "Mapping[Any, Any] | pd.Series[Any]", name: str) -> float:
    """Return a number of a row, NaN where there is none."""
    value = pair.get(name)
    return float(value) if isinstance(value, Real) else math.nan


def _text(pair: Mapping[str, Any], name: str) -> str:
    """Return a text of a row, empty where there is none."""
    value = pair.get(name)
    return value if isinstance(value, str) else ""


def _verdict(pair: Mapping[str, Any]) -> list[str]:
    """Return the sentence on whether the pair pounds."""
    state = STATE_WORDS.get(_text(pair, "state"), "has been screened")
    # Its gap may be known
    state = "has no verdict" if _text(pair, "risk_class") == NO_VERDICT else state
    lines = [f"Pair {name_text(pair['pair_id'])} {state}."]
    if _text(pair, "risk_class"):
        lines.append(f"Class {name_text(pair['risk_class'])}, rank {pair.get('rank', 'unknown')}.")
    # Why a pair without a verdict has a rank
    if _text(pair, "state") == UNKNOWN_STATE and not _text(pair, "worst_scenario"):
        lines.append(RANKED_BY_NEED)
    # A run has one probability, an ensemble perhaps that of a year too
    if math.isfinite(number(pair, "probability")):
        lines.append(f"Probability of contact: {chance_text(number(pair, 'probability'))}.")
    if math.isfinite(number(pair, "annual_probability")):
        lines.append(f"Probability of contact in a year: {number(pair, 'annual_probability'):.2g}.")
    if _text(pair, "worst_scenario"):
        lines += _lacking_lines(pair)
        lines.append(f"Worst scenario: {name_text(pair['worst_scenario'])}.")
    return lines


def _lacking_lines(pair: Mapping[str, Any]) -> list[str]:
    """Return why a pair of an ensemble has no probability, as a list that is empty if it has."""
    if math.isfinite(number(pair, "probability")):
        return []
    if not math.isfinite(number(pair, "gap")):
        return [RANKED_BY_NEED]
    # Scenarios whose column is empty
    columns = (name for name in pair if name.startswith("probability_"))
    lacking = [name.partition("_")[2] for name in columns if math.isnan(number(pair, name))]
    names = name_text(", ".join(lacking))
    return [f"It has no result in {names}, and is ranked by the other scenarios."]


def _gap_lines(pair: Mapping[str, Any]) -> list[str]:
    """Return sentences on the gap and the needed gap."""
    lines = [f"Gap: {length_text(number(pair, 'gap'))}."]
    if math.isfinite(needed := number(pair, "demand")):
        rule = _text(pair, "demand_rule")
        words = DEMAND_RULES.get(rule, name_text(rule) or "rule unknown")
        lines.append(f"Gap needed: {length_text(needed)} ({words}).")
    return lines


def _impact_lines(pair: Mapping[str, Any]) -> list[str]:
    """Return sentences on the severity of the impacts."""
    lines = list[str]()
    if math.isfinite(expected := number(pair, "expected_impact_velocity")):
        text = f"Expected impact velocity: {speed_text(expected)}"
        if math.isfinite(high := number(pair, "impact_velocity_84")):
            text += f"; in 84 of 100 cases not above {speed_text(high)}"
        lines.append(f"{text}.")
    # The exact history, where there is one
    if math.isfinite(impacts := number(pair, "impacts")):
        fastest = speed_text(number(pair, "impact_velocity_exact"))
        lines.append(f"In this record: {impacts:.0f} impacts, the fastest {fastest}.")
        # A rank without an impact needs a reason
        if impacts == 0 and expected > 0:
            hit = chance_text(number(pair, "probability"))
            lines.append(NO_IMPACT.format(hit=hit))
    if math.isfinite(growth := number(pair, "expected_amplification")):
        lines.append(f"Motion with pounding over motion without: {growth:.2g}.")
    return lines


def _building_lines(pair: Mapping[str, Any]) -> list[str]:
    """Describe both buildings."""
    lines = _place_lines(pair)
    for i in (1, 2):
        facts = {
            "period {:.2f} s": number(pair, f"period_{i}"),
            "height {:.3g} m": number(pair, f"height_{i}"),
            "{:.0f} storeys": number(pair, f"storeys_{i}"),
            "latitude {:.5f}": number(pair, f"latitude_{i}"),
            "longitude {:.5f}": number(pair, f"longitude_{i}"),
        }
        # Sentences on known values only
        known = [text.format(value) for text, value in facts.items() if math.isfinite(value)]
        # A name, and the identifier of the inventory
        names = [_text(pair, f"{column}_{i}") for column in ("name", "building_id")]
        name = ", ".join(dict.fromkeys(filter(None, names)))
        if known or name:
            title = f"Building {i} ({name_text(name)})" if name else f"Building {i}"
            lines.append(f"{title}: {', '.join(known)}.")
    return lines


def _place_lines(pair: Mapping[str, Any]) -> list[str]:
    """Return where the pair is, with links to maps."""
    east, north = number(pair, "longitude"), number(pair, "latitude")
    if not (math.isfinite(east) and math.isfinite(north)):
        return []
    # The nearest town where the inventory names no place
    place = _text(pair, "place") or with_towns([""], [east], [north])[0]
    at = f"{north:.5f},{east:.5f}"
    osm = f"https://www.openstreetmap.org/?mlat={north:.5f}&mlon={east:.5f}#map=19/{at}"
    return [f"Place: {name_text(place)}.", f"Maps: geo:{at} {osm.replace(',', '/')}"]


def _motion_lines(pair: Mapping[str, Any]) -> list[str]:
    """Return sentences on the ground motion of the pair."""
    if station := _text(pair, "station"):
        away = number(pair, "distance") / 1000.0
        return [f"Record: station {name_text(station)}, {away:.1f} km away."]
    if spectrum := _text(pair, "spectrum"):
        return [f"Spectrum: {name_text(spectrum)}, not a record."]
    return ["Ground motion: a map, no record."] if "station" in pair else []


def _prevention_lines(pair: Mapping[str, Any]) -> list[str]:
    """Return sentences on measures that prevent or soften pounding."""
    # As on the page
    lines, gap = list[str](), number(pair, "gap")
    missing = float(missing_gap(number(pair, "missing_gap"), number(pair, "demand"), gap))
    names = _text(pair, "state"), _text(pair, "risk_class")
    kind = str(prevention_kind(gap, missing, *names))
    if kind != "gap":
        return [PREVENTION_WORDS[kind].format(motion=_motion_name(pair))]
    # More gap, more damping, a softer contact
    would = "would keep" if _text(pair, "spectrum") else "would have kept"
    lines.append(f"A gap wider by {length_text(missing)} {would} them apart.")
    if not _text(pair, "station"):
        return [*lines, "Damping and bumpers: not computed without a record."]
    if (damping := number(pair, "supplemental_damping")) > 0:
        lines.append(f"So would {100 * damping:.2g} percent more damping in both.")
    if (rebound := number(pair, "bumper_restitution")) < 1.0:
        lines.append(f"A bumper of restitution {rebound:.2g} or less would soften it.")
    return lines


def _motion_name(pair: Mapping[str, Any]) -> str:
    """Return the ground motion of a pair as the end of a sentence."""
    if _text(pair, "spectrum"):
        return "under this spectrum"
    return "in these scenarios" if _text(pair, "worst_scenario") else "in this event"


def _flag_lines(pair: Mapping[str, Any]) -> list[str]:
    """Explain every flag, and name the derived inputs."""
    lines = [
        f"Flag {name_text(flag)}: {FLAGS.get(flag, 'see the table of columns')}."
        for flag in _text(pair, "flags").split()
    ]
    if derived := _text(pair, "derived"):
        names = ", ".join(derived.split()).replace("_", " ")
        lines.append(f"Derived, not given: {shortened(names, 300)}.")
    return lines
