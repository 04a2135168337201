"""Spectra by azimuth: superposition, symmetries, and an independent program."""

import numpy as np
import pyrotd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.spectra.azimuthal import (
    azimuthal_per_spectrum,
    azimuthal_sd_spectrum,
    rotd,
    sampled_azimuthal_per_spectrum,
    sampled_azimuthal_sd_spectrum,
)
from per_obspy.spectra.elastic import response_spectra, sampled_response_spectra

DT = 0.01
PERIODS = np.array([0.004, 0.03, 0.1, 0.4, 2.0, 9.0])


@pytest.fixture(scope="module")
def pair():
    """Two components of 400 samples of noise under an envelope, unequal, ending abruptly."""
    shape = np.exp(-(((np.arange(400) - 250) / 120.0) ** 2))
    return np.random.default_rng(3).normal(size=(2, 400)) * shape * [[1.0], [0.4]]


EXACT = azimuthal_per_spectrum, azimuthal_sd_spectrum, response_spectra
SAMPLED = sampled_azimuthal_per_spectrum, sampled_azimuthal_sd_spectrum, sampled_response_spectra


@pytest.mark.parametrize("spectra", [EXACT, SAMPLED])
@pytest.mark.parametrize("damping", [0.0, 0.05, 0.7])
def test_every_azimuth_is_the_spectrum_of_its_own_motion(pair, damping, spectra):
    # catches pruning that loses a maximum, cos and sin exchanged, and free vibration left out;
    # samples that are ruled out wrongly, and peaks between the samples that slip in
    along_azimuths, displacements, of_motion = spectra
    azimuths = np.array([0.0, 7.0, 90.0, 133.3, 180.0, 271.0, -20.0])
    per = along_azimuths(*pair, DT, PERIODS, damping, azimuths)
    sd = displacements(*pair, DT, PERIODS, damping, azimuths)
    for k, azimuth in enumerate(np.radians(azimuths)):
        motion = pair[0] * np.cos(azimuth) + pair[1] * np.sin(azimuth)
        along = of_motion(motion, DT, PERIODS, damping)
        # the same physics in another order of sums
        assert_allclose(per[:, k], along.per, rtol=1e-11)
        assert_allclose(sd[:, k], along.sd, rtol=1e-11)


def test_default_azimuths_are_whole_degrees(pair):
    per = azimuthal_per_spectrum(*pair, DT, PERIODS)
    assert per.shape == (6, 180)
    assert_allclose(
        per[:, [0, 45, 179]],
        azimuthal_per_spectrum(*pair, DT, PERIODS, azimuths=[0, 45, 179]),
        rtol=1e-13,
    )


def test_one_component_is_felt_by_its_cosine(pair):
    # polarised motion: the most demanding case of the pruning, since one azimuth feels nothing
    per = azimuthal_per_spectrum(pair[0], np.zeros(400), DT, PERIODS)
    expected = np.abs(np.cos(np.radians(np.arange(180)))) * per[:, :1]
    assert_allclose(per, expected, rtol=1e-11, atol=1e-15 * per.max())


def test_dampings_come_first(pair):
    per = azimuthal_per_spectrum(*pair, DT, PERIODS, [0.02, 0.1], [5.0, 50.0])
    assert per.shape == (2, 6, 2)
    assert_array_equal(per[1], azimuthal_per_spectrum(*pair, DT, PERIODS, 0.1, [5.0, 50.0]))


