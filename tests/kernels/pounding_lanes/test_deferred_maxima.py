"""Maxima of tiles that wait, so short that they also run uncompiled; the spectrum's kernel shares no code."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.pounding.history.pair_histories import pounding_histories
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
    # catches: a waiting tile dropped that may hold more than later samples, searched from a wrong
    # start, or never
    periods = DT * np.linspace(7.0, 14.0, 32)  # peaks between samples stand out by up to a tenth
    found = pounding_histories(record, DT, periods, 0.02, 1.0, periods[::-1], 0.02, 1.0, 1e3, 0.5)
    for i, period in enumerate(periods):
        expected = response_spectra(np.append(record, 0.0), DT, [period], 0.02)
        for maxima, largest in (
            (found.per, expected.per),
            (found.displacement_maxima, expected.sd),
        ):
            assert_allclose(
                [maxima[0, i], maxima[1, 31 - i]], largest[0], rtol=1e-9
            )  # both are exact
