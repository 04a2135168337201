"""Many pairs at once: the histories of single pairs, limits, and independence of the batch."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.pounding import kernel_tables
from per_obspy.pounding.pair_histories import pounding_histories
from per_obspy.pounding.relative import relative_displacement
from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.structure import Structure
from per_obspy.spectra.elastic import per_spectrum

DT = 0.01


def shaking(seconds=8.0, seed=0):
    """Smoothed noise under an envelope, about 3 m/s²."""
    count = round(seconds / DT)
    noise = np.convolve(np.random.default_rng(seed).normal(size=count), np.ones(5) / 5, mode="same")
    return 6.0 * noise * np.sin(np.pi * np.arange(count) / count) ** 0.5


def pairs(count, seed=1, **more):
    """Random pairs, some so stiff that sampling intervals are cut."""
    random = np.random.default_rng(seed)
    drawn = {
        "period_1": random.uniform(0.04, 2.5, count), "damping_1": random.uniform(0.0, 0.2, count),
        "mass_1": random.uniform(0.2, 5.0, count), "period_2": random.uniform(0.1, 2.5, count),
        "damping_2": random.uniform(0.0, 0.2, count), "mass_2": random.uniform(0.2, 5.0, count),
        "gap": random.uniform(0.0, 0.1, count) * (random.uniform(size=count) > 0.2),
        "restitution": random.choice([0.0, 0.4, 0.65, 1.0], count),
    }  # fmt: skip
    return {**drawn, **more}


def yielding(count, seed=2):
    random, fields = np.random.default_rng(seed), {}
    for k in (1, 2):
        fields[f"yield_displacement_{k}"] = random.choice([0.01, 0.03, np.inf], count)
        fields[f"hardening_{k}"] = random.uniform(0.0, 0.2, count)
        fields[f"participation_{k}"] = random.uniform(0.8, 1.5, count)
    return fields


YIELDING = ("yield_displacement", "hardening", "participation")


def single(acceleration, fields, i, **keywords):
    """Return the history of pair i."""
    structures = [
        Structure(
            fields[f"period_{k}"][i], fields[f"damping_{k}"][i], fields[f"mass_{k}"][i],
            *(fields[f"{name}_{k}"][i] for name in YIELDING),
        )
        for k in (1, 2)
    ]  # fmt: skip
    return pounding_history(
        acceleration, DT, structures, fields["gap"][i], fields["restitution"][i], **keywords
    )


class TestAgainstSingleHistories:
    def test_short_window(self):
        # catches: a lane's coefficients not those of its phase, bounds that miss a contact or a
        # maximum
        acceleration, count = shaking(2.5), 64
        fields = pairs(count, **yielding(count))
        maxima = pounding_histories(acceleration, DT, **fields, free_vibration=False)
        for i in range(count):
            history = single(acceleration, fields, i, free_vibration=False)
            # few impacts; where bounces end early the states differ by about 1e-6 (omega dt)²
            tolerance = 1e-10 if len(history.impacts) < 8 else 1e-6
            assert_allclose(maxima.per[:, i], history.per, rtol=tolerance)
            assert_allclose(
                maxima.displacement_maxima[:, i], history.displacement_maxima, rtol=tolerance
            )
            if len(history.impacts) < 8:
                assert maxima.impacts[i] == history.impacts["counted"].sum()
            assert (maxima.impact_velocity[i] == 0.0) == (len(history.impacts) == 0)

    def test_pairs_with_a_gap_one_by_one(self):
        # catches: an impact missed, counted twice or out of time; one of the edge cases left to
        # other formulas
        acceleration, fields = shaking(), self.gap_pairs(32)
        maxima = pounding_histories(acceleration, DT, **fields)
        for i in range(32):
            history = single(acceleration, fields, i)
            # the required agreement
            assert_allclose(maxima.per[:, i], history.per, rtol=1e-9)
            assert_allclose(
                maxima.displacement_maxima[:, i], history.displacement_maxima, rtol=1e-9
            )
            assert maxima.impacts[i] == history.impacts["counted"].sum()
        # most of them pound, and more than once
        assert np.median(maxima.impacts) > 3

    @staticmethod
    def gap_pairs(count):
        """Return pairs with a gap, the first of them edge cases."""
        random = np.random.default_rng(8)
        fields = TestAgainstSingleHistories.linear_pairs(count)
        fields["gap"] = random.uniform(0.005, 0.05, count)
        for k in (1, 2):
            fields[f"damping_{k}"] = random.uniform(0.02, 0.1, count)
        # inelastic, elastic, a wall on either side, so stiff that intervals are cut, hardly a gap
        fields["restitution"][:2] = 0.0, 1.0
        fields["mass_1"][2] = fields["mass_2"][3] = math.inf
        fields["period_1"][4] = 0.04
        fields["gap"][5] = 1e-6
        # equal but for damping, yielding
        fields["period_2"][6] = fields["period_1"][6]
        fields["yield_displacement_1"][7:9] = fields["yield_displacement_2"][8:10] = 0.01
        return fields

    def test_first_impacts(self):
        # catches: an impact counted twice, an approach speed taken after the impact
        acceleration, fields = shaking(), self.linear_pairs(32)
        checked = 0
        for i in range(32):
            impacts = single(acceleration, fields, i, free_vibration=False).impacts
            if len(impacts) < 3:
                continue
            # a record cut after the third impact
            end = int(np.ceil(impacts["time"][2] / DT)) + 1
            alone = {name: values[i] for name, values in fields.items()}
            maxima = pounding_histories(acceleration[:end], DT, **alone, free_vibration=False)
            before = impacts[impacts["time"] <= (end - 1) * DT]
            approach = before["velocity_before_1"] - before["velocity_before_2"]
            assert maxima.impacts == (approach > max(0.001, 0.01 * approach.max())).sum()
            # three impacts' growth of rounding
            assert_allclose(maxima.impact_velocity, approach.max(), rtol=1e-9)
            checked += 1
        assert checked > 5

    @staticmethod
    def linear_pairs(count):
        """Return pairs of linear structures of one gap and restitution."""
        fields = pairs(count, seed=5, restitution=np.full(count, 0.65), gap=np.full(count, 0.04))
        for k in (1, 2):
            for name, value in zip(YIELDING, (np.inf, 0.0, 1.0), strict=True):
                fields[f"{name}_{k}"] = np.full(count, value)
        return fields


class TestLimits:
    def test_wide_gap_gives_the_spectrum(self):
        # catches: maxima as sampled, free vibration left out
        acceleration, fields = shaking(), pairs(40, gap=10.0)
        maxima = pounding_histories(acceleration, DT, **fields)
        for k in (0, 1):
            expected = []
            for i in range(40):
                period, damping = fields[f"period_{k + 1}"][i], fields[f"damping_{k + 1}"][i]
                expected += [*per_spectrum(np.append(acceleration, 0.0), DT, [period], damping)]
            # both are exact; the required agreement
            assert_allclose(maxima.per[k], expected, rtol=1e-9)
        assert_array_equal(maxima.impacts, 0)
        assert_array_equal(maxima.impact_velocity, 0.0)

    def test_critical_gap_decides(self):
        # catches: false contacts by the cubic bound, grazes missed between samples
        acceleration, fields = shaking(), pairs(100)
        fields["damping_1"] = fields["damping_2"] = np.full(100, 0.05)
        names = ("period_1", "damping_1", "period_2", "damping_2")
        critical = relative_displacement(
            acceleration, DT, *(fields[name] for name in names)
        ).one_before_two
        wide = pounding_histories(acceleration, DT, **{**fields, "gap": critical * (1 + 1e-9)})
        near = pounding_histories(acceleration, DT, **{**fields, "gap": critical * (1 - 1e-6)})
        assert_array_equal(wide.impact_velocity, 0.0)
        assert (near.impact_velocity > 0.0).all()

    def test_identical_touching_structures_do_not_pound(self):
        # catches: a force that is zero but for rounding taken for tension
        maxima = pounding_histories(
            shaking(), DT, [0.3, 1.0, 2.0], 0.05, 2.0, [0.3, 1.0, 2.0], 0.05, 2.0, 0.0, 0.5
        )
        assert_array_equal(maxima.impacts, 0)


class TestIndependenceOfTheBatch:
    def test_order_and_company_do_not_matter(self):
        # catches: one lane reading another's row, a remainder loop with other rounding, shared
        # scratch of threads
        acceleration, count = shaking(4.0), 75
        fields = pairs(count, **yielding(count))
        together = pounding_histories(acceleration, DT, **fields)
        order = np.random.default_rng(3).permutation(count)
        shuffled = pounding_histories(
            acceleration, DT, **{name: values[order] for name, values in fields.items()}
        )
        for whole, part in zip(together, shuffled, strict=True):
            assert_array_equal(whole[..., order], part)  # bit for bit
        for i in (0, 40, 74):
            alone = pounding_histories(
                acceleration, DT, **{name: values[i] for name, values in fields.items()}
            )
            for whole, part in zip(together, alone, strict=True):
                assert_array_equal(whole[..., i], part)

    def test_shapes_broadcast(self):
        maxima = pounding_histories(
            shaking(1.0), DT, [[0.5], [1.0]], 0.05, 1.0, 0.3, 0.05, 1.0, [0.01, 0.1, 1.0], 0.5
        )
        assert maxima.per.shape == maxima.displacement_maxima.shape == (2, 2, 3)
        assert maxima.impacts.shape == maxima.impact_velocity.shape == (2, 3)


class TestAzimuth:
    def test_projects_the_components(self):
        # catches: sine and cosine exchanged, degrees taken for radians
        north, east, fields = shaking(seed=1), shaking(seed=2), pairs(8)
        azimuth = np.arange(8) * 45.0
        maxima = pounding_histories([north, east], DT, **fields, azimuth=azimuth)
        for i, angle in enumerate(np.radians(azimuth)):
            along = north * np.cos(angle) + east * np.sin(angle)
            alone = pounding_histories(
                along, DT, **{name: values[i] for name, values in fields.items()}
            )
            first = alone.impacts < 8  # rounding of the projection grows with every impact
            assert_allclose(maxima.per[:, i], alone.per, rtol=1e-9 if first else 1.0)

    def test_reversal_exchanges_the_structures(self):
        # catches: anything that is not symmetric in 1 and 2
        north, fields = shaking(2.5), pairs(40, seed=9)
        swapped = {}
        for name, values in fields.items():
            other = name[:-1] + {"1": "2", "2": "1"}.get(name[-1], name[-1])
            swapped[other] = values
        once = pounding_histories(
            [north, 0 * north], DT, **fields, azimuth=0.0, free_vibration=False
        )
        back = pounding_histories(
            [north, 0 * north], DT, **swapped, azimuth=180.0, free_vibration=False
        )
        few = once.impacts < 6
        assert few.sum() > 10
        assert_allclose(
            back.per[::-1, few], once.per[:, few], rtol=1e-9
        )  # a few impacts' growth of rounding


class TestBadInput:
    def test_azimuth_and_components_go_together(self):
        with pytest.raises(ValueError, match="azimuth"):
            pounding_histories(shaking(1.0), DT, **pairs(2), azimuth=10.0)
        with pytest.raises(ValueError, match="acceleration"):
            pounding_histories([shaking(1.0), shaking(1.0)], DT, **pairs(2))

    def test_two_walls(self):
        with pytest.raises(ValueError, match="mass_1 and mass_2"):
            pounding_histories(shaking(1.0), DT, **{**pairs(2), "mass_1": np.inf, "mass_2": np.inf})


def chatter(restitution, speed, press=1.0):
    """Return the arguments of a structure that falls on a wall with a speed and stays pressed."""
    # So slow that it falls freely: its spring needs no part of the press
    fields = {"period_1": 1e4, "damping_1": 0.0, "mass_1": 1.0, "gap": 0.5 * speed**2 / press}
    wall = {"period_2": 1.0, "damping_2": 0.0, "mass_2": np.inf, "participation_2": 0.0}
    return np.full(600, -press), DT, {**fields, **wall, "restitution": restitution}


def geometric_count(restitution, speed):
    """Return how many of the speeds v, e v, e² v ... are above 1 mm/s and above 1 % of v."""
    least = max(0.001, 0.01 * speed)
    return max(0, math.ceil(math.log(least / speed) / math.log(restitution)))


class TestImpactCount:
    @pytest.mark.parametrize("restitution", [0.3, 0.65, 0.8])
    @pytest.mark.parametrize("speed", [0.5, 0.11, 0.03, 0.0011, 0.0009])
    def test_the_chatter_of_a_pressed_structure_is_geometric(self, restitution, speed):
        # catches: bounces counted down to rounding, one of the two limits left out
        record, dt, fields = chatter(restitution, speed)
        maxima = pounding_histories(record, dt, **fields, free_vibration=False)
        assert maxima.impacts == geometric_count(restitution, speed)
        # the spring takes a part of 2e-8 of the press; contact is known however slow it is
        assert_allclose(maxima.impact_velocity, speed, rtol=1e-6)
        # the list of a single history has them all, and marks the same
        structures = Structure(1e4, 0.0, 1.0), Structure(1.0, 0.0, np.inf, participation=0.0)
        history = pounding_history(
            record, dt, structures, fields["gap"], restitution, free_vibration=False
        )
        assert history.impacts["counted"].sum() == maxima.impacts
        assert len(history.impacts) > maxima.impacts + 5

    def test_a_stronger_ground_has_as_many(self):
        # catches: a limit that is no share of the fastest. Powers of two scale without rounding
        fields = pairs(64, gap=0.0, restitution=0.65)
        once = pounding_histories(64.0 * shaking(), DT, **fields)
        more = pounding_histories(256.0 * shaking(), DT, **fields)
        moving = once.impact_velocity > 0.1  # 1 % is then above 1 mm/s
        assert moving.sum() > 50
        assert_array_equal(more.impacts[moving], once.impacts[moving])

    def test_a_weaker_ground_has_fewer(self):
        fields = pairs(64, gap=0.0, restitution=0.65)
        strong = pounding_histories(shaking(), DT, **fields)
        weak = pounding_histories(shaking() / 64.0, DT, **fields)
        assert (weak.impacts <= strong.impacts).all()
        assert weak.impacts.sum() < 0.9 * strong.impacts.sum()
        # impacts that do not count remain contact
        assert_array_equal(weak.impact_velocity > 0.0, strong.impact_velocity > 0.0)
        assert ((weak.impacts == 0) == (weak.impact_velocity <= 0.001)).all()

    def test_single_histories_count_alike(self):
        # catches: limits of all pairs of a block, or of a row instead of each gap
        fields = pairs(24, restitution=np.full(24, 0.5)) | yielding(24)
        maxima = pounding_histories(shaking(3.0), DT, **fields, free_vibration=False)
        several = 0
        for i, impacts in enumerate(maxima.impacts):
            listed = single(shaking(3.0), fields, i, free_vibration=False).impacts
            speed = listed["velocity_before_1"] - listed["velocity_before_2"]
            least = max(0.001, 0.01 * speed.max()) if len(listed) else 0.0
            assert impacts == (speed > least).sum() == listed["counted"].sum()
            several += impacts > 3
        assert several > 5

    def test_room_for_impacts_grows(self, monkeypatch):
        # catches: impacts beyond the first room lost, a second run that goes on from the first
        fields = pairs(40, gap=0.0) | yielding(40)
        expected = pounding_histories(shaking(), DT, **fields)
        assert expected.impacts.max() > 20
        monkeypatch.setattr(kernel_tables, "FIRST_ROOM", 1)
        for found, value in zip(pounding_histories(shaking(), DT, **fields), expected, strict=True):
            assert_array_equal(found, value)
