"""The page of a record: motion, its integrals, noise, corners and every number."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from obspy import Trace, UTCDateTime
from obspy.core import AttribDict
from scipy.integrate import cumulative_trapezoid

from per_obspy.report.records import AXIS_LIMIT, LISTED, draw_records, record_page

DT, PAD = 0.01, 200
NUMBERS = {
    "pad_before": PAD * DT,
    "pad_after": 1.0,
    "noise": 3.0,
    "onset": 3.5,
    "onset_source": "automatic",
    "highpass": 0.1,
    "lowpass": 30.0,
    "shortest_period": 0.04,
    "longest_period": 8.0,
    "notes": "a long note " * 12,
}


@pytest.fixture
def unfiltered():
    """Return 20 s of a burst on an offset."""
    motion = np.random.default_rng(6).normal(size=2000) * np.hanning(2000)
    return _trace(motion + 0.02)


@pytest.fixture
def processed(unfiltered):
    """Return the record without its offset, with pads of zeros."""
    padded = np.concatenate([np.zeros(PAD), unfiltered.data - 0.02, np.zeros(100)])
    return _trace(padded, per_obspy=AttribDict(NUMBERS))


def _trace(samples, **stats):
    header = {"network": "XX", "station": "ONE", "channel": "HNN", "delta": DT}
    return Trace(samples, header | {"starttime": UTCDateTime(2020, 1, 1)} | stats)


def _panels(figure):
    """Return the three panels of motion, the amplitudes, and the axes of the numbers."""
    left, right = figure.subfigs
    return left.axes, *right.axes


def test_panels_are_the_record_and_its_integrals_without_pads(processed, unfiltered):
    # would catch an integral that starts after the pads, where the velocity is not zero
    panels, *_ = _panels(record_page(processed, unfiltered))
    motion = processed.data
    for axes, name in zip(
        panels, ("acceleration (m/s²)", "velocity (m/s)", "displacement (m)"), strict=True
    ):
        raw, line = axes.lines
        assert_array_equal(line.get_ydata(), motion[PAD:-100])
        assert_allclose(line.get_xdata(), np.arange(2000) * DT)
        assert axes.get_ylabel() == name
        # the drift of the raw integrals is cut
        peak = np.abs(line.get_ydata()).max()
        assert_allclose(axes.get_ylim(), (-AXIS_LIMIT * peak, AXIS_LIMIT * peak))
        assert axes.get_title().startswith(f"peak {peak:.3g} m")
        motion = cumulative_trapezoid(motion, dx=DT, initial=0)
    assert_array_equal(panels[0].lines[0].get_ydata(), unfiltered.data)
    assert np.abs(raw.get_ydata()).max() > peak


def test_the_noise_window_is_shaded(processed, unfiltered):
    panels, *_ = _panels(record_page(processed, unfiltered))
    for axes in panels:
        (shade,) = axes.patches
        assert (shade.get_x(), shade.get_width()) == (0.0, 3.0)


def test_amplitudes_have_noise_corners_and_usable_band(processed, unfiltered):
    _, amplitudes, _ = _panels(record_page(processed, unfiltered))
    labels = [text.get_text() for text in amplitudes.get_legend().get_texts()]
    assert labels == [
        "signal before the filter",
        "noise",
        "highpass 0.1 Hz",
        "lowpass 30 Hz",
        "usable",
    ]
    (band,) = amplitudes.patches
    assert_allclose([band.get_x(), band.get_x() + band.get_width()], [1 / 8.0, 1 / 0.04])
    # from one period in 20 s to the Nyquist frequency
    assert_allclose(amplitudes.get_xlim(), (0.05, 50.0))
    assert amplitudes.get_ylabel() == "Fourier amplitude (m/s)"


def test_the_fourier_amplitude_of_a_sine_is_half_its_length(processed):
    # amplitude times half the duration at its own frequency: catches a missing dt
    sine = np.sin(2 * np.pi * 5.0 * np.arange(2000) * DT)
    processed.data[PAD:-100] = sine
    _, amplitudes, _ = _panels(record_page(processed, None))
    frequency, amplitude = amplitudes.lines[0].get_xydata().T
    assert frequency[amplitude.argmax()] == pytest.approx(5.0)
    assert amplitude.max() == pytest.approx(10.0)


def test_without_the_record_before_there_is_neither_grey_line_nor_noise(processed):
    panels, amplitudes, _ = _panels(record_page(processed, None))
    assert [len(axes.lines) for axes in panels] == [1, 1, 1]
    labels = [text.get_text() for text in amplitudes.get_legend().get_texts()]
    assert labels == ["highpass 0.1 Hz", "lowpass 30 Hz", "usable"]


def test_every_number_is_listed_with_its_unit(processed, unfiltered):
    *_, numbers = _panels(record_page(processed, unfiltered))
    lines = numbers.texts[0].get_text().splitlines()
    assert "noise: 3 s" in lines
    assert "highpass: 0.1 Hz" in lines
    assert "onset source: automatic" in lines
    # long texts go on in the next line, and what the record lacks is left out
    assert max(map(len, lines)) <= 68
    assert lines[-1].startswith("    ")
    assert not any(line.startswith("lowpass source") for line in lines)
    assert set(NUMBERS) - {"pad_before", "pad_after"} <= set(LISTED)


def test_the_title_has_the_time_of_the_first_sample_after_the_pads(processed, unfiltered):
    title = record_page(processed, unfiltered).get_suptitle()
    assert title == "XX.ONE..HNN   2020-01-01 00:00:02 UTC"


def test_a_book_has_one_page_per_record(processed, unfiltered, tmp_path):
    path = tmp_path / "records.pdf"
    draw_records([(processed, unfiltered), (processed, None)], path)
    content = path.read_bytes()
    assert content.startswith(b"%PDF")
    assert content.count(b"/Type /Page ") == 2


def test_a_book_that_cannot_be_finished_leaves_the_old_one(processed, tmp_path):
    # would catch a file that is written in place
    path = tmp_path / "records.pdf"
    path.write_bytes(b"old")

    def broken():
        yield processed, None
        raise RuntimeError("power cut")

    with pytest.raises(RuntimeError, match="power cut"):
        draw_records(broken(), path)
    assert path.read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == ["records.pdf"]
