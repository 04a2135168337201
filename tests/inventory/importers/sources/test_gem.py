"""Strings of the GEM Building Taxonomy, versions 2.0 and 3.x."""

import math

import numpy as np
import pytest

from per_obspy.inventory.importers.sources.gem import LONGEST, parsed


@pytest.mark.parametrize(
    ("text", "storeys", "system", "adjoining"),
    [
        # full form of 2.0, with both directions, and its short form
        ("DX/CR+CIP/LFM+DUC/DY/CR+CIP/LFM+DUC/HEX:4+HBEX:1/YEX:1990/RES+RES2/BP2/PLFR/IRRE/EW99/"
         "RSH3/F99/FOS99", 4.0, "concrete_mrf", 2),
        ("CR/LWAL/HAPP:7/BPD", 7.0, "concrete_wall", 0),
        ("S/LFM/HEX:12/BP3", 12.0, "steel_mrf", 3),
        ("CR/LDUAL/H:9", 9.0, "concrete_frame_wall", None),
        ("MUR+CLBRS/LWAL/H:2", 2.0, "other", None),
        ("CR/LFINF+DNO/HEX:3", 3.0, "other", None),
        # unknown storeys, storeys below ground and height of the ground floor are none
        ("MUR/LWAL/H99/BP99", math.nan, "other", None),
        ("MUR/LWAL/HBEX:2/HFEX:0.5", math.nan, "other", None),
        ("MATO/L99", math.nan, "", None),
        ("", math.nan, "", None),
    ],
)  # fmt: skip
def test_what_a_string_says(text, storeys, system, adjoining):
    found = parsed(text)
    assert (found.system, found.adjoining) == (system, adjoining)
    assert found.storeys == pytest.approx(storeys, nan_ok=True)


@pytest.mark.parametrize("text", ["CR/LFM/HBET:6,3", "CR/LFM/HBET:3,6", "CR/LFM/HBET:3-6", "H:3-6"])
def test_a_range_is_even_between_the_logarithms_of_its_ends(text):
    found = parsed(text)
    # median and deviation of a uniform distribution, sampled
    sampled = np.linspace(np.log(3.0), np.log(6.0), 100_001)
    assert found.storeys == pytest.approx(np.exp(np.median(sampled)))
    assert found.log_std == pytest.approx(np.std(sampled), rel=1e-4)


def test_exact_storeys_have_no_deviation():
    assert math.isnan(parsed("CR/LFM/HEX:4").log_std)
    assert parsed("CR/LFM/HAPP:4").log_std > 0.0


@pytest.mark.parametrize(
    "text", [None, 3.5, "/" * 10**6, "+" * 10**6, "H:" * 10**5, "H:9999", "HBET:0-3"]
)
def test_hostile_strings_are_unknown(text):
    found = parsed(text)
    assert math.isnan(found.storeys)
    assert found.adjoining is None
    assert LONGEST < 1000
