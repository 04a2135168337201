"""English texts of the page, and formats of texts and numbers by language."""

from collections.abc import Mapping
from typing import Literal

from per_obspy.report.page.languages.phrases import in_spanish
from per_obspy.report.page.languages.spanish import SPANISH
from per_obspy.screening.columns import DEMAND_RULES, FLAGS

Language = Literal["en", "es"]

ENGLISH: dict[str, str] = {
    # First screen
    "simulated": "SIMULATED ground motion: an exercise, not an earthquake that happened.",
    "skip": "to the table of pairs",
    "summary": "summary",
    "do_first": "What to do first",
    "how_sure": "How sure this is",
    "number_pounding": "pairs hit each other, surely or likely",
    "number_pounding_one": "pair surely or likely hits",
    "number_expected": "pairs expected to hit each other",
    "number_expected_one": "pair expected to hit",
    "number_severe": "in the worst class: {name}",
    "number_velocity": "fastest expected impact",
    "number_buildings": "buildings that a neighbour can hit",
    "number_buildings_one": "building that a neighbour can hit",
    "event_magnitude": "Magnitude {value}",
    "event_time": "Records start {time} UTC",
    "event_place": "epicentre {latitude}°, {longitude}°",
    "event_depth": "depth {value} km",
    "revision": "Revision {value}",
    "revision_time": "Revision {value}, {time} UTC",
    "stations_expected": "{count} stations expected",
    "stations_expected_one": "{count} station expected",
    "stations_used": "{count} used",
    "stations_used_one": "{count} used",
    "stations_missing": "{count} missing or rejected",
    "stations_missing_one": "{count} missing or rejected",
    "and_more": "and {count} more",
    "todo_exercise": "Send no team: the motion is simulated.",
    "todo_worst": "Inspect the pairs of the fastest impacts first: {names}.",
    "todo_buildings": "Inspect these buildings first: {names}.",
    "todo_areas": "Begin in the areas with most expected pounding: {names}.",
    "todo_unknown": "Measure {count} gaps that are unknown: there is no verdict without them.",
    "todo_unknown_one": "Measure {count} gap that is unknown: there is no verdict without it.",
    "todo_possible_one": "Then look at the {count} pair that possibly, not likely, hits.",
    "todo_possible": "Then look at the {count} pairs that possibly, not likely, hit each other.",
    "todo_none": "No pair is likely to hit its neighbour; check the possible ones.",
    "sure_expected": (
        "{mean} pairs are expected to pound; the standard deviation lies between {low} "
        "(independent pairs) and {high} (one cause for all)."
    ),
    "sure_expected_one": (
        "{mean} pair is expected to pound; the standard deviation lies between {low} "
        "(independent pairs) and {high} (one cause for all)."
    ),
    "sure_derived_one": "{count} of {all} pairs has inputs that are derived, not measured.",
    "sure_far_one": "{count} pair uses a station that is far away.",
    "sure_periods_one": "{count} pair has a period outside the usable periods of its record.",
    "sure_station_class_one": "{count} pair uses the record of another site class.",
    "sure_record_one": "{count} pair uses a record with a warning: see the stations.",
    "sure_map_one": "{count} pair has no station in reach: a ShakeMap gives its demand.",
    "sure_derived": "{count} of {all} pairs have inputs that are derived, not measured.",
    "sure_far": "{count} pairs use a station that is far away.",
    "sure_periods": "{count} pairs have a period outside the usable periods of their record.",
    "sure_station_class": "{count} pairs use the record of another site class.",
    "sure_record": "{count} pairs use a record with a warning: see the stations.",
    "sure_map": "{count} pairs have no station in reach: a ShakeMap gives their demand.",
    "sure_distance": "The records lie {value} km from the pairs, as the median.",
    "sure_nature": (
        "Two oscillators stand for each pair; damage of the buildings is not computed."
    ),
    # Map
    "map": "Map of the pairs",
    "map_help": (
        "Map of the pairs. Arrow keys move it, plus and minus enlarge and reduce it, Home shows "
        "all. The table below holds the same pairs."
    ),
    "nearer": "enlarge",
    "further": "reduce",
    "whole": "show all",
    "station": "station",
    "epicentre": "epicentre",
    "cells_note": (
        "The worst {shown} of {all} pairs are drawn one by one; the others are counted in cells, "
        "in the colour of the worst class in them. They follow the filters of severity and "
        "pounding."
    ),
    "cells_hidden": (
        "The worst {shown} of {all} pairs are drawn one by one. The others are counts per cell, "
        "which are hidden now: a filter is set that counts cannot follow."
    ),
    # Filters and table
    "pairs": "Pairs, the worst first",
    "state": "pounding",
    "risk_class": "severity",
    "legend": "Severity, by expected impact:",
    "any": "any",
    "least_probability": "probability from, %",
    "least_velocity": "impact from, cm/s",
    "area": "area",
    "flag": "flag",
    "search": "search",
    "search_hint": "identifier, place name, or latitude, longitude",
    "flags_any": "with any of these",
    "flags_all": "with all of these",
    "flags_none": "with none of these",
    "flags_chosen": "{label}: {count}",
    "export_lacks": "The export has no column {names}: risk.csv has them.",
    "count": "{found} of {shown} pairs of this page ({all} screened)",
    "export": "export as CSV",
    "clear": "clear filters",
    "more": "more rows",
    "column_rank": "rank",
    "column_pair_id": "pair",
    "column_risk_class": "severity",
    "column_state": "pounding",
    "column_probability": "probability, %",
    "column_expected_impact_velocity": "impact, cm/s",
    "column_gap": "gap, cm",
    "column_demand": "needed, cm",
    "column_missing_gap": "missing, cm",
    "column_expected_amplification": "amplification",
    "column_station": "station",
    "state_yes": "sure",
    "state_likely": "likely",
    "state_possible": "possible",
    "state_unlikely": "unlikely",
    "state_no": "no",
    "state_unknown": "gap unknown",
    "class_severe": "severe",
    "class_high": "high",
    "class_moderate": "moderate",
    "class_low": "low",
    "class_gap unknown": "gap unknown",
    # One pair
    "pair": "Pair",
    "building": "Building",
    "close": "close",
    "says_probability": "The probability of pounding in this event is {value} %.",
    "says_probability_design": "The probability of pounding under this spectrum is {value} %.",
    "says_probability_ensemble": (
        "The probability of pounding, if one of the scenarios happens, is {value} %."
    ),
    "says_velocity": (
        "The buildings are expected to meet at {value} cm/s; in 84 of 100 outcomes it is at most "
        "{high} cm/s."
    ),
    "says_velocity_alone": "The buildings are expected to meet at {value} cm/s.",
    "says_touching": "The buildings touch: the gap is 0 cm.",
    "says_gap": "The gap is {value} cm.",
    "says_no_gap": "The gap is unknown.",
    "says_demand": "The gap needed is {value} cm ({rule}).",
    "says_impacts": "The exact history has {count} impacts, the fastest at {velocity} cm/s.",
    "says_impacts_one": "The exact history has {count} impact, at {velocity} cm/s.",
    "says_amplification": "Pounding multiplies the motion of one of them by {value}.",
    "says_address": "Place: {value}.",
    "says_station": "Record of station {station}, {value} km away.",
    **{f"rule_{name}": words for name, words in DEMAND_RULES.items()},
    "rule_": "rule unknown",
    "both_buildings": "Both buildings",
    "fact_building_id": "building",
    "fact_height": "height, m",
    "fact_storeys": "storeys",
    "fact_period": "period, s",
    "fact_damping": "damping, %",
    "fact_participation": "participation at contact height",
    "fact_per": "PER, cm",
    "fact_sd": "SD, cm",
    "fact_amplification_exact": "motion with / without pounding",
    "circles_gap": "Circles of energy at the gap that there is, {value} cm",
    "circles_needed": "Circles of energy at the gap needed, {value} cm",
    "circles_note": (
        "Radius: the largest motion of each building at contact height, as energy (PER). Lines: "
        "the faces of the buildings at rest. Building 2 is dashed."
    ),
    "history": "Displacements over time, cm, and {count} impacts",
    "history_one": "Displacements over time, cm, and {count} impact",
    "history_note": (
        "Building 1 solid, building 2 dashed and a gap away; bars below: impacts, the higher the "
        "faster. Follows the record; after some ten impacts two correct programs may differ."
    ),
    "history_apart": (
        "With the inputs of this page they do not meet, as where both periods are the same; the "
        "probability counts the other values that the inputs may have."
    ),
    "no_history": (
        "The page holds the histories of the {count} worst pairs with a known gap and a record. "
        "For this pair, in the folder of the results: {command}"
    ),
    "prevention": "What would have prevented it",
    "prevention_design": "What would prevent it",
    "prevention_ensemble": "What would prevent it",
    "prevents_gap": "{value} cm more gap, {whole} cm in all.",
    "prevents_damping": "{value} % of critical damping added to both buildings.",
    "prevents_no_damping": "Damping alone does not: 40 % of critical added is too little.",
    "prevents_bumper": (
        "Bumpers do not prevent it but soften it: restitution at most {value} (estimate)."
    ),
    "prevents_without_record": "Damping and bumpers: not computed without a record.",
    "prevents_unknown_gap": ("The gap is unknown: measure it first. The gap needed is {whole} cm."),
    "prevents_unknown_gap_ensemble": "The gap is unknown: measure it first.",
    "prevents_not_computed": "Not computed for this pair.",
    "prevents_not_computed_ensemble": (
        "Not computed for several scenarios together: see the results of the worst one, {name}."
    ),
    "prevents_in_doubt": (
        "The gap of {gap} cm is enough for the likeliest inputs, which need {whole} cm. The "
        "probability counts other values of the inputs, at which it is not."
    ),
    "prevents_nothing": (
        "None needed in this event: the gap is {gap} cm, the gap needed {whole} cm."
    ),
    "prevents_nothing_design": (
        "None needed under this spectrum: the gap is {gap} cm, the gap needed {whole} cm."
    ),
    "flags": "Flags",
    "derived": "Derived inputs",
    "derived_spread": (
        "Derived periods are uncertain: their logarithmic standard deviations are {first} % and "
        "{second} %, and the probability counts this."
    ),
    "derived_fixed": "Their uncertainty is not part of the probability.",
    "sensitivity": "If one input had another value",
    "sensitivity_note": (
        "Each input alone at the value that it does not exceed in 16, and in 84, of 100 cases; "
        "all else stays as uncertain as it is."
    ),
    "sensitivity_none": (
        "Computed for the {worst} worst pairs and the {doubtful} most doubtful ones, not for this."
    ),
    "sensitivity_fixed": "No deviation is known of: {names}. The probability takes them as exact.",
    "column_input": "input",
    "column_low": "at 16 of 100",
    "column_high": "at 84 of 100",
    "column_then": "then",
    "chance_and_state": "{chance} %, {state}",
    "other_pairs": "Its other pairs:",
    "building_says": (
        "Rank {rank} of the buildings; neighbours that can hit it: {hit} of {neighbours}; the "
        "probability that one does is at least {probability} %."
    ),
    "building_impacts": "In its row it is hit {count} times, at up to {velocity} cm/s.",
    "building_impacts_one": "In its row it is hit {count} time, at {velocity} cm/s.",
    "building_prevention": "Prevention: {value}.",
    "position_inside": "inside its row",
    "position_end": "end of its row",
    "position_corner": "corner of two rows",
    "position_single": "one pair only",
    # One station
    "station_pairs": "Its record serves {count} pairs.",
    "station_pairs_one": "Its record serves {count} pair.",
    "station_record": "Processed acceleration, m/s²: north above, east below",
    "station_record_note": (
        "Each interval of {value} s is drawn from its smallest to its largest sample, so that "
        "every peak stays."
    ),
    "station_spectra": "PER (solid) and SD (dashed) at {value} % damping, cm, over the period, s",
    "station_spectra_note": (
        "The larger horizontal. Shaded: periods that are not usable. PER far above SD comes from "
        "slow motion, of which PER holds the velocity too."
    ),
    "station_none_one": "The page draws the {count} station that serves most pairs.",
    "station_none": "The page draws the {count} stations that serve most pairs.",
    "station_clear": "No check of its record has failed.",
    "show_pairs": "filter its pairs",
    # Inputs
    "input_system": "structural system",
    "input_period": "period",
    "input_period_correlation": "likeness of both periods",
    "input_damping": "damping",
    "input_mass": "mass",
    "input_area": "floor area",
    "input_height": "height",
    "input_storeys": "storeys",
    "input_participation": "participation",
    "input_yield_displacement": "yield displacement",
    "input_contact_height": "contact height",
    "input_floor_offset": "floor offset",
    "input_restitution": "restitution",
    "input_gap": "gap",
    "input_gap_std": "deviation of the gap",
    # Rest
    "stations": "Stations",
    "areas": "Areas",
    "rejected": "Rejected, with reasons",
    "rejected_none": "No input was rejected.",
    "rejected_some": "{shown} of {all} rejections; all are in rejected.csv.",
    "rejected_some_one": "{shown} of {all} rejection; it is in rejected.csv too.",
    "provenance": "Where this comes from",
    "head_station": "station",
    "head_state": "state",
    "head_pairs": "pairs",
    "head_pga": "PGA, m/s²",
    "head_pgv": "PGV, m/s",
    "head_per": "PER (1 s), cm",
    "head_sd": "SD (1 s), cm",
    "head_shortest_usable_period": "usable from, s",
    "head_longest_usable_period": "to, s",
    "head_warnings": "warnings and reasons",
    "head_area": "area",
    "head_yes": "sure",
    "head_likely": "likely",
    "head_possible": "possible",
    "head_expected_pounding": "expected",
    "head_worst_pair": "worst pair",
    "head_worst_expected_impact_velocity": "its impact, m/s",
    "head_kind": "kind",
    "head_name": "name",
    "head_source": "source",
    "head_row": "row",
    "head_reasons": "reasons",
    "made_with": "made with",
    "files": "files next to this page",
    "files_list": "risk.parquet or risk/, stations.csv, rejected.csv, run.json (input hashes)",
    "configuration": "configuration",
    "station_used": "used",
    "station_rejected": "rejected",
    **{f"flag_{name}": meaning for name, meaning in FLAGS.items()},
    **{f"flagname_{name}": name.replace("_", " ") for name in FLAGS},
    # Kinds of rejections
    "kind_file": "file",
    "kind_record": "record",
    "kind_station": "station",
    "kind_service": "service",
    "kind_pair": "pair",
    "kind_building": "building",
    "kind_row": "row",
}

