"""Pairs that yield: limits, scaling, and equivalent buildings checked by other means."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.interpolate import RegularGridInterpolator
from screening_samples import make_station, table_of

import per_obspy
from per_obspy.pounding.equivalent_linear import iwan
from per_obspy.screening.columns import RESULTS
from per_obspy.screening.estimates import linearized_columns
from per_obspy.screening.risk import INTERMEDIATE
from per_obspy.screening.station_motion import station_motion
from per_obspy.screening.values import values

#: Columns of lengths, and of pure numbers and seconds.
LENGTHS = ("critical_gap_linearized", "equivalent_per_1", "equivalent_per_2")
OTHERS = (
    "correlation_linearized",
    "ductility_1",
    "ductility_2",
    "equivalent_period_1",
    "equivalent_damping_2",
)


def weak(table, ratio_1, ratio_2):
    """Return the table with yield displacements below the elastic displacements by these ratios."""
    return table.assign(
        hardening_1=0.05,
        hardening_2=0.05,
        yield_displacement_1=table["sd_1"] / ratio_1,
        yield_displacement_2=table["sd_2"] / ratio_2,
    )


@pytest.fixture(scope="module")
def table(station):
    rows = [
        {"period_1": period, "period_2": 0.7 * period, "azimuth": 100.0 * period}
        for period in (0.3, 0.6, 1.1, 2.0)
    ]
    return table_of(station, rows)


def test_every_column_is_described(record, table):
    assert set(linearized_columns(record, table)) <= set(RESULTS) | set(INTERMEDIATE)


def test_buildings_that_stay_elastic_are_as_they_were(record, table):
    # catches: an equivalent building where the displacement stays below the yield displacement
    for elastic in (table, weak(table, 0.999, 0.2)):
        found = linearized_columns(record, elastic)
        for name, column in (
            ("critical_gap_linearized", "critical_gap_per"),
            ("correlation_linearized", "correlation"),
            ("equivalent_period_1", "period_1"),
            ("equivalent_damping_2", "damping_2"),
            ("equivalent_per_1", "per_1"),
        ):
            assert_array_equal(found[name], elastic[column])
        assert found["linearized_converged"].all()
    assert_allclose(linearized_columns(record, weak(table, 0.5, 0.2))["ductility_1"], 0.5)


def test_yielding_begins_gradually(record, table):
    found = linearized_columns(record, weak(table, 1.0 + 1e-6, 0.5))
    # the damping grows like the ductility above 1 to the power 0.371: by 0.0004 here
    assert_allclose(found["critical_gap_linearized"], table["critical_gap_per"], rtol=0.02)
    assert np.all(found["equivalent_damping_1"] > table["damping_1"])


def test_a_building_of_large_damping_stays_an_oscillator_when_it_yields(record, table):
    # would catch an equivalent damping above the critical one, of which the correlation knows
    # nothing
    damped = table.assign(damping_1=0.9, damping_2=0.999)
    found = linearized_columns(record, weak(damped, 30.0, 30.0))
    assert np.all((found["equivalent_damping_1"] > 0.9) & (found["equivalent_damping_1"] <= 0.99))
    assert_array_equal(found["equivalent_damping_2"], 0.999)
    assert np.isfinite(found["critical_gap_linearized"]).all()


@pytest.fixture(scope="module")
def stored(station):
    """Interpolators of ln SD and ln PER in azimuth, ln damping and ln period, by SciPy."""
    dampings, periods = np.log(station["damping"]), np.log(station["period"])
    axes = station["azimuth"].to_numpy(), dampings.to_numpy(), periods.to_numpy()
    # float32 in the file
    sd = np.log(station["sd_azimuthal"].to_numpy().astype(float))
    per = np.log(station["per_azimuthal"].to_numpy().astype(float))
    return {"sd": RegularGridInterpolator(axes, sd), "per": RegularGridInterpolator(axes, per)}


def _changes(stored, table, found, i):
    """Return the equivalent over the elastic SD and PER of building i, by the stored spectra."""
    nearest = np.rint(values(table, "azimuth_used") / 10.0) * 10.0 % 180.0
    elastic = nearest, np.log(table[f"damping_{i}"]), np.log(table[f"period_{i}"])
    # the largest damping that is stored is 0.1
    damping = np.minimum(found[f"equivalent_damping_{i}"], 0.1)
    equivalent = nearest, np.log(damping), np.log(found[f"equivalent_period_{i}"])
    sd = np.exp(stored["sd"](equivalent) - stored["sd"](elastic))
    return sd, np.exp(stored["per"](equivalent) - stored["per"](elastic))


@pytest.mark.parametrize("i", [1, 2])
def test_the_equivalent_building_reaches_its_own_ductility(record, table, stored, i):
    # catches: PER in place of SD, a ductility of the coarse scan, the wrong azimuth, a radius not
    # scaled to the pair's
    yielding = weak(table, 1.1, 1.05)
    found = linearized_columns(record, yielding)
    sd_change, per_change = _changes(stored, table, found, i)
    assert found["linearized_converged"].all()
    assert np.all(found[f"ductility_{i}"] > 1.0)
    # interpolated linearly within a two-thousandth of the ductility
    ductility = table[f"sd_{i}"] * sd_change / yielding[f"yield_displacement_{i}"]
    assert_allclose(ductility, found[f"ductility_{i}"], rtol=1e-5)
    assert_allclose(found[f"equivalent_per_{i}"], table[f"per_{i}"] * per_change, rtol=1e-9)


def test_the_period_lengthens_by_iwan(record, table):
    found = linearized_columns(record, weak(table, 1.1, 1.05))
    for i in (1, 2):
        longer = found[f"equivalent_period_{i}"] / table[f"period_{i}"]
        assert_allclose(longer, 1 + 0.121 * (found[f"ductility_{i}"] - 1) ** 0.939)


#: Period of a lakebed in steady motion, and of stiff buildings on it, s.
GROUND, STIFF = 2.0, 0.7


def _steady_radius(period, damping):
    """Return the displacement of an oscillator in steady motion of the ground's period."""
    ratio = period / GROUND
    return 0.1 * ratio**2 / np.hypot(1.0 - ratio**2, 2.0 * damping * ratio)


