"""Content of the page: data for its script, as JSON values and packed tables."""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import pandas as pd

from per_obspy.errors import shortened
from per_obspy.report.coverage import coverage_number, coverage_sentences
from per_obspy.report.page.export_columns import addresses, pack_export, text_kind
from per_obspy.report.page.first_screen import Event, PageBuildings, first_screen
from per_obspy.report.page.packing import (
    FRACTION_BITS,
    LONGEST_TEXT,
    PackedTable,
    pack_table,
)
from per_obspy.report.page.tally import PairTally
from per_obspy.report.page.texts import LANGUAGES, Language, fixed_phrases, written
from per_obspy.report.style import BUILDING_COLOURS, class_colours
from per_obspy.report.words import missing_gap, prevention_kind
from per_obspy.screening.columns import FLAGS
from per_obspy.screening.ranking import EVERY_STATE
from per_obspy.tables.coverage import Coverage

#: Columns of a pair on the page, and their kinds.
PAIR_KINDS = {
    "rank": "whole", "pair_id": "text", "state": "choice", "risk_class": "choice",
    "probability": "number", "expected_impact_velocity": "number", "impact_velocity_84": "number",
    "expected_amplification": "number", "gap": "number", "demand": "number",
    "demand_rule": "choice", "missing_gap": "number", "impacts": "number",
    "impact_velocity_exact": "number", "amplification_exact_1": "number",
    "amplification_exact_2": "number", "flags": "names", "derived": "names", "area": "choice",
    "station": "choice", "distance": "number", "azimuth_used": "number",
    "building_id_1": "text", "building_id_2": "text", "longitude": "place", "latitude": "place",
    "longitude_1": "place", "latitude_1": "place", "longitude_2": "place", "latitude_2": "place",
    "height_1": "number", "height_2": "number", "storeys_1": "number", "storeys_2": "number",
    "period_1": "number", "period_2": "number", "damping_1": "number", "damping_2": "number",
    "participation_1": "number", "participation_2": "number", "per_1": "number",
    "per_2": "number", "sd_1": "number", "sd_2": "number", "period_log_std_1": "number",
    "period_log_std_2": "number", "supplemental_damping": "number",
    "bumper_restitution": "number", "prevention_kind": "choice", "worst_scenario": "choice",
}  # fmt: skip

#: Largest and smallest probability below 1 and above 0 that single precision keeps apart from them.
NEARLY_NEVER, NEARLY_SURE = 1e-30, 1.0 - 2.0**-FRACTION_BITS

#: Kinds of texts that the script never shows by their keys.
HIDDEN = ("flag_", "flagname_", "class_", "kind_", "stations_", "sure_", "todo_", "number_")

#: Columns of a building on the page, and their kinds.
BUILDING_KINDS = {
    "rank": "number", "building_id": "text", "probability_common": "number",
    "neighbours": "number", "neighbours_that_can_hit": "number", "impacts": "number",
    "impact_velocity": "number", "position": "choice", "prevention": "choice",
}  # fmt: skip

#: Columns of the tables further down.
STATION_COLUMNS = (
    "station", "state", "pairs", "pga", "pgv", "per", "sd", "shortest_usable_period",
    "longest_usable_period", "warnings",
)  # fmt: skip
AREA_COLUMNS = (
    "area", "pairs", "yes", "likely", "possible", "expected_pounding", "worst_pair",
    "worst_expected_impact_velocity",
)  # fmt: skip
REJECTED_COLUMNS = ("kind", "name", "source", "row", "reasons")

#: Rows of the tables further down.
MOST_ROWS = 500

#: Longest text of a cell in them, characters.
LONGEST_CELL = 300


class PageDrawings(NamedTuple):
    """
    Drawings and sensitivities of some pairs and stations.

    Attributes
    ----------
    stations : mapping of str to dict
        Name -> record and spectra of a station for a drawing.
    sensitivity : mapping of int to list
        Rank -> input, both values, and probability and state at each of them.
    worst, doubtful : int
        Pairs whose sensitivity is computed: the worst, and those with a chance nearest to a half.
    """

    stations: Mapping[str, dict[str, Any]]
    sensitivity: Mapping[int, list[list[Any]]]
    worst: int
    doubtful: int


#: A page without drawings of stations and without sensitivities.
NO_DRAWINGS = PageDrawings({}, {}, 0, 0)


