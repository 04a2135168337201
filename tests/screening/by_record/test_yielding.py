"""Pairs that yield: limits, scaling, an equivalent building checked by other means, and the exact demand beside it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.interpolate import RegularGridInterpolator
from screening_samples import make_pairs, make_station, table_of

import per_obspy
from per_obspy.pounding.history.relative_yielding import yielding_relative_displacement
from per_obspy.pounding.yielding.equivalent_linear import iwan
from per_obspy.screening.by_record.yielding import linearized_columns
from per_obspy.screening.columns import RESULTS
from per_obspy.screening.rows import ON_THE_WAY
from per_obspy.screening.values import components, values

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
    limits = {
        f"yield_displacement_{i}": table[f"sd_{i}"] / ratio
        for i, ratio in ((1, ratio_1), (2, ratio_2))
    }
    return table.assign(hardening_1=0.05, hardening_2=0.05, **limits)


@pytest.fixture(scope="module")
def table(station):
    return table_of(
        station,
        [{"period_1": T, "period_2": 0.7 * T, "azimuth": 100.0 * T} for T in (0.3, 0.6, 1.1, 2.0)],
    )


def test_every_column_is_described(station, table):
    assert set(linearized_columns(station, table)) <= set(RESULTS) | set(ON_THE_WAY)


def test_buildings_that_stay_elastic_are_as_they_were(station, table):
    # catches: an equivalent building where the displacement stays below the yield displacement
    for elastic in (table, weak(table, 0.999, 0.2)):
        found = linearized_columns(station, elastic)
        for name, column in (
            ("critical_gap_linearized", "critical_gap_per"),
            ("correlation_linearized", "correlation"),
            ("equivalent_period_1", "period_1"),
            ("equivalent_damping_2", "damping_2"),
            ("equivalent_per_1", "per_1"),
        ):
            assert_array_equal(found[name], elastic[column])
        assert found["linearized_converged"].all()
    assert_allclose(linearized_columns(station, weak(table, 0.5, 0.2))["ductility_1"], 0.5)


def test_yielding_begins_gradually(station, table):
    found = linearized_columns(station, weak(table, 1.0 + 1e-6, 0.5))
    # the damping grows like the ductility above 1 to the power 0.371: by 0.0004 here
    assert_allclose(found["critical_gap_linearized"], table["critical_gap_per"], rtol=0.02)
    assert np.all(found["equivalent_damping_1"] > table["damping_1"])


def test_a_building_of_large_damping_stays_an_oscillator_when_it_yields(station, table):
    # would catch an equivalent damping above the critical one, of which the correlation knows
    # nothing
    damped = table.assign(damping_1=0.9, damping_2=0.999)
    found = linearized_columns(station, weak(damped, 30.0, 30.0))
    assert np.all((found["equivalent_damping_1"] > 0.9) & (found["equivalent_damping_1"] <= 0.99))
    assert_array_equal(found["equivalent_damping_2"], 0.999)
    assert np.isfinite(found["critical_gap_linearized"]).all()


def test_the_equivalent_building_reaches_its_own_ductility(station, table):
    # catches: PER in place of SD, a ductility of the coarse scan, the wrong azimuth, a radius not
    # scaled to the pair's
    yielding = weak(table, 1.1, 1.05)
    found = linearized_columns(station, yielding)
    assert found["linearized_converged"].all()
    axes = (
        station["azimuth"].to_numpy(),
        np.log(station["damping"].to_numpy()),
        np.log(station["period"].to_numpy()),
    )
    rows = {
        name: RegularGridInterpolator(
            axes, np.log(station[f"{name}_azimuthal"].to_numpy().astype(float))
        )
        for name in ("sd", "per")
    }
    nearest = np.rint(values(table, "azimuth_used") / 10.0) * 10.0 % 180.0
    for i in (1, 2):
        own = nearest, np.log(table[f"damping_{i}"]), np.log(table[f"period_{i}"])
        damping = np.minimum(found[f"equivalent_damping_{i}"], 0.1)  # the largest that is stored
        equivalent = nearest, np.log(damping), np.log(found[f"equivalent_period_{i}"])
        change = {name: np.exp(rows[name](equivalent) - rows[name](own)) for name in rows}
        displacement = table[f"sd_{i}"] * change["sd"]
        # interpolated linearly within a two-thousandth of the ductility
        assert np.all(found[f"ductility_{i}"] > 1.0)
        assert_allclose(
            displacement / yielding[f"yield_displacement_{i}"], found[f"ductility_{i}"], rtol=1e-5
        )
        assert_allclose(found[f"equivalent_per_{i}"], table[f"per_{i}"] * change["per"], rtol=1e-9)
        # Iwan (1980)
        assert_allclose(
            found[f"equivalent_period_{i}"] / table[f"period_{i}"],
            1 + 0.121 * (found[f"ductility_{i}"] - 1) ** 0.939,
        )


def test_of_several_ductilities_the_largest_is_taken(station, table):
    # catches: the first one, at which a stiff building that yields has not reached the resonance of
    # the ground yet
    ground, own, weakness = 2.0, 0.7, 1.1
    steady = station.copy(deep=True)
    period, damping = steady["period"].to_numpy(), steady["damping"].to_numpy()[:, None]

    def radius(period, damping):
        """Return the displacement of an oscillator in steady motion."""
        ratio = period / ground
        return 0.1 * ratio**2 / np.hypot(1.0 - ratio**2, 2.0 * damping * ratio)

    for name in ("sd_azimuthal", "per_azimuthal"):
        steady[name][:] = radius(period, damping)[None]
    one = table.iloc[:1].assign(period_1=own, period_2=own, damping_1=0.05, damping_2=0.05)
    found = linearized_columns(steady, weak(one.assign(sd_1=1.0, sd_2=1.0), weakness, weakness))
    ductility = np.linspace(1.0, 40.0, 4000)
    longer, more = iwan(ductility, 0.0)
    grown = (
        weakness * radius(own * longer, np.minimum(0.05 + more, 0.1)) / radius(own, 0.05)
    )  # 0.1: the last stored
    excess = np.flatnonzero(grown > ductility)
    assert np.any(grown[: excess[-1]] < ductility[: excess[-1]])  # an earlier one exists
    # the spectrum is stored at periods 9 % apart, and there a resonance is cut off: it is not
    # reproduced to better
    assert_allclose(found["ductility_1"], ductility[excess[-1]], rtol=0.1)


def test_radii_of_equivalent_buildings_are_those_of_the_record(station, table):
    found = linearized_columns(station, weak(table, 1.1, 1.05))
    north, east, dt = components(station)
    for index, azimuth in enumerate(np.radians(table["azimuth_used"])):
        along = north * np.cos(azimuth) + east * np.sin(azimuth)
        for i in (1, 2):
            period, damping = (
                found[f"equivalent_period_{i}"][index],
                found[f"equivalent_damping_{i}"][index],
            )
            direct = per_obspy.per_spectrum(along, dt, [period], damping)[0]
            # the spectrum is stored at periods that are 9 % apart
            assert found[f"equivalent_per_{i}"][index] == pytest.approx(direct, rel=0.1)


def test_scaling_ground_and_strength_scales_lengths_only():
    rows = [{"period_1": 0.6, "period_2": 1.5}]
    one, other = (table_of(make_station(scale=scale), rows) for scale in (1.0, 3.0))
    found = linearized_columns(make_station(), weak(one, 3.0, 2.0))
    scaled = linearized_columns(make_station(scale=3.0), weak(other, 3.0, 2.0))
    for name in LENGTHS:
        assert_allclose(scaled[name], 3.0 * found[name], rtol=1e-5)  # spectra are stored as float32
    for name in OTHERS:
        assert_allclose(scaled[name], found[name], rtol=1e-5)


def test_exchanging_the_buildings_exchanges_their_columns(station, table):
    other = {1: 2, 2: 1}
    yielding = weak(table, 4.0, 2.0)
    paired = [name[:-1] for name in yielding if name.endswith("_1")]
    swapped = yielding.rename(
        columns={f"{name}{i}": f"{name}{other[i]}" for name in paired for i in (1, 2)}
    )
    found, seen = linearized_columns(station, yielding), linearized_columns(station, swapped)
    assert_allclose(seen["critical_gap_linearized"], found["critical_gap_linearized"], rtol=1e-12)
    assert_array_equal(seen["ductility_1"], found["ductility_2"])


def test_a_row_does_not_depend_on_the_others(station, table):
    yielding = weak(table, np.array([1.2, 4.0, 0.5, 6.0]), 2.0)
    whole = linearized_columns(station, yielding)
    for index in range(len(yielding)):
        alone = linearized_columns(station, yielding.iloc[index : index + 1])
        for name, column in whole.items():
            assert_array_equal(alone[name], column[index : index + 1], err_msg=name)


def test_strength_that_is_far_too_small_is_said_not_to_converge(station, table):
    found = linearized_columns(station, weak(table, 1e4, 0.5))
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
    assert linearized_columns(broad, table)["correlation_linearized"] > elastic
    assert_array_equal(linearized_columns(narrow, table)["correlation_linearized"], elastic)


#: Yields several times under the weaker motion of the tests below.
ROW = {
    "yield_displacement_1": 0.01,
    "yield_displacement_2": 0.005,
    "hardening_1": 0.05,
    "hardening_2": 0.0,
}


@pytest.fixture(scope="module")
def weaker():
    return make_station(scale=0.1)


class TestExactDemand:
    def test_decides_along_a_given_azimuth(self, weaker):
        # catches: the linear relative displacement of a pair that yields
        row = per_obspy.risk_table(weaker, make_pairs([ROW])).iloc[0]
        assert row["demand_rule"] == "exact"
        north, east, dt = components(weaker)
        shares = [row[f"participation_{i}"] for i in (1, 2)]
        apart = yielding_relative_displacement(
            np.stack([north, east]), dt, row["period_1"], row["damping_1"], row["period_2"], row["damping_2"], 30.0,
            *shares, 0.01 * shares[0], 0.05, 0.005 * shares[1], 0.0,
        )  # fmt: skip
        assert_allclose(row["demand"], apart.one_before_two, rtol=1e-12)
        assert_allclose(row["demand_two_sided"], apart.largest, rtol=1e-12)
        linear = per_obspy.risk_table(weaker, make_pairs([{}])).iloc[0]["demand"]
        assert abs(row["demand"] / linear - 1.0) > 0.05

    def test_is_the_gap_from_which_the_history_has_no_impact(self, weaker):
        demand = per_obspy.risk_table(weaker, make_pairs([ROW])).iloc[0]["demand"]
        gaps = [{**ROW, "gap": share * demand} for share in (1.0 - 1e-9, 1.0 + 1e-9)]
        table = per_obspy.risk_table(weaker, make_pairs(gaps)).sort_values("pair_id")
        assert_array_equal(table["impacts"] > 0, [True, False])
        # without an impact the radii are those without contact: the yielding ones
        assert_allclose(
            table[["amplification_exact_1", "amplification_exact_2"]].iloc[1], 1.0, rtol=1e-9
        )

    def test_does_not_decide_where_the_azimuth_is_unknown(self, weaker):
        row = per_obspy.risk_table(weaker, make_pairs([{**ROW, "azimuth": np.nan}])).iloc[0]
        assert row["demand_rule"] != "exact"
