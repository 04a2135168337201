"""Page as one HTML file: content as JSON values and packed tables, with its style and script."""

import hashlib
import math
import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.errors import shortened
from per_obspy.files import written_whole
from per_obspy.report.coverage import coverage_sentences
from per_obspy.report.page.packing import (
    LONGEST_TEXT,
    PackedTable,
    address_columns,
    addresses,
    encoded,
    pack_table,
    text_kind,
)
from per_obspy.report.results import Results
from per_obspy.report.statements import (
    alert,
    class_text,
    first_steps,
    key_numbers,
    revision_line,
    station_sentences,
    sureness,
)
from per_obspy.report.style import BUILDING_COLOURS, UNKNOWN_COLOUR, class_colours
from per_obspy.report.texts import LANGUAGES, fixed_phrases
from per_obspy.report.words import missing_gap, prevention_kind
from per_obspy.results.table_files import rounded_table
from per_obspy.screening.meanings import FLAGS
from per_obspy.screening.ranking import EVERY_STATE

#: Columns of a pair on the page, and their kinds.
PAIR_KINDS = {
    "rank": "whole", "pair_id": "text", "state": "choice", "risk_class": "choice",
    "probability": "chance", "expected_impact_velocity": "number", "impact_velocity_84": "number",
    "expected_amplification": "number", "gap": "number", "demand": "number",
    "demand_rule": "choice", "missing_gap": "number", "impacts": "whole",
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
    "annual_probability": "number", "gap_for_target": "number",
}  # fmt: skip

#: Pairs with a verdict, and those without one, in the bar of the coverage.
SCREENED_COLOUR, LEFT_OUT_COLOUR = "#7A8B99", "#1B1B1B"

#: Longest text on the earthquake, or on what stands in its place, characters.
LONGEST_SOURCE = 500

#: Kinds of texts that the script never shows by their keys.
HIDDEN = (
    "flag_", "flagname_", "class_", "kind_", "stations_", "sure_", "todo_", "number_", "alert_",
    "page_", "map_title", "overview_", "coverage_some", "coverage_search",
)  # fmt: skip

