"""Origin time and Vs30 in the text of COSMOS headers."""

import io

import numpy as np
import pytest
from format_samples import SAMPLES

from per_obspy.formats.cosmos import read_cosmos

TEXT = SAMPLES["cosmos_v2c"].text


def words(old: str, new: str):
    assert old in TEXT
    return read_cosmos(io.BytesIO(TEXT.replace(old, new).encode("latin-1")))[0].stats


def line(number: int) -> str:
    return TEXT.splitlines()[number]


@pytest.mark.parametrize(
    ("origin", "time"),
    [
        ("Origin: 06/16/2005, 20:53:26.1 UTC (SCSN)", "2005-06-16T20:53:26.1"),
        ("Origin: 2014/08/24 10:20:44 UTC (NCSN)", "2014-08-24T10:20:44.0"),
        ("Origin: 2018/11/30 17:29:29    UTC", "2018-11-30T17:29:29.0"),
        # local time is not converted, but unknown
        ("Origin: 06/16/2005, 13:53:26.1 PDT", None),
        ("Origin: To be determined", None),
    ],
)
def test_the_origin_time(origin: str, time: str | None):
    event = words(line(3), origin).event
    assert str(event.get("time"))[:21] == (time or "None")


@pytest.mark.parametrize(
    ("text", "vs30"),
    [
        ("Site Geology: alluvium; Vs30 = 270 m/s", 270.0),
        ("Site Geology: rock, vs30: 760.5 m/sec (inferred)", 760.5),
        ("Site Geology: Vs30 unknown", None),
        # without its unit a number means nothing
        ("Site Geology: Vs30 270", None),
        ("Site Geology: Vs30 = 9 m/s", None),
    ],
)
def test_vs30_in_words(text: str, vs30: float | None):
    assert words(line(5), f"Coords: 60.9677 -144.6051  {text}").get("vs30") == vs30


@pytest.mark.parametrize(
    ("announced", "factor"),
    # the sample has 0.01 m/s2 a unit; standard gravity by definition
    [
        ("units=g.     (02)Format=(8f9.6)", 980.665),
        ("units=G (02),Format=(8F9.6)", 980.665),
        ("units=gal.(05), Format=(8F9.6)", 1.0),
        ("units=cm/sec/sec (04),Format=(8F9.6)", 1.0),
        ("units=m/s^2 (04),Format=(8F9.6)", 100.0),
        ("units=mg (04),Format=(8F9.6)", 0.980665),
    ],
)
def test_units_and_formats_as_agencies_write_them(announced: str, factor: float):
    title = next(line for line in TEXT.splitlines() if "units=" in line)
    layout = title[title.index("units=") :]
    width = layout[layout.index("(", layout.index("ormat")) :]
    changed = title.replace(layout, announced.replace("(8f9.6)", width.lower()))
    changed = changed.replace("(8F9.6)", width)
    one, other = (
        read_cosmos(io.BytesIO(text.encode("latin-1")))[0]
        for text in (TEXT, TEXT.replace(title, changed))
    )
    # one product more is rounded
    np.testing.assert_allclose(other.data, factor * one.data, rtol=1e-15)
    assert (other.stats.units, other.stats.quantity) == ("m/s2", "acceleration")
