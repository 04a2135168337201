import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from obspy import Trace, UTCDateTime
from scipy.signal import butter, sosfreqz

from per_obspy.processing.filter.butterworth import (
    acausal_bandpass,
    bandpass,
    butterworth_amplitude,
    pad,
    taper,
)

RATE = 100.0


def component(samples):
    return Trace(np.asarray(samples, dtype=float), {"sampling_rate": RATE, "channel": "HNE"})


def test_the_taper_is_half_a_hann_window_at_each_end_only():
    out = taper(component(np.ones(2001)), 0.1).data
    assert_array_equal(out[201:1800], 1.0)
    rise = 0.5 - 0.5 * np.cos(np.pi * np.arange(201) / 200)
    assert_allclose(out[:201], rise, atol=0.01)  # one sample either way
    assert_allclose(out, out[::-1], atol=1e-12)


def test_the_pads_have_the_length_that_boore_gives_and_keep_the_times():
    given = component(np.ones(1000))
    out = pad(given, highpass=0.1, order=4)
    before = out.stats.per_obspy.pad_before
    assert before == 0.75 * 4 / 0.1
    assert before <= out.stats.per_obspy.pad_after < 1.2 * before  # up to the next quick length
    assert out.stats.starttime == UTCDateTime(0) - before
    assert_array_equal(out.data[3000:4000], 1.0)
    assert out.data.sum() == 1000


@pytest.mark.parametrize(("kind", "corner"), [("highpass", 0.1), ("lowpass", 1.0)])
def test_the_amplitude_is_that_of_an_analogue_butterworth(kind, corner):
    # SciPy's digital filter meets the analogue one far below Nyquist, where the bilinear map bends
    # by (pi f/fs)^2/3; the other corner is ten times away and worth 1e-10
    frequencies = np.geomspace(0.02, 2.0, 50)
    skirt = frequencies < corner if kind == "highpass" else frequencies > corner
    sections = butter(5, corner, kind, fs=1000.0, output="sos")
    _, expected = sosfreqz(sections, frequencies[skirt], fs=1000.0)
    found = butterworth_amplitude(frequencies[skirt], 0.1, 1.0, 5)
    assert_allclose(found, np.abs(expected), rtol=1e-4)


@pytest.mark.parametrize("frequency", [0.1, 0.5, 2.0, 20.0])
def test_a_sine_is_scaled_and_not_delayed(frequency):
    # mutation: filtering forwards and backwards squares the amplitude: 0.5 instead of 0.7071 at a
    # corner
    time = np.arange(20_000) / RATE  # whole periods, so that the circular filter sees a pure sine
    sine = np.sin(2 * np.pi * frequency * time)
    out = acausal_bandpass(sine, RATE, highpass=0.1, lowpass=20.0, order=5)
    expected = 1 / np.sqrt((1 + (0.1 / frequency) ** 10) * (1 + (frequency / 20.0) ** 10))
    assert_allclose(out, expected * sine, atol=1e-10)  # rounding of 20 000 samples of size 1


def test_velocity_and_displacement_come_to_rest_in_the_pads():
    # mutation: cutting the pads away before integration leaves the velocity moving
    rng = np.random.default_rng(1)
    record = rng.normal(size=4000) * np.hanning(4000)
    out = bandpass(pad(component(record), 0.2, 5), 0.2, 25.0, 5).data
    velocity = np.cumsum(out) / RATE
    displacement = np.cumsum(velocity) / RATE
    # the pads end 19 s after the record; the filter's own decay over 0.75 n periods is about 1e-3
    assert abs(velocity[-1]) < 1e-3 * np.abs(velocity).max()
    assert abs(displacement[-1]) < 5e-3 * np.abs(displacement).max()


def test_a_corner_must_be_positive():
    with pytest.raises(ValueError, match="highpass must be positive, got 0"):
        pad(component(np.ones(10)), 0.0, 5)
