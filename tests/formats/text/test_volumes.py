"""Titled blocks of samples, and digitised film on even steps."""

import io

import numpy as np
import pytest
from format_samples import SAMPLES
from numpy.testing import assert_allclose, assert_array_equal
from sample_file import MOTION, block, film

from per_obspy.errors import RecordRejected
from per_obspy.formats.smc import read_smc
from per_obspy.formats.text.lines import Text
from per_obspy.formats.text.volumes import even_film, is_title, read_film, titled_block


def text_of(content: str) -> Text:
    return Text("some.file", content.split("\n"))


def even(times: np.ndarray, values: np.ndarray):
    return even_film(text_of(""), 0, np.column_stack((times, values)), 5)


@pytest.mark.parametrize("spacing", ["equally spaced at .010 sec", "at 100 pts/sec"])
def test_a_title_announces_interval_or_rate(spacing: str):
    title = f" {len(MOTION)} points of accel data {spacing}, in cm/sec2. (8f10.6)"
    text = text_of(f"{title}\n{block(MOTION, '%10.6f', 8)}\nnext")
    assert is_title(title)
    values, dt, line = titled_block(text, 0, "ACCEL", 5, 7)
    assert_array_equal(values, MOTION)
    assert (dt, text.lines[line]) == (0.01, "next")


def test_even_film_gives_its_values_and_their_mean_interval():
    text = text_of(film(MOTION, 0.02))
    result = read_film(text, 0, len(MOTION))
    assert result.next_line == len(text.lines)
    # times and values are written to three decimals
    assert_allclose(result.values, np.round(MOTION, 3), rtol=1e-15)
    assert result.dt == pytest.approx(0.02, rel=1e-12)
    assert result.words["digitised"]
    assert len(result.words["notes"]) == 1


def test_film_that_wanders_is_interpolated_where_its_times_are():
    # 40 s of 100 samples a second whose times wander up to 65 ms off the mean line
    mean = 0.01 * np.arange(4000)
    times = np.round(mean + 0.065 * np.sin(np.pi * mean / mean[-1]), 4)
    result = even(times, np.sin(times))
    assert result.dt == 0.01
    # linear interpolation of sin(t) is at most h^2 / 8 off, h being the longest step of 10.6 ms
    assert_allclose(
        result.values, np.sin(0.01 * np.arange(len(result.values))), rtol=0, atol=1.5e-5
    )
    assert "up to 0.065 s off" in result.words["notes"][0]
    assert result.words["notes"][1] == "interpolated linearly onto steps of 0.01 s"


def test_turning_points_are_joined_by_straight_lines():
    # uneven times on a straight line: any place of it is known exactly
    times = np.array([0.0, 0.03, 0.07, 0.08, 0.2, 0.21, 0.3])
    result = even(times, 2 * times)
    # the mean interval is 0.05 s, the longest step that is offered is 0.02 s
    assert result.dt == 0.02
    assert_allclose(result.values, 0.04 * np.arange(16), rtol=0, atol=1e-15)


@pytest.mark.parametrize("wrong", [0.0, -0.5, 0.08])
def test_a_time_that_runs_back_is_left_out_and_noted(wrong: float):
    times = 0.02 * np.arange(50)
    clean = np.delete(times, 5)
    values = np.sin(times)
    times[5] = wrong
    result = even(times, values)
    expected = even(clean, np.delete(values, 5))
    assert_array_equal(result.values, expected.values)
    assert "1 times of the film run back and are left out" in result.words["notes"]


def test_film_most_of_whose_times_run_back_is_refused():
    text = text_of(film(MOTION, 0.02).replace("  0.100", "  1.000"))
    message = "line 2, time 7: 0.12 s follows 1 s, as 17 times do"
    with pytest.raises(RecordRejected, match=message):
        read_film(text, 0, len(MOTION))


def test_a_hole_in_the_film_is_refused():
    times = 0.01 * np.arange(400)
    times[200:] += 3.0
    message = "line 41, time 201: 5 s follows 1.99 s, the mean interval is"
    with pytest.raises(RecordRejected, match=message):
        even(times, np.sin(times))


#: 40 pairs of time, s, and value, cm/s2
TIMES = 0.005 * np.arange(40)
VALUES = np.round(50.0 * np.sin(TIMES * 31.0), 2)


def smc_film(count: int, values=VALUES, more: str = "") -> str:
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
    trace = read_smc(io.BytesIO(smc_film(count, more=more).encode()))[0]
    assert (trace.stats.processing_level, trace.stats.digitised) == ("raw", True)
    # five digits of the file
    assert_allclose(trace.data, 0.01 * VALUES, atol=5e-5)
    assert_allclose(trace.stats.delta, 0.005, rtol=1e-6)
    steps = " ".join(trace.stats.processing)
    assert ("a line after the last pair is left out" in steps) == bool(more)


@pytest.mark.parametrize("count", [40, 80])
def test_two_lines_more_are_refused(count: int):
    more = " 3.5881E+1 1.4315E+0\n 3.5882E+1 1.5234E+0\n"
    with pytest.raises(RecordRejected, match="line"):
        read_smc(io.BytesIO(smc_film(count, more=more).encode()))


@pytest.mark.parametrize("pairs", [20, 30, 36])
def test_a_cut_film_is_refused(pairs: int):
    # the header counts all numbers
    with pytest.raises(RecordRejected, match="the header promises"):
        read_smc(io.BytesIO(smc_film(80, VALUES[:pairs]).encode()))