class PageData(NamedTuple):
    """
    Data of a page.

    Attributes
    ----------
    title : str
        Name of the run.
    language : Language
        Of its texts.
    simulated : bool
        Whether the motion is simulated.
    classes : sequence of str
        Names of the risk classes, worst first.
    event : Event
        The earthquake.
    tally : PairTally
        Of all pairs.
    worst : DataFrame
        The worst pairs in their order, at most ``PAGE_PAIRS``.
    stations, areas, rejected : DataFrame
        Tables of the run; ``rejected`` is its beginning.
    rejections : int
        Rows of the whole table of rejections.
    buildings : PageBuildings or None
        The worst buildings, and how many a neighbour can hit.
    outlines : list of (str, list of float)
        Buildings and their outlines: longitude and latitude by turns, degrees.
    lines : mapping of str to list
        ``coast`` and ``borders``, lines of longitude and latitude by turns.
    histories : mapping of int to dict
        Rank -> history of a pair for a drawing.
    provenance : sequence of (str, str)
        Where the results come from.
    coverage : Coverage
        Rows of the pair tables, and those that are left out.
    drawings : PageDrawings
        Stations and sensitivities for drawings.
    kind : str
        ``run``, ``design`` or ``ensemble``, which differ in some texts.
    """

    title: str
    language: Language
    simulated: bool
    classes: Sequence[str]
    event: Event
    tally: PairTally
    worst: pd.DataFrame
    stations: pd.DataFrame
    areas: pd.DataFrame
    rejected: pd.DataFrame
    rejections: int
    buildings: PageBuildings | None
    outlines: Sequence[tuple[str, list[float]]]
    lines: Mapping[str, list[list[float]]]
    histories: Mapping[int, dict[str, Any]]
    provenance: Sequence[tuple[str, str]]
    coverage: Coverage
    drawings: PageDrawings = NO_DRAWINGS
    kind: str = "run"


def page_content(data: PageData) -> tuple[dict[str, Any], list[PackedTable]]:
    """Return the content of the page, with descriptions of its tables, and the tables."""
    # Sentences first, then whatever the script draws
    facts = data.language, data.simulated
    # Tables of which it names rows
    found = data.areas, data.stations
    screen = first_screen(data.event, data.tally, data.worst, found, data.buildings, facts)
    # What has a verdict, of all that should have one, is the first number
    screen.numbers.insert(0, _pairs_screened(data))
    texts, tables = LANGUAGES[data.language], _tables(data)
    content = {
        "language": data.language,
        "texts": _texts(texts, data.kind),
        "flags": {name: texts[f"flag_{name}"] for name in FLAGS},
        "flag_names": {name: texts[f"flagname_{name}"] for name in FLAGS},
        "title": shortened(data.title, LONGEST_CELL),
        "simulated": data.simulated,
        "coverage": coverage_sentences(data.coverage, data.language),
        "warns": data.coverage.lacks_many,
        **screen._asdict(),
        "states": _states(data.tally, texts),
        "classes": _classes(data, texts),
        "pair_count": data.tally.pairs,
        **_drawn(data),
        **_further_tables(data, texts),
        "tables": [table.description for table in tables],
    }
    return content, tables


def _pairs_screened(data: PageData) -> tuple[str, str]:
    """Return the number of pairs with a verdict, and its meaning."""
    whole = partial(written, digits=0, language=data.language)
    return coverage_number(data.coverage, data.language, whole)


def _texts(texts: Mapping[str, str], kind: str) -> dict[str, str]:
    """Return the texts of the script; those of this kind of page replace the general ones."""
    shown = {key: text for key, text in texts.items() if not key.startswith(HIDDEN)}
    ending = f"_{kind}"
    own = {key.removesuffix(ending): shown[key] for key in shown if key.endswith(ending)}
    return shown | own


def _drawn(data: PageData) -> dict[str, Any]:
    """Return the data of map and figures that are not in tables."""
    return {
        "building_colours": BUILDING_COLOURS,
        "cell_size": data.tally.cells.size,
        "epicentre": list(data.event.place[:2]) if data.event.place else None,
        **data.lines,
        # Names as they are packed, by which the script finds the pairs of an outline
        "outlines": [[shortened(name, LONGEST_TEXT), ring] for name, ring in data.outlines],
        "histories": {str(rank): history for rank, history in data.histories.items()},
        "history_count": len(data.histories),
        "station_drawings": {
            shortened(name, LONGEST_TEXT): drawn for name, drawn in data.drawings.stations.items()
        },
        "sensitivity": {str(rank): rows for rank, rows in data.drawings.sensitivity.items()},
        "sensitivity_counts": [data.drawings.worst, data.drawings.doubtful],
    }


def _tables(data: PageData) -> list[PackedTable]:
    """Return pairs, cells, buildings, and the columns of pairs that only the export needs."""
    cells = data.tally.cells.table()
    kinds = dict.fromkeys(("longitude", "latitude"), "place")
    kinds |= {str(name): "whole" for name in cells if name not in kinds}
    # Places of the inventory by name, for the search
    address, pairs = addresses(data.worst), _with_measures(data.worst)
    if address is not None:
        pairs = pairs.assign(address=address)
    return [
        pack_table(pairs, PAIR_KINDS | {"address": text_kind(pairs, "address")}),
        pack_table(cells, kinds),
        pack_table(_buildings(data), BUILDING_KINDS),
        pack_export(data.worst, PAIR_KINDS),
    ]


def _with_measures(worst: pd.DataFrame) -> pd.DataFrame:
    """Return pairs with the case of their measures, and probabilities that stay below 1."""
    names = ("gap", "demand", "missing_gap", "state", "risk_class")
    known = worst[[name for name in names if name in worst]].to_dict("records")
    pairs = worst.assign(prevention_kind=[prevention_kind(pair) for pair in known])
    if "demand" in worst:
        pairs = pairs.assign(missing_gap=[missing_gap(pair) for pair in known])
    if "probability" not in pairs:
        return pairs
    # Neither 0 nor 1 may come of the packing
    chance = pairs["probability"]
    open_chance = (chance > 0.0) & (chance < 1.0)
    kept = chance.clip(NEARLY_NEVER, NEARLY_SURE).where(open_chance, chance)
    return pairs.assign(probability=kept)


