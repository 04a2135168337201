"""Laws that the spectra of any filtered motion obey, checked on real records; no model needed."""

import numpy as np
import pytest

from per_obspy.config import Processing
from per_obspy.processing.chain import process_station
from per_obspy.processing.components import is_horizontal
from per_obspy.records.folder import find_stations, read_station
from per_obspy.spectra.azimuthal import azimuthal_sd_spectrum, rotd
from per_obspy.spectra.station import north_and_east

AZIMUTHS = np.arange(0.0, 180.0, 5.0)
DAMPING, STEP = 0.05, 1.02  # fraction of critical; ratio of successive periods


@pytest.fixture(scope="module", params=["CI.CCC", "CI.CLC", "CI.WNM"])
def motion(request, real_data):
    """North, east, dt and numbers chosen of one processed station."""
    found = find_stations(real_data / "records" / "ridgecrest2019_mseed")
    stream, _ = read_station(found.stations[request.param], found.inventory, request.param)
    processed, _ = process_station(stream, Processing())
    # horizontals turned from the azimuths of their sensors
    first, second = (trace for trace in processed if is_horizontal(trace))
    azimuths = first.stats.sensor_azimuth, second.stats.sensor_azimuth
    north, east = north_and_east(first.data, second.data, *azimuths)
    return north, east, first.stats.delta, first.stats.per_obspy


def rotd50_sd(motion, periods):
    north, east, dt, _ = motion
    return rotd(azimuthal_sd_spectrum(north, east, dt, np.asarray(periods), DAMPING, AZIMUTHS), 50)


def rotd50_peak(north, east):
    angles = np.radians(AZIMUTHS)[:, None]
    return float(np.median(np.abs(north * np.cos(angles) + east * np.sin(angles)).max(axis=1)))


def test_the_spectrum_is_smooth(motion):
    periods = STEP ** np.arange(0, 200) * 0.1
    sa = (2 * np.pi / periods) ** 2 * rotd50_sd(motion, periods)
    # an oscillator cannot separate periods closer than its half-power width, 2 x damping = 10 %:
    # over a fifth of that the spectrum changes by less than 2 % / 10 % = 20 %; spikes and dropouts
    # at one period would change it by more
    assert np.abs(np.diff(np.log(sa))).max() < 0.2
    # and it has no line: no value exceeds its neighbours at 4 % distance by a quarter
    middle = np.log(sa[2:-2]) - 0.5 * (np.log(sa[:-4]) + np.log(sa[4:]))
    assert np.abs(middle).max() < 0.25


def test_stiff_oscillators_feel_the_peak_acceleration(motion):
    sa = (2 * np.pi / 0.01) ** 2 * rotd50_sd(motion, [0.01])[0]
    # the motion ends at the corner of 37.5 Hz: at 100 Hz the amplification is 1 / (1 - (37.5 /
    # 100)^2) = 1.16 at most, for motion that is all at the corner; the strongest of it is below 10
    # Hz, where it is 1.01
    np.testing.assert_allclose(sa, rotd50_peak(*motion[:2]), rtol=0.05)


def test_beyond_the_corner_there_is_only_the_peak_displacement(motion):
    north, east, dt, chosen = motion
    displacement = [np.cumsum(np.cumsum(motion)) * dt**2 for motion in (north, east)]
    sd = rotd50_sd(motion, [10 / chosen.highpass])[0]
    # ten periods of the corner: the oscillator rests and the ground moves below it; motion at the
    # corner moves it by (1 / 10)^2 at most, in cycles that resonate no more than a few times
    np.testing.assert_allclose(sd, rotd50_peak(*displacement), rtol=0.1)


def test_the_usable_periods_end_before_the_corner_bends_the_spectrum(motion):
    chosen = motion[3]
    assert chosen.longest_period < 1 / chosen.highpass
    assert 5.0 < chosen.longest_period < 100.0  # s: M 7.1 within 100 km, records of 325 s
    limits = [chosen.longest_period, 3 * chosen.longest_period]
    sa = (2 * np.pi / np.array(limits)) ** 2 * rotd50_sd(motion, limits)
    # from the corner on the spectrum falls at least with the first power of period: constant
    # displacement is the second
    assert sa[1] < sa[0] / 3
