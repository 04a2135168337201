"""
Forms of the field: the layer ``inspections`` of ``risk.gpkg`` as QGIS or QField saved it.

Two teams may have seen one pair. Where they disagree, the pair stays without an observation, and
both answers are named.
"""

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from per_obspy.errors import CatalogError, Rejection, shortened
from per_obspy.inventory.footprints.layer_files import read_raw_layer
from per_obspy.inventory.schema import COLUMNS
from per_obspy.report.layers.inspections import CONTACTS, DAMAGES, INSPECTIONS

#: Layers in which forms are saved.
_SUFFIXES = (".gpkg", ".geojson", ".fgb")

#: Fields without which a layer is no form.
_NEEDED = ("pair_id", "contact", "gap")

#: Measured gaps of one pair that differ by more are a conflict, m (reasoned).
SAME_GAP = 0.02


class Form(NamedTuple):
    """One form that has an answer."""

    number: int  # of the feature in its layer
    pair_id: str
    contact: str  # one of CONTACTS, or empty
    damage: str  # one of DAMAGES, or empty
    gap: float  # m, NaN if it was not measured
    by: str  # who and when


class Answers(NamedTuple):
    """All forms of a layer."""

    forms: list[Form]
    rejected: list[Rejection]
    empty: int


def read_forms(file: Path) -> Answers:
    """
    Read and check the forms of a layer.

    Raises
    ------
    CatalogError
        If the file cannot be read, or its layer lacks a field of the form.
    """
    numbers, table = _rows(file)
    answers = Answers([], [], len(table))
    for number, row in zip(numbers, table.to_dict("records"), strict=True):
        form = _form(number, row)
        # A form that nobody opened has a pair, and no answer
        if not (form.contact or form.damage or _text(row["gap"])):
            continue
        answers = answers._replace(empty=answers.empty - 1)
        if problems := _problems(form, row["gap"]):
            rejection = Rejection("inspection", form.pair_id, str(file), number, tuple(problems))
            answers.rejected.append(rejection)
        else:
            answers.forms.append(form)
    return answers


def _rows(file: Path) -> tuple[list[int], pd.DataFrame]:
    """Return the numbers and the fields of the features of a layer of forms."""
    # Other suffixes are of outlines
    if file.suffix.lower() not in _SUFFIXES:
        reason = f"unknown suffix {file.suffix!r}, expected one of {', '.join(_SUFFIXES)}"
        raise CatalogError(str(file), reason)
    raw = read_raw_layer(file, INSPECTIONS if file.suffix.lower() == ".gpkg" else None)
    table = raw.attributes.to_pandas()
    # Other layers have pairs too
    for name in _NEEDED:
        if name not in table:
            reason = f"{name}: no such field, expected the form of {INSPECTIONS}"
            raise CatalogError(str(file), reason)
    return raw.numbers.tolist(), table


def _form(number: int, row: dict[Any, Any]) -> Form:
    """Return the answers of a row as they are."""
    texts = {name: _text(row.get(name)) for name in ("pair_id", "contact", "damage")}
    # Who and when name the sides of a conflict
    by = " ".join(filter(None, (_text(row.get(name)) for name in ("inspector", "inspected_at"))))
    try:
        gap = float(_text(row["gap"]) or "nan")
    except ValueError:
        gap = np.nan
    contact, damage = texts["contact"].lower(), texts["damage"].lower()
    return Form(number, texts["pair_id"], contact, damage, gap, by)


def _problems(form: Form, gap: object) -> list[str]:
    """Return what is wrong with the answers of a form whose gap was given like this."""
    problems = [] if form.pair_id else ["pair_id: none"]
    for field, answer, words in (
        ("contact", form.contact, CONTACTS),
        ("damage", form.damage, DAMAGES),
    ):
        if answer and answer not in words:
            expected = ", ".join(words)
            problems.append(f"{field}: {shortened(answer, 80)!r}, expected one of {expected}")
    # The range of the pair table; a text that is no number is NaN
    low, high = COLUMNS["gap"].low, COLUMNS["gap"].high
    if _text(gap) and not low <= form.gap <= high:
        value = shortened(_text(gap), 80)
        problems.append(f"gap: {value}, expected {low:g} to {high:g} m")
    return problems


def _text(value: object) -> str:
    """Return an answer as text, empty where there is none."""
    text = "" if value is None else str(value).strip()
    return "" if text in ("nan", "NaT", "<NA>") else text


def agreed(forms: Sequence[Form], file: Path) -> tuple[pd.DataFrame, list[Rejection]]:
    """
    Return one row per pair, and the pairs whose forms disagree.

    Returns
    -------
    pairs : DataFrame
        ``pair_id, observed`` (1 contact, 0 none, NaN unsure or not said), ``gap`` (m, mean),
        ``damage`` (the worst), ``inspections`` (their number).
    conflicts : list of Rejection
        One for each pair with every answer.
    """
    rows, conflicts = [], []
    # In the order of names, so that files do not depend on the order of the forms
    by_pair = sorted(forms, key=lambda form: form.pair_id)
    for name, group in groupby(by_pair, key=lambda form: form.pair_id):
        seen = list(group)
        if reasons := _disagreements(seen):
            conflicts.append(Rejection("inspection", name, str(file), None, tuple(reasons)))
        else:
            rows.append(_row(name, seen))
    columns = ["pair_id", "observed", "gap", "damage", "inspections"]
    return pd.DataFrame(rows, columns=columns), conflicts


def _disagreements(forms: Sequence[Form]) -> list[str]:
    """Return what the forms of a pair say against each other."""
    reasons = []
    if {"yes", "no"} <= {form.contact for form in forms}:
        said = ", ".join(f"{form.contact} ({form.by or 'unnamed'})" for form in forms)
        reasons.append(f"contact: {said}")
    # Two measurements may differ by what a hand does
    gaps = [form.gap for form in forms if np.isfinite(form.gap)]
    if gaps and max(gaps) - min(gaps) > SAME_GAP:
        reasons.append(f"gap: {min(gaps):g} to {max(gaps):g} m")
    return [*reasons, "forms disagree: left out until one is corrected"] if reasons else []


def _row(name: str, forms: Sequence[Form]) -> tuple[str, float, float, str, int]:
    """Return what the forms of a pair say together."""
    contacts = {form.contact for form in forms}
    observed = 1.0 if "yes" in contacts else 0.0 if "no" in contacts else np.nan
    # The worst damage stands for the pair
    gaps = [form.gap for form in forms if np.isfinite(form.gap)]
    damages = {form.damage for form in forms}
    worst = next((word for word in reversed(DAMAGES) if word in damages), "")
    return name, observed, float(np.mean(gaps)) if gaps else np.nan, worst, len(forms)
