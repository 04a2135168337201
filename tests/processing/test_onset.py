import numpy as np
import pytest
from obspy import Trace

from per_obspy.processing.noise_window import (
    aic_onset,
    baer_onset,
    energy_ratio_onset,
    picked_onset,
)

RATE = 100.0


def noisy(samples, noise=0.003, seed=8):
    return Trace(
        samples + noise * np.random.default_rng(seed).normal(size=samples.size),
        {"sampling_rate": RATE},
    )


@pytest.mark.parametrize("seed", range(5))
def test_the_first_wave_is_found(earthquake, seed):
    onset, spread = picked_onset(noisy(earthquake(seed)))
    # the envelope rises as a square root: it clears the noise (1/1000 of the peak) within a few
    # tenths of a second
    assert onset == pytest.approx(20.0, abs=0.3)
    assert spread >= 0


def test_a_weak_first_wave_is_not_mistaken_for_the_strong_second(earthquake):
    # mutation: picking the largest jump in amplitude finds S
    waves = 0.05 * earthquake(1, onset=20.0) + earthquake(2, onset=32.0)
    assert picked_onset(noisy(waves, 1e-4))[0] == pytest.approx(20.0, abs=0.5)


def test_offset_and_size_do_not_matter(earthquake):
    trace = noisy(earthquake())
    expected = picked_onset(trace)
    trace.data = -1e6 * trace.data + 1e5
    assert picked_onset(trace)[0] == pytest.approx(expected[0], abs=0.02)


@pytest.mark.parametrize("seed", range(3))
def test_noise_has_no_onset(seed):
    assert picked_onset(noisy(np.zeros(6000), 1.0, seed)) is None


@pytest.mark.parametrize("count", [20, 600])
def test_a_silent_record_has_no_onset(count):
    assert picked_onset(Trace(np.zeros(count), {"sampling_rate": RATE})) is None


def test_an_onset_shortly_before_the_peak_is_found():
    samples = np.random.default_rng(6).normal(size=4000) * np.repeat([0.01, 1.0], [3900, 100])
    assert aic_onset(samples) == pytest.approx(3900, abs=5)


def test_each_picker_finds_a_step_of_noise():
    samples = np.random.default_rng(5).normal(size=4000) * np.repeat([0.01, 1.0], 2000)
    assert aic_onset(samples) == pytest.approx(2000, abs=5)
    assert energy_ratio_onset(samples, 100) == pytest.approx(2000, abs=5)
    assert baer_onset(samples, 0.01) == pytest.approx(
        2000, abs=30
    )  # it waits for 0.2 s of certainty
    assert energy_ratio_onset(samples[:150], 100) is None