def test_rotd_agrees_with_pyrotd(monkeypatch):
    monkeypatch.setattr(pyrotd, "processes", 1)  # else it forks a pool for each spectrum
    # its FFT interpolates between samples as band limited and wraps round: smooth motion, padded
    time = np.arange(8000) * 0.005
    shape = np.exp(-(((time - 6) / 2) ** 2))
    north, east = (
        shape * np.sin(2 * np.pi * 1.3 * time),
        0.7 * shape * np.cos(2 * np.pi * 0.9 * time),
    )
    periods = np.array([0.5, 1.0, 2.0])
    spectra = azimuthal_sd_spectrum(north, east, 0.005, periods)
    theirs = pyrotd.calc_rotated_spec_accels(
        0.005, north, east, 1 / periods, 0.05, [50, 100], method="rigorous"
    )
    pseudo = np.sort(theirs, order=["osc_freq", "percentile"])["spec_accel"].reshape(3, 2)[::-1]
    # sinc² of the straight lines at 1.3 Hz and sampled peaks: 3e-5
    for column, percentile in enumerate([50, 100]):
        ours = rotd(spectra, percentile) * (2 * np.pi / periods) ** 2
        assert_allclose(ours, pseudo[:, column], rtol=2e-4)


def test_percentiles_of_the_last_axis():
    spectrum = np.arange(12.0).reshape(3, 4)
    assert_array_equal(rotd(spectrum, 100), [3.0, 7.0, 11.0])
    assert_array_equal(rotd(spectrum, 0), [0.0, 4.0, 8.0])
    assert_array_equal(rotd(spectrum, 50), [1.5, 5.5, 9.5])


@pytest.mark.parametrize("function", [azimuthal_per_spectrum, azimuthal_sd_spectrum])
@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"north": [np.nan, 0.0]}, "north must be finite, got nan"),
        ({"east": [0.0]}, "north and east must be equally long, got 2 and 1"),
        ({"azimuths": []}, "azimuths must be one row of at least one value"),
        ({"azimuths": [np.inf]}, "azimuths must be finite, got inf"),
        ({"dt": 0}, "dt must be positive, got 0"),
        ({"periods": -1.0}, "periods must be positive, got -1"),
    ],
)
def test_wrong_arguments_are_named(function, changed, message):
    with pytest.raises(ValueError, match=message):
        function(**{"north": [0.0, 1.0], "east": [0.0, 1.0], "dt": DT, "periods": [1.0]} | changed)


@pytest.mark.parametrize(
    ("values", "percentile"), [([1.0], 101), ([1.0], -1), (1.0, 50), ([np.nan], 50)]
)
def test_wrong_percentiles_are_refused(values, percentile):
    with pytest.raises(ValueError, match=r"spectrum must|percentile must"):
        rotd(values, percentile)


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.7])
def test_sampled_peaks_are_those_of_each_rotated_motion(pair, damping):
    # catches samples that are ruled out wrongly, and peaks between the samples that slip in
    azimuths = np.array([0.0, 7.0, 90.0, 133.3, 180.0, 271.0, -20.0])
    per = sampled_azimuthal_per_spectrum(*pair, DT, PERIODS, damping, azimuths)
    sd = sampled_azimuthal_sd_spectrum(*pair, DT, PERIODS, damping, azimuths)
    for k, azimuth in enumerate(np.radians(azimuths)):
        motion = pair[0] * np.cos(azimuth) + pair[1] * np.sin(azimuth)
        along = sampled_response_spectra(motion, DT, PERIODS, damping)
        # the same sums in another order
        assert_allclose(per[:, k], along.per, rtol=1e-11)
        assert_allclose(sd[:, k], along.sd, rtol=1e-11)


def test_a_quarter_turn_of_the_ground_exchanges_the_components(pair):
    # a' = -(the component that came from the east): catches a wrong sense of rotation
    turned = azimuthal_per_spectrum(-pair[1], pair[0], DT, PERIODS, azimuths=[30.0, 120.0])
    assert_allclose(
        turned, azimuthal_per_spectrum(*pair, DT, PERIODS, azimuths=[-60.0, 30.0]), rtol=1e-12
    )


def test_half_a_turn_changes_nothing(pair):
    once, turned = (
        azimuthal_sd_spectrum(*pair, DT, PERIODS, azimuths=azimuths)
        for azimuths in ([10.0], [190.0])
    )
    assert_allclose(turned, once, rtol=1e-12)
