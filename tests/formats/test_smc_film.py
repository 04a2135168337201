"""Film in SMC files: the header counts pairs or numbers, and most files have a line more."""

import io

import numpy as np
import pytest
from format_samples import SAMPLES
from numpy.testing import assert_allclose

from per_obspy.errors import RecordRejected
from per_obspy.formats.smc import read_smc

#: 40 pairs of time, s, and value, cm/s2
TIMES = 0.005 * np.arange(40)
VALUES = np.round(50.0 * np.sin(TIMES * 31.0), 2)


def text_of(count: int, values=VALUES, more: str = "") -> str:
    """Return a film of the pairs whose header promises so many, of pairs or numbers."""
    sample = SAMPLES["smc"]
    head = sample.text[: sample.text.index("|comment")]
    head = head.replace("2 CORRECTED", "1 UNCORRECTED").replace(
        "  2.0000000E+02", "  1.7000000E+38"
    )
    head = head.replace(f"{len(sample.values[0]):10d}", f"{count:10d}", 1)
    # Exponents of one digit, as the format has them
    words = [
        f"{number:11.4E}" for number in np.column_stack((TIMES[: len(values)], values)).ravel()
    ]
    short = "".join(word[:9] + word[-1] for word in words)
    rows = [short[first : first + 80] for first in range(0, len(short), 80)]
    return "\n".join([head + "|comment", *rows]) + "\n" + more


@pytest.mark.parametrize("count", [40, 80])
@pytest.mark.parametrize("more", ["", " 3.5881E+1 1.4315E+0 3.5882E+1 1.5234E+0\n"])
def test_pairs_are_read_whether_the_header_counts_pairs_or_numbers(count: int, more: str):
    trace = read_smc(io.BytesIO(text_of(count, more=more).encode()))[0]
    # five digits of the file
    assert_allclose(trace.data, 0.01 * VALUES, atol=5e-5)
    assert_allclose(trace.stats.delta, 0.005, rtol=1e-6)
    steps = " ".join(trace.stats.processing)
    assert ("a line after the last pair is left out" in steps) == bool(more)


@pytest.mark.parametrize("count", [40, 80])
def test_two_lines_more_are_refused(count: int):
    more = " 3.5881E+1 1.4315E+0\n 3.5882E+1 1.5234E+0\n"
    with pytest.raises(RecordRejected, match="line"):
        read_smc(io.BytesIO(text_of(count, more=more).encode()))


@pytest.mark.parametrize("pairs", [20, 30, 36])
def test_a_cut_film_is_refused(pairs: int):
    # the header counts all numbers
    with pytest.raises(RecordRejected, match="the header promises"):
        read_smc(io.BytesIO(text_of(80, VALUES[:pairs]).encode()))
