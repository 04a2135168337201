"""Layer of the inspections: one form per pair, for QGIS and QField."""

from collections.abc import Mapping
from xml.etree import ElementTree

import numpy as np
import pandas as pd

from per_obspy.report.layers.geopackage import Layer, points

#: Name of the layer, and the most pairs that get a form: more are added in the field.
INSPECTIONS, MOST = "inspections", 1000

#: Answers: whether contact was seen, and damage at the place of contact.
CONTACTS = ("yes", "no", "unsure")
DAMAGES = ("none", "local", "severe")

#: Fields that are no plain text -> how they are asked; half a centimetre is what a tape tells.
_WIDGETS: Mapping[str, tuple[str, dict[str, str]]] = {
    "gap": (
        "Range",
        {"Min": "0", "Max": "10", "Step": "0.005", "Precision": "3", "AllowNull": "true"},
    ),
    "photo": ("ExternalResource", {"DocumentViewer": "1", "RelativeStorage": "1"}),
    "inspected_at": ("DateTime", {"allow_null": "true", "calendar_popup": "true"}),
}

#: Field -> its question.
QUESTIONS = {
    "pair_id": "pair",
    "rank": "rank in the results",
    "contact": "contact seen",
    "damage": "damage at the contact",
    "gap": "gap measured (m)",
    "photo": "photo",
    "inspector": "inspector",
    "inspected_at": "time",
    "note": "note",
}


def inspection_layer(pairs: pd.DataFrame) -> Layer:
    """
    Return empty forms at the places of pairs.

    Parameters
    ----------
    pairs : DataFrame
        ``pair_id, rank, longitude, latitude`` of the worst pairs.
    """
    count = len(pairs)
    # Typed columns without a value: what is written later must fit
    text = pd.Series([None] * count, dtype=pd.StringDtype())
    table = pd.DataFrame(
        {
            "pair_id": pairs["pair_id"].to_numpy(),
            "rank": pairs["rank"].to_numpy(),
            "contact": text,
            "damage": text,
            "gap": np.full(count, np.nan),
            "photo": text,
            "inspector": text,
            "inspected_at": np.full(count, np.datetime64("NaT"), dtype="datetime64[ms]"),
            "note": text,
        }
    )
    return Layer(INSPECTIONS, table, points(pairs))


def add_form(root: ElementTree.Element) -> None:
    """Add to a style how each field is asked: choices, a number, a camera, a clock."""
    fields = ElementTree.SubElement(root, "fieldConfiguration")
    choices = {"contact": CONTACTS, "damage": DAMAGES}
    for name in QUESTIONS:
        if name in choices:
            _add_choices(fields, name, choices[name])
        else:
            _add_widget(fields, name, *_WIDGETS.get(name, ("TextEdit", {})))
    # What the run gave stays as it is
    editable = ElementTree.SubElement(root, "editable")
    for name in QUESTIONS:
        ElementTree.SubElement(editable, "field", name=name, editable=str(int(name != "rank")))


def _add_choices(fields: ElementTree.Element, name: str, words: tuple[str, ...]) -> None:
    """Add a list of which one word is chosen."""
    options = _add_widget(fields, name, "ValueMap", {})
    listed = ElementTree.SubElement(options, "Option", name="map", type="List")
    for word in words:
        one = ElementTree.SubElement(listed, "Option", type="Map")
        ElementTree.SubElement(one, "Option", name=word, value=word, type="QString")


def _add_widget(
    fields: ElementTree.Element, name: str, kind: str, options: Mapping[str, str]
) -> ElementTree.Element:
    """Add the widget of a field and return its options."""
    field = ElementTree.SubElement(fields, "field", name=name)
    widget = ElementTree.SubElement(field, "editWidget", type=kind)
    config = ElementTree.SubElement(widget, "config")
    options_map = ElementTree.SubElement(config, "Option", type="Map")
    for option, value in options.items():
        ElementTree.SubElement(options_map, "Option", name=option, value=value, type="QString")
    return options_map