LANGUAGES: Mapping[str, Mapping[str, str]] = {"en": ENGLISH, "es": {**ENGLISH, **SPANISH}}


def written(value: float, digits: int, language: Language) -> str:
    """
    Return a number with its digits as a language writes it.

    Examples
    --------
    >>> written(12345.678, 1, "en"), written(12345.678, 1, "es")
    ('12,345.7', '12.345,7')
    """
    text = f"{value:,.{digits}f}"
    return text if language == "en" else text.translate(str.maketrans(",.", ".,"))


def counted(language: Language, key: str, count: float, **values: str) -> str:
    """
    Return a text about a number of things, in the singular if the number is 1.

    Parameters
    ----------
    language : {"en", "es"}
        Of the text.
    key : str
        Of the plural; the singular has ``_one`` after it, if it differs.
    count : float
        Number of things, written as a whole number for ``{count}``.
    **values : str
        Other parts of the text.

    Examples
    --------
    >>> counted("en", "stations_expected", 1), counted("en", "stations_expected", 2000)
    ('1 station expected', '2,000 stations expected')
    """
    texts, shown = LANGUAGES[language], written(count, 0, language)
    single = f"{key}_one"
    text = texts[single] if shown == "1" and single in texts else texts[key]
    return text.format(count=shown, **values)


def fixed_phrases(text: str, language: Language) -> str:
    """Translate the fixed phrases of a sentence from other modules."""
    return in_spanish(text) if language == "es" else text
