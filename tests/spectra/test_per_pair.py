"""Many oscillators, each with its own azimuth: matrix exponentials and the spectra's kernel."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.spectra import elastic
from per_obspy.spectra.elastic import azimuth_maxima, response_spectra

DT = 0.01


def one_component(record, dt, periods, dampings):
    """Return the maxima under a single component, as motion to the north alone."""
    return azimuth_maxima(record, np.zeros(len(record)), dt, periods, dampings, 0.0)


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.3, 0.99])
@pytest.mark.parametrize("ratio", [0.3, 5.0, 20.0, 70.0, 5000.0])
def test_agrees_with_matrix_exponentials(noise, reference, ratio, damping):
    # mutations: a sample's weight in a stride, a stationary point, the closing ramp or the free
    # vibration left out
    ours = one_component(noise, DT, [ratio * DT], damping)
    # 1e-9 is what the package promises; Brent's method leaves 1e-10 of the reference
    assert_allclose(
        [ours.per[0], ours.sd[0]], reference(noise, DT, ratio * DT, damping)[:2], rtol=1e-9
    )


def padded(seed, before, strong, after):
    """Return pulses of smoothed noise between long quiet pads, as acausal filters leave them."""
    rng = np.random.default_rng(seed)
    components = rng.normal(size=(2, before + strong + after))
    # Nine to three powers of ten below the pulse, but not zero
    quiet = 10.0 ** rng.uniform(-9, -3)
    shape = np.full(before + strong + after, quiet)
    shape[before : before + strong] = np.sin(np.linspace(0.0, np.pi, strong)) ** 2 + quiet
    return [np.convolve(component, np.ones(5) / 5, "same") * shape for component in components]


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    counts=st.tuples(st.integers(0, 6000), st.integers(5, 900), st.integers(0, 6000)),
    ratio=st.floats(0.3, 3000.0),
    damping=st.floats(0.0, 0.99),
    azimuth=st.floats(-400.0, 400.0),
)
def test_what_is_left_out_does_not_matter(seed, counts, ratio, damping, azimuth):
    # mutations: a window that starts or ends too early, a bound without the damping's factor, a
    # floor that is not reached and accepted nevertheless, a slack of one step where two or four are
    # skipped, a tile outside the window
    north, east = padded(seed, *counts)
    period, angle = ratio * DT, np.radians(azimuth)
    ours = azimuth_maxima(north, east, DT, period, damping, azimuth)
    along = response_spectra(north * np.cos(angle) + east * np.sin(angle), DT, period, damping)
    # what is forgotten is 1e-12; both kernels round differently along thousands of steps
    assert_allclose([ours.per[0], ours.sd[0]], [along.per[0], along.sd[0]], rtol=2e-11)


@pytest.mark.parametrize("before", [9000, 9064])
def test_many_oscillators_have_the_spectra_of_one_component(before):
    # mutation: a slack of one step in the choice of tiles where four are skipped; rare enough to
    # need many oscillators
    north = padded(before, before, 200, 9000)[0]
    periods = DT * np.geomspace(2.0, 300.0, 2000)
    for damping in (0.01, 0.2):
        ours, spectra = (
            one_component(north, DT, periods, damping),
            response_spectra(north, DT, periods, damping),
        )
        assert_allclose([ours.per, ours.sd], [spectra.per, spectra.sd], rtol=2e-11)


def many_oscillators(count, seed):
    """Return a long record and oscillators of every stride, some slow enough to be run again."""
    rng = np.random.default_rng(seed)
    periods = DT * np.exp(rng.uniform(np.log(0.5), np.log(3000.0), count))
    return (
        *padded(7, 3000, 700, 3000),
        DT,
        periods,
        rng.choice([0.0, 0.02, 0.05, 0.4], count),
        rng.uniform(0, 360, count),
    )


def test_other_oscillators_and_threads_change_no_bit(monkeypatch):
    # mutations: largest values of a block's stretch instead of an oscillator's window, lanes mixed
    # up
    north, east, dt, *oscillators = many_oscillators(150, 1)
    together = azimuth_maxima(north, east, dt, *oscillators)
    for part in (slice(0, 1), slice(3, 40), slice(149, None, -1)):
        chosen = [values[part] for values in oscillators]
        for alone, among in zip(azimuth_maxima(north, east, dt, *chosen), together, strict=True):
            assert_array_equal(alone, among[part])
    monkeypatch.setattr(elastic, "PART", 5)
    monkeypatch.setattr(elastic, "STEPS_WORTH_THREADS", 0)
    monkeypatch.setattr("per_obspy.threads.usable_processors", lambda: 3)
    for threaded, among in zip(
        azimuth_maxima(north, east, dt, *oscillators), together, strict=True
    ):
        assert_array_equal(threaded, among)


@pytest.mark.parametrize("count", [64, 128, 512 * 64])
def test_a_late_start_changes_nothing(count):
    # mutations: states lost between stretches of 512 tiles, tiles counted from the stretch instead
    # of the record
    north, east, dt, *oscillators = many_oscillators(40, 2)
    north[0] = east[0] = 0.0  # else the zeros would add a ramp
    once = azimuth_maxima(north, east, dt, *oscillators)
    late = azimuth_maxima(
        *(np.append(np.zeros(count), component) for component in (north, east)), dt, *oscillators
    )
    # groups of tiles and with them windows are others, what is forgotten is below 1e-12
    assert_allclose(late, once, rtol=1e-11)


def test_paired_oscillators_are_the_grid(noise):
    periods, dampings = np.array([0.03, 0.1, 0.33, 1.0, 4.0]), np.array([0.02, 0.05, 0.1, 0.0, 0.3])
    paired = one_component(noise, DT, periods, dampings)
    spectra = response_spectra(noise, DT, periods, dampings)
    # the same states by another order of operations: rounding alone
    assert_allclose(paired.per, np.diagonal(spectra.per), rtol=1e-12)
    assert_allclose(paired.sd, np.diagonal(spectra.sd), rtol=1e-12)


def test_azimuths_superpose_before_the_maximum(noise):
    # mutations: cos and sin exchanged, radians for degrees, counter-clockwise azimuths
    east = noise[::-1].copy()
    azimuths = np.array([0.0, 90.0, 180.0, 30.0, -60.0])
    ours = azimuth_maxima(noise, east, DT, 0.5, 0.05, azimuths)
    for i, azimuth in enumerate(np.radians(azimuths)):
        along = response_spectra(noise * np.cos(azimuth) + east * np.sin(azimuth), DT, [0.5])
        assert_allclose([ours.per[i], ours.sd[i]], [along.per[0], along.sd[0]], rtol=1e-12)


@pytest.mark.parametrize("factor", [1e-170, -4.0, 1e170])
def test_lengths_are_proportional_to_the_motion(factor):
    # mutations: absolute floors, squares that overflow or vanish
    north, east, dt, *oscillators = many_oscillators(20, 3)
    once, scaled = (
        azimuth_maxima(size * north, size * east, dt, *oscillators) for size in (1.0, factor)
    )
    assert_allclose(scaled, np.abs(factor) * np.array(once), rtol=1e-12)


def test_no_motion_no_response():
    for lengths in azimuth_maxima(np.zeros(300), np.zeros(300), DT, [0.02, 0.2, 2.0], 0.05, 30.0):
        assert_array_equal(lengths, np.zeros(3))


def test_components_of_different_length_are_refused():
    with pytest.raises(ValueError, match="north and east must be equally long, got 2 and 3"):
        azimuth_maxima([0.0, 1.0], [0.0, 1.0, 0.0], DT, 1.0, 0.05, 0.0)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"dt": 0.0}, "dt must be positive, got 0"),
        ({"periods": [1.0, -1.0]}, "periods must be positive, got -1.0 at index 1"),
        ({"periods": []}, r"periods must be one row of at least one value, got the shape \(0,\)"),
        ({"dampings": 1.0}, "dampings must be at least 0 and below 1, got 1.0"),
        ({"azimuths": np.nan}, "azimuths must be finite, got nan"),
    ],
)
def test_wrong_arguments_are_named(changed, message):
    arguments = {"dt": DT, "periods": [1.0], "dampings": 0.05, "azimuths": 0.0} | changed
    with pytest.raises(ValueError, match=message):
        azimuth_maxima([0.0, 1.0], [1.0, 0.0], **arguments)