@pytest.fixture(scope="module")
def lakebed(station):
    """The station with the spectra of steady motion."""
    steady = station.copy(deep=True)
    radii = _steady_radius(steady["period"].to_numpy(), steady["damping"].to_numpy()[:, None])
    steady["sd_azimuthal"][:] = radii[None]
    steady["per_azimuthal"][:] = radii[None]
    return station_motion(steady)


def test_of_several_ductilities_the_largest_is_taken(lakebed, table):
    # catches: the first one, at which a stiff building that yields has not reached the resonance of
    # the ground yet
    weakness = 1.1
    stiff = table.iloc[:1].assign(period_1=STIFF, period_2=STIFF, damping_1=0.05, damping_2=0.05)
    stiff = stiff.assign(sd_1=1.0, sd_2=1.0)
    found = linearized_columns(lakebed, weak(stiff, weakness, weakness))
    # displacement over yield displacement at every ductility; 0.1 is the last stored damping
    ductility = np.linspace(1.0, 40.0, 4000)
    longer, added = iwan(ductility, 0.0)
    equivalent = _steady_radius(STIFF * longer, np.minimum(0.05 + added, 0.1))
    reached = weakness * equivalent / _steady_radius(STIFF, 0.05)
    # an earlier one exists
    excess = np.flatnonzero(reached > ductility)
    assert np.any(reached[: excess[-1]] < ductility[: excess[-1]])
    # the spectrum is stored at periods 9 % apart, and there a resonance is cut off: it is not
    # reproduced to better
    assert_allclose(found["ductility_1"], ductility[excess[-1]], rtol=0.1)


