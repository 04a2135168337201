"""A made-up page: pairs in a grid of streets, with hostile names where asked for."""

from dataclasses import replace

import numpy as np
import pandas as pd

from per_obspy.report.results import Drawings, Region, Results, Revision
from per_obspy.report.tally import PAGE_PAIRS, PairTally
from per_obspy.results.coverage import Coverage

CLASSES = ("severe", "high", "moderate", "low")
STATES = ("yes", "likely", "possible", "no")

#: Names that would be markup, a formula, a change of direction, or endless.
HOSTILE = [
    "<script>document.title='taken'</script>",
    "</script><img src=x onerror=\"document.title='taken'\">",
    '=HYPERLINK("http://example.org","x")',
    "\u202egnp.exe",
    "9" * 10_000,
    "<!--<script>",
    "a,b\"c'd",
]


def pair_table(count, names=()):
    """Return a risk table, worst first; every sixth pair is of the area ``harbour``."""
    random = np.random.default_rng(3)
    speed = np.sort(random.gamma(1.5, 0.2, count))[::-1]
    gap, number = random.uniform(0.0, 0.1, count), np.arange(count)
    longitude, latitude = 13.0 + random.uniform(0, 0.2, count), 43.0 + random.uniform(0, 0.2, count)
    quarter = np.minimum(4 * number // count, 3)
    table = pd.DataFrame(
        {
            "rank": number + 1,
            "pair_id": [f"P{i:07}" for i in number],
            "state": np.array(STATES, dtype=object)[quarter],
            "risk_class": np.array(CLASSES, dtype=object)[quarter],
            "probability": np.linspace(1.0, 0.0, count),
            "expected_impact_velocity": speed,
            "impact_velocity_84": 1.4 * speed,
            "expected_amplification": 1.0 + speed,
            "gap": gap,
            "demand": gap + 0.2 * speed,
            "demand_rule": "exact",
            "missing_gap": 0.2 * speed,
            "impacts": 3.0,
            "impact_velocity_exact": speed,
            "flags": np.where(number % 2, "far_station derived_inputs", "touching"),
            "derived": "period_1 period_2",
            "area": np.where(number % 6, "centre", "harbour"),
            "station": "XX.A1",
            "distance": 2500.0,
            "longitude": longitude,
            "latitude": latitude,
            "longitude_1": longitude - 1e-4,
            "latitude_1": latitude,
            "longitude_2": longitude + 1e-4,
            "latitude_2": latitude,
            "supplemental_damping": np.nan,
            "bumper_restitution": 0.4,
        }
    )
    for side in (1, 2):
        table[f"building_id_{side}"] = [f"B{2 * i + side}" for i in number]
        for name, value in (("per", 0.1), ("participation", 1.3), ("period", 0.5)):
            table[f"{name}_{side}"] = value * side
    for row, name in enumerate(names):
        table.loc[row, ["pair_id", "building_id_1", "station", "area"]] = name
    return table


def page_data(table, language="en", **changes):
    """Return a page of these pairs with two stations, two areas and a rejection."""
    tally = PairTally(CLASSES)
    tally.add(table)
    stations = pd.DataFrame(
        {
            "station": ["XX.A1", "XX.B2"],
            "state": ["used", "rejected"],
            "pairs": [len(table), 0],
            "pga": [2.5, np.nan],
            "longitude": [13.1, 13.05],
            "latitude": [43.1, 43.15],
            "warnings": ["", ""],
            "rejected": ["", "clipped: 9 equal samples at an extreme"],
        }
    )
    areas = pd.DataFrame(
        {
            "area": ["centre", "harbour"],
            "pairs": [10, 2],
            "expected_pounding": [5.0, 1.0],
            "longitude": 13.1,
            "latitude": 43.1,
        }
    )
    rejected = pd.DataFrame([["pair", "P9", "pairs.csv", "7", "gap: -1"]])
    rejected.columns = ["kind", "name", "source", "row", "reasons"]
    history = {"time": [0.0, 1.0], "one": [-5.0, 5.0], "two": [-9.0, 9.0], "impacts": [[0.4, 0.7]]}
    results = Results(
        "risk",
        Region("A made-up quarter", CLASSES, True, pd.DataFrame(), (13.0, 43.0)),
        Coverage(len(table), len(table)),
        language,
        Revision(0, "2026-01-02 04:12", ""),
        ["First record 2026-01-02 03:04.", "Magnitude 6.4."],
        tally=tally,
        worst=table.head(PAGE_PAIRS),
        stations=stations,
        areas=areas,
        rejected=rejected,
        rejections=1,
        lines={"coast": [[12.9, 43.0, 13.3, 43.3]], "borders": []},
        drawings=Drawings(histories={1: history}),
        provenance=[("made with", "per_obspy")],
        class_limits={"severe": 0.5, "high": 0.2, "moderate": 0.05, "low": 0.0},
    )
    return replace(results, **changes)


def with_region(results, **changes):
    """Return results of another title or with other classes."""
    return replace(results, region=results.region._replace(**changes))