def _buildings(data: PageData) -> pd.DataFrame:
    """Return the buildings with their prevention in the language of the page."""
    if data.buildings is None:
        return pd.DataFrame()
    worst = data.buildings.worst
    if "prevention" not in worst:
        return worst
    sentences = [fixed_phrases(str(text), data.language) for text in worst["prevention"]]
    return worst.assign(prevention=sentences)


def _states(tally: PairTally, texts: Mapping[str, str]) -> list[dict[str, Any]]:
    """Return the states, the likeliest first, with label and number of pairs."""
    return [
        {"name": name, "label": texts[f"state_{name}"], "count": tally.states[name]}
        for name in EVERY_STATE
    ]


def _classes(data: PageData, texts: Mapping[str, str]) -> list[dict[str, Any]]:
    """Return the classes, the worst first, with colour, weight of the mark and number of pairs."""
    colours = class_colours(data.classes)
    return [
        {
            "name": name,
            "label": texts.get(f"class_{name}", shortened(name, 40)),
            "colour": colour,
            "weight": 4.0 * max(1.0 - number / max(len(colours) - 2, 1), 0.0),
            "count": data.tally.classes[name],
        }
        for number, (name, colour) in enumerate(colours.items())
    ]


def _further_tables(data: PageData, texts: Mapping[str, str]) -> dict[str, Any]:
    """Return stations, areas, rejections and provenance."""
    areas, note = data.areas, texts["rejected_none"]
    if "expected_pounding" in areas:
        areas = areas.sort_values("expected_pounding", ascending=False)
    if data.rejections:
        shown = min(data.rejections, MOST_ROWS)
        key = "rejected_some_one" if data.rejections == 1 else "rejected_some"
        note = texts[key].format(shown=shown, all=data.rejections)
    elif data.coverage.pairs > data.coverage.screened:
        # What the search for pairs left out is in no table of this run
        note = " ".join(coverage_sentences(data.coverage, data.language))
    # Stations are on the map too
    stations = _rows(_described(data.stations, data.language), STATION_COLUMNS, texts)
    return {
        "stations": {**stations, "places": _station_places(data.stations)},
        "areas": _rows(areas, AREA_COLUMNS, texts),
        "rejected": {**_rows(_reasons(data, texts), REJECTED_COLUMNS, texts), "note": note},
        "provenance": [[name, shortened(value, LONGEST_CELL)] for name, value in data.provenance],
    }


def _reasons(data: PageData, texts: Mapping[str, str]) -> pd.DataFrame:
    """Return the rejections with kinds and reasons in the language of the page."""
    if not {"kind", "reasons"} <= set(data.rejected):
        return data.rejected
    kinds = [texts.get(f"kind_{kind}", str(kind)) for kind in data.rejected["kind"]]
    reasons = [fixed_phrases(str(text), data.language) for text in data.rejected["reasons"]]
    return data.rejected.assign(kind=kinds, reasons=reasons)


def _described(stations: pd.DataFrame, language: Language) -> pd.DataFrame:
    """Return stations with their states in words, and reasons of rejection with the warnings."""
    texts = LANGUAGES[language]
    if not {"state", "warnings", "rejected"} <= set(stations):
        return stations
    # Reasons and warnings are one column
    named = {name: texts[f"station_{name}"] for name in ("used", "rejected")}
    both = stations["rejected"].fillna("") + " " + stations["warnings"].fillna("")
    state = stations["state"].map(named).fillna("")
    sentences = [fixed_phrases(text, language) for text in both.str.strip()]
    return stations.assign(state=state, warnings=sentences)


def _station_places(stations: pd.DataFrame) -> list[list[Any]]:
    """Return name, longitude, latitude of every station with a place, and whether it is used."""
    if not {"longitude", "latitude"} <= set(stations):
        return []
    placed = stations[stations["longitude"].notna() & stations["latitude"].notna()]
    return [
        [
            shortened(str(row["station"]), 24),
            float(row["longitude"]),
            float(row["latitude"]),
            row["state"] == "used",
        ]
        for _, row in placed.iterrows()
    ]


def _rows(table: pd.DataFrame, columns: Sequence[str], texts: Mapping[str, str]) -> dict[str, Any]:
    """Return headings and rows for the columns that a table has."""
    present = [name for name in columns if name in table]
    rows = [
        [_cell(value) for value in row]
        for row in table[present].head(MOST_ROWS).itertuples(index=False)
    ]
    return {"heads": [texts[f"head_{name}"] for name in present], "rows": rows}


def _cell(value: Any) -> str | float:
    """Return a value of a table for JSON; missing values are empty texts."""
    if value is None or value is pd.NA:
        return ""
    if isinstance(value, str):
        return shortened(value, LONGEST_CELL)
    number = float(value)
    return number if math.isfinite(number) else ""
