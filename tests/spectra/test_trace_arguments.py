"""ObsPy Traces as arguments: the same numbers as their samples, and only m/s2."""

import inspect

import numpy as np
import obspy
import pytest
from numpy.testing import assert_array_equal

import per_obspy
from per_obspy import Structure

PERIODS = [0.3, 1.0]


@pytest.fixture
def trace(noise):
    """Return a component in m/s2."""
    header = {"delta": 0.01, "network": "XX", "station": "A", "channel": "HNN", "units": "m/s2"}
    return obspy.Trace(noise.copy(), header)


@pytest.fixture
def east(trace):
    """Return the other component of the same sensor."""
    other = trace.copy()
    other.data = other.data[::-1].copy()
    other.stats.channel = "HNE"
    return other


def test_a_trace_gives_the_numbers_of_its_samples(trace, noise):
    of_trace = per_obspy.per_spectrum(trace, periods=PERIODS, damping=0.02)
    assert_array_equal(of_trace, per_obspy.per_spectrum(noise, 0.01, PERIODS, 0.02))
    by_name = per_obspy.response_spectra(acceleration=trace, periods=PERIODS)
    assert_array_equal(by_name.sd, per_obspy.response_spectra(noise, 0.01, PERIODS).sd)


def test_a_history_takes_a_trace(trace, noise):
    pair = [Structure(0.4, 0.05, 1.0), Structure(0.7, 0.05, 1.0)]
    of_trace = per_obspy.pounding_history(trace, structures=pair, gaps=[0.0], restitution=0.5)
    assert_array_equal(of_trace.per, per_obspy.pounding_history(noise, 0.01, pair, [0.0], 0.5).per)


def test_two_traces_give_the_numbers_of_their_samples(trace, east, noise):
    of_traces = per_obspy.azimuthal_per_spectrum(trace, east, periods=PERIODS, azimuths=[0, 45])
    of_samples = per_obspy.azimuthal_per_spectrum(
        noise, noise[::-1], 0.01, PERIODS, azimuths=[0, 45]
    )
    assert_array_equal(of_traces, of_samples)


def test_every_public_function_of_a_record_takes_traces():
    numbers = {("acceleration", "dt"): 1, ("north", "east"): 2}
    functions = []
    for name in per_obspy.__all__:
        public = getattr(per_obspy, name)
        if not inspect.isfunction(public):
            continue
        count = numbers.get(tuple(inspect.signature(public).parameters)[:2], 0)
        if count:
            functions.append(name)
            assert "obspy Trace" in public.__doc__, name
            # Refused for its unit, hence taken as a Trace
            with pytest.raises(ValueError, match="unknown unit"):
                public(*[obspy.Trace(np.zeros(4))] * count)
    assert len(functions) > 10


@pytest.mark.parametrize("unit", ["m/s", "counts", "m"])
def test_other_units_are_refused(trace, unit):
    trace.stats.units = unit
    with pytest.raises(ValueError, match=f"acceleration is a Trace in '{unit}', not in m/s2"):
        per_obspy.per_spectrum(trace, periods=PERIODS)


def test_counts_of_a_file_are_refused():
    with pytest.raises(ValueError, match="maybe counts"):
        per_obspy.per_spectrum(obspy.read()[0], periods=PERIODS)


@pytest.mark.parametrize(
    ("output", "steps", "taken"),
    [
        ("ACC", (), True),
        ("VEL", (), False),
        ("VEL", ("differentiate",), True),
        ("ACC", ("integrate",), False),
        ("DISP", ("differentiate", "differentiate"), True),
    ],
)
def test_the_unit_after_removal_of_the_response_is_known(output, steps, taken):
    # ObsPy's own example with its response, through ObsPy's own steps
    [component] = obspy.read().select(component="Z")
    component.remove_response(obspy.read_inventory(), output=output)
    for step in steps:
        getattr(component, step)()
    if taken:
        assert np.isfinite(per_obspy.per_spectrum(component, periods=PERIODS)).all()
    else:
        with pytest.raises(ValueError, match="not in m/s2"):
            per_obspy.per_spectrum(component, periods=PERIODS)


def test_values_behind_a_trace_go_by_keyword(trace):
    # ``periods`` could be taken for ``dt``, or ``dt`` for ``periods``
    with pytest.raises(ValueError, match="all other arguments by keyword"):
        per_obspy.per_spectrum(trace, PERIODS)
    with pytest.raises(ValueError, match="leave dt out"):
        per_obspy.per_spectrum(trace, dt=0.01, periods=PERIODS)


@pytest.mark.parametrize("shift", [-0.004, 0.004])
def test_clocks_that_differ_by_less_than_half_an_interval_are_one(trace, east, shift):
    expected = per_obspy.azimuthal_per_spectrum(trace, east, periods=PERIODS)
    east.stats.starttime = trace.stats.starttime + shift
    found = per_obspy.azimuthal_per_spectrum(trace, east, periods=PERIODS)
    np.testing.assert_array_equal(found, expected)


def test_two_traces_belong_together(trace, east):
    later = trace.stats.starttime + 0.006
    for mend, message in [
        (lambda: setattr(east.stats, "starttime", later), "north starts at"),
        (lambda: setattr(east, "data", east.data[1:]), "north has 60 samples of 0.01 s, east 59"),
    ]:
        east.stats.starttime = trace.stats.starttime
        mend()
        with pytest.raises(ValueError, match=message):
            per_obspy.azimuthal_per_spectrum(trace, east, periods=PERIODS)


def test_swapped_traces_and_a_mixture_are_refused(trace, east, noise):
    with pytest.raises(ValueError, match="north is the Trace 'HNE'"):
        per_obspy.azimuthal_per_spectrum(east, trace, periods=PERIODS)
    with pytest.raises(ValueError, match="must both be Traces"):
        per_obspy.azimuthal_per_spectrum(trace, noise, 0.01, PERIODS)


def test_a_gap_in_a_trace_is_refused(trace):
    trace.data = np.ma.masked_greater(trace.data, 1.0)
    with pytest.raises(ValueError, match="masked values"):
        per_obspy.per_spectrum(trace, periods=PERIODS)