#: Columns of a building on the page, and their kinds.
BUILDING_KINDS = {
    "rank": "whole", "building_id": "text", "probability_common": "chance",
    "neighbours": "whole", "neighbours_that_can_hit": "whole", "impacts": "whole",
    "impact_velocity": "number", "impact_velocity_84": "number", "position": "choice",
    "prevention": "names",
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


def page_content(results: Results) -> tuple[dict[str, Any], list[PackedTable]]:
    """Return the content of the page, with descriptions of its tables, and the tables."""
    texts, tables = results.texts, _tables(results)
    # Sentences first, then whatever the script draws
    content = {
        "language": results.language,
        "texts": {key: text for key, text in texts.items() if not key.startswith(HIDDEN)},
        "flags": {name: texts[f"flag_{name}"] for name in FLAGS},
        "flag_names": {name: texts[f"flagname_{name}"] for name in FLAGS},
        **_sentences(results),
        # The likeliest first
        "states": [
            {"name": name, "label": texts[f"state_{name}"], "count": results.tally.states[name]}
            for name in EVERY_STATE
        ],
        "classes": _classes(results, texts),
        "pair_count": results.tally.pairs,
        **_drawn(results),
        **_further_tables(results, texts),
        "tables": [table.description for table in tables],
    }
    return content, tables


def _sentences(results: Results) -> dict[str, Any]:
    """Return title, alert, coverage, earthquake, numbers, actions and doubts."""
    coverage = results.coverage
    # The bar says all of a table that is screened wholly
    is_whole = coverage.pairs == coverage.screened and not coverage.search
    return {
        "title": shortened(results.region.title, LONGEST_CELL),
        "simulated": results.region.simulated,
        "alert": alert(results)._asdict(),
        "coverage": [] if is_whole else coverage_sentences(coverage, results.language),
        "coverage_bar": _coverage_bar(results, results.texts),
        "warns": coverage.lacks_many,
        "event": shortened(" ".join(results.source), LONGEST_SOURCE),
        "revision": revision_line(results.revision, results.language),
        "expected": " ".join(station_sentences(results.stations, results.language)),
        "numbers": key_numbers(results),
        "first": first_steps(results),
        "sure": sureness(results),
    }


def _coverage_bar(results: Results, texts: Mapping[str, str]) -> list[list[Any]]:
    """Return label, number and colour of the rows with a verdict, an unknown gap, or neither."""
    coverage, unknown = results.coverage, results.tally.states["unknown"]
    parts = (
        ("screened", coverage.screened - unknown, SCREENED_COLOUR),
        ("unknown", unknown, UNKNOWN_COLOUR),
        ("left_out", coverage.pairs - coverage.screened, LEFT_OUT_COLOUR),
    )
    return [[texts[f"coverage_{name}"], count, colour] for name, count, colour in parts]


def _drawn(results: Results) -> dict[str, Any]:
    """Return the data of map and figures that are not in tables."""
    drawings = results.drawings
    return {
        "building_colours": BUILDING_COLOURS,
        "cell_size": results.tally.cells.size,
        "epicentre": list(results.region.epicentre) if results.region.epicentre else None,
        **results.lines,
        # Names as they are packed, by which the script finds the pairs of an outline
        "outlines": [[shortened(name, LONGEST_TEXT), ring] for name, ring in results.outlines],
        "histories": {str(rank): history for rank, history in drawings.histories.items()},
        "history_count": len(drawings.histories),
        "station_drawings": {
            shortened(name, LONGEST_TEXT): station for name, station in drawings.stations.items()
        },
        "sensitivity": {str(rank): rows for rank, rows in drawings.sensitivity.items()},
        "sensitivity_counts": [drawings.worst, drawings.doubtful],
    }


def page_columns(names: Iterable[Any]) -> list[Any]:
    """Return the columns of a table of pairs that the page shows or searches."""
    known = list(names)
    return [*(name for name in PAIR_KINDS if name in known), *address_columns(known)]


def _tables(results: Results) -> list[PackedTable]:
    """Return pairs, cells and buildings."""
    cells = results.tally.cells.table()
    kinds = dict.fromkeys(("longitude", "latitude"), "place")
    kinds |= {str(name): "whole" for name in cells if name not in kinds}
    # Places of the inventory by name, for the search
    address, pairs = addresses(results.worst), _with_measures(results.worst)
    if address is not None:
        pairs = pairs.assign(address=address)
    return [
        pack_table(pairs, PAIR_KINDS | {"address": text_kind(pairs, "address")}),
        pack_table(cells, kinds),
        pack_table(_buildings(results), BUILDING_KINDS),
    ]


def _with_measures(worst: pd.DataFrame) -> pd.DataFrame:
    """Return pairs with the case of their measures."""
    names = ("missing_gap", "demand", "gap")
    known, demand, gap = (worst.get(name, np.nan) for name in names)
    missing = missing_gap(known, demand, gap)
    # A table of an ensemble has no demand
    texts = (worst.get(name, "") for name in ("state", "risk_class"))
    pairs = worst.assign(missing_gap=missing) if "demand" in worst else worst
    return pairs.assign(prevention_kind=prevention_kind(gap, missing, *texts))


def _buildings(results: Results) -> pd.DataFrame:
    """Return the buildings with their prevention in the language of the page."""
    worst = results.buildings
    if "prevention" not in worst:
        return worst
    sentences = [fixed_phrases(str(text), results.language) for text in worst["prevention"]]
    return worst.assign(prevention=sentences)


def _classes(results: Results, texts: Mapping[str, str]) -> list[dict[str, Any]]:
    """Return the classes, the worst first, with colour, weight of the mark and number of pairs."""
    # The worst is the first
    colours = class_colours(results.region.classes)
    return [
        {
            "name": name,
            "label": class_text(name, texts),
            "colour": colour,
            "weight": 4.0 * max(1.0 - number / max(len(colours) - 2, 1), 0.0),
            "count": results.tally.classes[name],
        }
        for number, (name, colour) in enumerate(colours.items())
    ]


def _further_tables(results: Results, texts: Mapping[str, str]) -> dict[str, Any]:
    """Return stations, areas, rejections and provenance."""
    areas, note, language = results.areas, texts["rejected_none"], results.language
    if "expected_pounding" in areas:
        areas = areas.sort_values("expected_pounding", ascending=False)
    # Impacts have two digits everywhere
    areas = rounded_table(areas, own=areas.columns)
    if results.rejections:
        shown = results.written(min(results.rejections, MOST_ROWS))
        whole = results.written(results.rejections)
        note = results.counted("rejected_some", results.rejections, shown=shown, all=whole)
    elif results.coverage.pairs > results.coverage.screened:
        # What the search for pairs left out is in no table of this run
        note = " ".join(coverage_sentences(results.coverage, language))
    # Stations are on the map too
    stations = _rows(_described(results.stations, language), STATION_COLUMNS, texts)
    return {
        "stations": {**stations, "places": _station_places(results.stations)},
        "areas": _rows(areas, AREA_COLUMNS, texts),
        "rejected": {**_rows(_reasons(results, texts), REJECTED_COLUMNS, texts), "note": note},
        "provenance": [
            [name, shortened(value, LONGEST_CELL)] for name, value in results.provenance
        ],
    }


def _reasons(results: Results, texts: Mapping[str, str]) -> pd.DataFrame:
    """Return the rejections with kinds and reasons in the language of the page."""
    if not {"kind", "reasons"} <= set(results.rejected):
        return results.rejected
    kinds = [texts.get(f"kind_{kind}", str(kind)) for kind in results.rejected["kind"]]
    reasons = [fixed_phrases(str(text), results.language) for text in results.rejected["reasons"]]
    return results.rejected.assign(kind=kinds, reasons=reasons)


def _described(stations: pd.DataFrame, language: str) -> pd.DataFrame:
    """Return stations with states in words, PGA in g, and reasons of rejection with warnings."""
    texts = LANGUAGES[language]
    if not {"state", "warnings", "rejected"} <= set(stations):
        return stations
    # Reasons and warnings are one column
    named = {name: texts[f"station_{name}"] for name in ("used", "rejected")}
    both = stations["rejected"].fillna("") + " " + stations["warnings"].fillna("")
    state = stations["state"].map(named).fillna("")
    sentences = [fixed_phrases(text, language) for text in both.str.strip()]
    in_g = {"pga": stations["pga"] / STANDARD_GRAVITY} if "pga" in stations else {}
    return stations.assign(state=state, warnings=sentences, **in_g)


def _station_places(stations: pd.DataFrame) -> list[list[Any]]:
    """Return name, place and PGA (g) of every station with a place, and whether it is used."""
    if not {"longitude", "latitude"} <= set(stations):
        return []
    placed = stations[stations["longitude"].notna() & stations["latitude"].notna()]
    # Of an ensemble there may be no peaks
    return [
        [
            shortened(str(row["station"]), 24),
            float(row["longitude"]),
            float(row["latitude"]),
            row["state"] == "used",
            _cell(row.get("pga", math.nan) / STANDARD_GRAVITY),
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


#: Parts of the script, in their order.
SCRIPTS = ("data.js", "map.js", "list.js", "details.js", "stations.js", "page.js")


def write_page(results: Results, path: Path) -> None:
    """
    Write the page, whole or not at all.

    Parameters
    ----------
    results : Results
        Everything that it shows.
    path : Path
        ``report.html``.
    """
    document = page_document(results)
    with written_whole(path) as part:
        part.write_text(document, encoding="utf-8", newline="\n")


def page_document(results: Results) -> str:
    """
    Return the page as HTML.

    Texts of data are only in the block of data, whose letters cannot be markup, and the script sets
    them as texts. The policy allows only the page's own script and style, by their hashes: no
    request leaves the browser.
    """
    content, tables = page_content(results)
    style, script = _asset("page.css"), "\n".join(_asset(name) for name in SCRIPTS)
    policy = (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; "
        "base-uri 'none'; form-action 'none'"
    )
    # Every part goes into its place once; none is searched for places
    parts = {
        "language": results.language,
        "policy": policy,
        "style": style,
        "script": script,
        "data": encoded(content, tables),
    }
    return re.sub(r"@(\w+)@", lambda found: parts[found[1]], _asset("page.html"))


def _asset(name: str) -> str:
    """Read a file of the page from the package."""
    return (files("per_obspy.report.page") / "assets" / name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    """Return the hash of a script or style for the content security policy."""
    return f"sha256-{b64encode(hashlib.sha256(text.encode()).digest()).decode()}"