def test_radii_of_equivalent_buildings_are_those_of_the_record(record, table):
    found = linearized_columns(record, weak(table, 1.1, 1.05))
    for index, azimuth in enumerate(np.radians(table["azimuth_used"])):
        along = record.records[0].north * np.cos(azimuth) + record.records[0].east * np.sin(azimuth)
        for i in (1, 2):
            period = found[f"equivalent_period_{i}"][index]
            damping = found[f"equivalent_damping_{i}"][index]
            direct = per_obspy.per_spectrum(along, record.records[0].dt, [period], damping)[0]
            # the spectrum is stored at periods that are 9 % apart
            assert found[f"equivalent_per_{i}"][index] == pytest.approx(direct, rel=0.1)


def test_scaling_ground_and_strength_scales_lengths_only():
    rows = [{"period_1": 0.6, "period_2": 1.5}]
    station, stronger = make_station(), make_station(scale=3.0)
    pairs, stronger_pairs = table_of(station, rows), table_of(stronger, rows)
    found = linearized_columns(station_motion(station), weak(pairs, 3.0, 2.0))
    scaled = linearized_columns(station_motion(stronger), weak(stronger_pairs, 3.0, 2.0))
    for name in LENGTHS:
        assert_allclose(scaled[name], 3.0 * found[name], rtol=1e-5)  # spectra are stored as float32
    for name in OTHERS:
        assert_allclose(scaled[name], found[name], rtol=1e-5)


def test_exchanging_the_buildings_exchanges_their_columns(record, table):
    yielding = weak(table, 4.0, 2.0)
    # every column of building 1 takes the name of that of building 2, and the reverse
    names = {}
    for name in yielding:
        if name.endswith("_1"):
            names |= {name: f"{name[:-1]}2", f"{name[:-1]}2": name}
    found = linearized_columns(record, yielding)
    exchanged = linearized_columns(record, yielding.rename(columns=names))
    gap = "critical_gap_linearized"
    assert_allclose(exchanged[gap], found[gap], rtol=1e-12)
    assert_array_equal(exchanged["ductility_1"], found["ductility_2"])


def test_a_row_does_not_depend_on_the_others(record, table):
    # to the bit
    yielding = weak(table, np.array([1.2, 4.0, 0.5, 6.0]), 2.0)
    whole = linearized_columns(record, yielding)
    for index in range(len(yielding)):
        alone = linearized_columns(record, yielding.iloc[index : index + 1])
        for name, column in whole.items():
            assert_array_equal(alone[name], column[index : index + 1], err_msg=name)


def test_strength_that_is_far_too_small_does_not_converge(record, table):
    found = linearized_columns(record, weak(table, 1e4, 0.5))
    assert not found["linearized_converged"].any()
    assert_array_equal(found["ductility_1"], 40.0)
    assert np.isfinite(found["critical_gap_linearized"]).all()


def test_narrow_ground_motion_does_not_raise_the_correlation(station):
    # catches: the smaller correlation used under broad motion too, or the larger under narrow
    # motion
    rows = [{"period_1": 0.6, "period_2": 0.9}]
    time = np.arange(4000) * 0.01
    sine = np.sin(2 * np.pi * time) * np.hanning(4000)
    narrow = make_station()
    narrow["acceleration"][:] = np.stack([sine, 0.3 * sine])
    broad = make_station()
    broad["acceleration"][:] = np.random.default_rng(2).normal(size=(2, 4000))
    table = weak(table_of(station, rows), 1.5, 0.5)
    elastic = values(table, "correlation")
    # the shorter period grows towards the longer one
    in_broad = linearized_columns(station_motion(broad), table)["correlation_linearized"]
    in_narrow = linearized_columns(station_motion(narrow), table)["correlation_linearized"]
    assert in_broad > elastic
    assert_array_equal(in_narrow, elastic)
