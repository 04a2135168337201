"""Error of critical gaps by PER and SD: laws, and real records."""

import numpy as np
import obspy
import pytest
from numpy.testing import assert_allclose, assert_array_less

from per_obspy import critical_gap, ddc_correlation, relative_displacement, response_spectra
from per_obspy.pounding.reliability import per_error, sd_error

RATIOS = np.geomspace(1.001, 8.0, 60)
ERRORS = per_error, sd_error


@pytest.mark.parametrize("error", ERRORS)
def test_the_order_of_the_structures_and_the_unit_of_time_do_not_matter(error):
    one = error(0.5, 0.02, 0.5 * RATIOS, 0.08)
    other = error(2.0 * RATIOS, 0.08, 2.0, 0.02)
    for first, second in zip(one, other, strict=True):
        # rounding of equation (16)
        assert_allclose(first, second, rtol=1e-12)


@pytest.mark.parametrize("error", ERRORS)
def test_the_nearer_the_periods_the_larger_and_the_less_certain(error):
    for damping in (0.01, 0.05, 0.2):
        for values in error(1.0, damping, RATIOS, damping):
            assert (np.diff(values) < 0.0).all()


def test_peaks_of_far_periods_have_no_error_in_the_median():
    # independent responses, of which (16) is right at any damping
    assert_allclose(sd_error(0.2, [0.02, 0.05, 0.1], 2.0, [0.02, 0.05, 0.1]).median, 1.0, atol=0.03)


def test_a_radius_is_never_a_smaller_estimate_than_a_peak():
    # PER is not below SD
    for damping in (0.02, 0.05, 0.1):
        pair = 1.0, damping, RATIOS, damping
        assert_array_less(sd_error(*pair).median, per_error(*pair).median)


@pytest.mark.parametrize("error", ERRORS)
def test_dampings_beyond_those_of_the_fit_count_as_the_nearest(error):
    # undamped structures too, whose correlation is 0
    beyond = error(1.0, [0.0, 0.001, 0.5], 3.0, [0.0, 0.001, 0.5])
    assert np.isfinite(beyond).all()
    assert (beyond.median < 1.5).all()


@pytest.mark.real_data
def test_medians_of_real_records(real_data):
    # three earthquakes, three shorter periods, both sides: 18 values a ratio, of which half are
    # independent; a deviation of 0.1 to 0.4 leaves a median uncertain by 0.04 to 0.16
    files = ("peer_at2/RSN6_IMPVALL.I_I-ELC180.AT2", "itaca2009/16839/16839_H1.cor.acc")
    files += ("afad2023/20230206011732_4414_ap_AAD_Acc_N.asc",)
    period = np.repeat([0.4, 0.8, 1.2], 3)
    ratio = np.tile([1.02, 1.5, 3.0], 3)
    pair = period, 0.05, period * ratio, 0.05
    found = []
    for file in files:
        trace = obspy.read(real_data / "records" / file)[0]
        record = trace.data.astype(float), trace.stats.delta
        periods, place = np.unique([period, pair[2]], return_inverse=True)
        sd = response_spectra(*record, periods).sd[place.reshape(2, -1)]
        estimate = critical_gap(*sd, ddc_correlation(*pair))
        gap = relative_displacement(*record, *pair)
        found += [estimate / gap.one_before_two, estimate / gap.two_before_one]
    medians = np.median(np.reshape(found, (len(found), 3, 3)), axis=(0, 1))
    error = sd_error(*pair)
    assert_allclose(np.log(medians / error.median[:3]), 0.0, atol=0.2)
    # what one constant hid
    assert medians[0] > 1.15 * medians[2]
