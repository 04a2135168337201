"""Maxima of deferred tiles, so short that they also run uncompiled."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.pounding.pair_histories import pounding_histories
from per_obspy.spectra.elastic import response_spectra

DT = 0.02
STEPS = np.arange(160)


@pytest.mark.parametrize(
    "record",
    [
        np.sin(0.7 * STEPS) * np.exp(0.05 * STEPS),  # every tile passes the ones before
        np.sin(0.7 * STEPS) * np.exp(-0.02 * STEPS),  # the first tiles hold the maxima
        np.random.default_rng(7).normal(size=160),
    ],
    ids=["growing", "falling", "noise"],
)
def test_maxima_without_contact_are_those_of_the_spectrum(record):
    # catches: a deferred tile dropped that may hold more than later samples, searched from a wrong
    # start, or never; the spectrum's kernel shares no code
    periods = DT * np.linspace(7.0, 14.0, 32)  # peaks between samples stand out by up to a tenth
    maxima = pounding_histories(record, DT, periods, 0.02, 1.0, periods[::-1], 0.02, 1.0, 1e3, 0.5)
    for i, period in enumerate(periods):
        expected = response_spectra(np.append(record, 0.0), DT, [period], 0.02)
        # both are exact
        assert_allclose(maxima.per[[0, 1], [i, 31 - i]], expected.per[0], rtol=1e-9)
        displacements = maxima.displacement_maxima[[0, 1], [i, 31 - i]]
        assert_allclose(displacements, expected.sd[0], rtol=1e-9)
