"""Pairs under a hazard: laws of Poisson and Cornell, monotone gaps, and files of OpenQuake."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_less
from screening_samples import make_pairs

from per_obspy.config import Building, Screening
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.errors import CatalogError
from per_obspy.pounding.reliability import sd_error
from per_obspy.screening.design import DesignSpectrum, design_table
from per_obspy.screening.hazard import hazard_table, shares_of_rates
from per_obspy.screening.hazard_files import read_hazard

#: Rates of the spectra, 1/year, falling, and the exponent of the hazard: SA grows as rate^(-1/2.5).
RATES, EXPONENT = np.geomspace(0.1, 1e-5, 9), 2.5
PERIODS = (0.1, 0.5, 1.0, 2.0, 4.0)


def write_hazard(path, rates=RATES, years=50.0, scale=1.0, sites=((20.0, 10.0),)):
    """Write spectra of 0.05 g / T at a rate of 0.01 per year as OpenQuake does."""
    chances = -np.expm1(-rates * years)
    names = [f"{chance:.12e}~{imt}" for chance in chances for imt in ("PGA", *map(sa, PERIODS))]
    values = [
        str(0.05 * scale * (rate / 0.01) ** (-1 / EXPONENT) / period)
        for rate in rates
        for period in (0.5, *PERIODS)
    ]
    head = f"#,,,\"generated_by='OpenQuake engine', kind='mean', investigation_time={years}\""
    rows = [",".join([str(east), str(north), *values]) for east, north in sites]
    path.write_text("\n".join([head, ",".join(["lon", "lat", *names]), *rows]) + "\n")
    return path


def sa(period):
    return f"SA({period})"


#: A pair of given oscillators, of which only the motion and the estimate are uncertain.
GIVEN = {
    **dict.fromkeys(("damping_1", "damping_2"), 0.05),
    **dict.fromkeys(("participation_1", "participation_2"), 1.0),
}


def screened(hazard, rows, target=1 / 475):
    pairs = make_pairs([{**GIVEN, **row} for row in rows])
    table = hazard_table(hazard, pairs, Building(), Screening(), target)
    return table.set_index("pair_id").sort_index(), table.attrs["rejected"]


def test_the_rate_of_a_certain_contact_is_that_of_the_first_motion(tmp_path):
    # Poisson: touching buildings pound in every motion, once in ten years and more
    table, _ = screened(read_hazard(write_hazard(tmp_path / "h.csv")), [{"gap": 0.0}])
    assert_allclose(table["annual_probability"], 1 - np.exp(-0.1), rtol=1e-6)
    assert table["annual_probability_bound"].tolist() == ["at least"]


def test_a_power_law_hazard_against_cornell(tmp_path):
    # with rate = k x^-b and a lognormal demand of deviation s the rate of contact is that of the
    # median demand times exp(b^2 s^2 / 2); would catch a rate that is lost at either end
    hazard = read_hazard(write_hazard(tmp_path / "h.csv"))
    table, _ = screened(hazard, [{"gap": 0.04}], target=0.01)
    row = table.iloc[0]
    error = sd_error(1.0, 0.05, 0.6, 0.05)
    median = 0.01 * (row["demand"] / error.median / 0.04) ** EXPONENT
    expected = median * np.exp(EXPONENT**2 * error.log_std**2 / 2)
    # derived deviations of periods and dampings are none here but those of a given value; steps of
    # 1.3 in the rate
    assert_allclose(-np.log1p(-row["annual_probability"]), expected, rtol=0.1)


def test_the_gap_for_a_target_has_its_rate(tmp_path):
    hazard = read_hazard(write_hazard(tmp_path / "h.csv"))
    first, _ = screened(hazard, [{"gap": 0.01, "gap_std": 0.0}])
    needed = float(first["gap_for_target"].iloc[0])
    again, _ = screened(hazard, [{"gap": needed, "gap_std": 0.0}])
    # interpolated among 41 gaps in steps of 12 %
    assert_allclose(-np.log1p(-again["annual_probability"]), 1 / 475, rtol=0.02)
    assert_allclose(again["gap_for_target"], needed, rtol=1e-9)
    assert_allclose(first["missing_gap_for_target"], needed - 0.01, rtol=1e-9)


def test_wider_gaps_rarer_targets_and_stronger_motions(tmp_path):
    hazard = read_hazard(write_hazard(tmp_path / "h.csv"))
    gaps = [{"gap": gap, "gap_std": 0.0} for gap in (0.005, 0.01, 0.03, 0.05, 0.1)]
    table, _ = screened(hazard, gaps)
    assert_array_less(np.diff(table["annual_probability"]), 0.0)
    rarer, _ = screened(hazard, gaps[:1], target=1e-4)
    assert rarer["gap_for_target"].iloc[0] > table["gap_for_target"].iloc[0]
    # the same probabilities in half the years are twice the rates: a factor of 2^(1/b) of gaps
    strong = read_hazard(write_hazard(tmp_path / "s.csv", scale=2.0 ** (1 / EXPONENT)))
    doubled, _ = screened(strong, gaps[:1], target=2 / 475)
    assert_allclose(doubled["gap_for_target"], table["gap_for_target"].iloc[0], rtol=0.01)
    # and twice the motion is twice the gap
    twice, _ = screened(read_hazard(write_hazard(tmp_path / "t.csv", scale=2.0)), gaps[:1])
    assert_allclose(twice["gap_for_target"], 2.0 * table["gap_for_target"].iloc[0], rtol=1e-6)


def test_the_demand_is_that_of_the_spectrum_of_the_target_rate(tmp_path):
    table, _ = screened(read_hazard(write_hazard(tmp_path / "h.csv")), [{}], target=0.01)
    sd = 0.05 / np.array(PERIODS) * STANDARD_GRAVITY * (np.array(PERIODS) / 2 / np.pi) ** 2
    spectrum = DesignSpectrum("h", np.array(PERIODS), np.array([0.05, 0.1]), np.stack([sd, sd]))
    expected = design_table(spectrum, make_pairs([GIVEN]), Building(), Screening())
    assert_allclose(table["demand"], expected["demand"], rtol=1e-9)


def test_pairs_far_from_every_site_or_outside_the_periods_are_rejected(tmp_path):
    hazard = read_hazard(write_hazard(tmp_path / "h.csv", sites=((20.0, 10.0), (30.0, 10.0))))
    far = {"latitude_1": 11.0, "latitude_2": 11.0}
    table, rejected = screened(hazard, [{}, far, {"period_1": 5.0}])
    assert list(table.index) == ["P0"]
    reasons = [row.reasons[0] for row in rejected]
    assert [reason.split(" is ")[0] for reason in reasons] == [
        "nearest site of the hazard",
        "period_1 = 5 s",
    ]
    with pytest.raises(CatalogError, match=r"target_rate = 0\.5 is outside its 1e-05"):
        screened(hazard, [{}], target=0.5)


def test_motions_share_all_rates():
    shares = shares_of_rates(np.array([0.1, 0.03, 0.001]))
    # a contact in every motion is as frequent as the first, one in the rarest alone half as
    # frequent as both of the last together
    assert_allclose(shares.sum(), 0.1, rtol=1e-12)
    assert_allclose(shares[-1], 0.0155, rtol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("investigation_time=50.0", "kind=1", "has no investigation_time"),
        ("lon,", "east,", "needs lon, lat"),
        ("~SA(0.5)", "~SB(0.5)", None),
        ("\n20.0,10.0", "\n200.0,10.0", "site 1: lon, lat"),
        ("\n20.0,10.0", "\n20.0,x", "site 1: lon, lat"),
        ("\n20.0,10.0,", "\n20.0,10.0,1,", "more fields than its header"),
        (
            "0.1990535852767486",
            "-0.199",
            "site 1: SA must be above 0 and plausible, in g (got -0.199)",
        ),
        ("~PGA", "~SA(0.1)", "SA as 0.1~SA(0.5) once at two"),
    ],
)
def test_a_damaged_file(tmp_path, old, new, reason):
    path = write_hazard(tmp_path / "h.csv")
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    if reason is None:  # a measure less is no fault
        assert read_hazard(path).periods.size == len(PERIODS) - 1
        return
    with pytest.raises(CatalogError, match=re.escape(reason)):
        read_hazard(path)


def test_two_spectra_of_one_place_are_refused(tmp_path):
    # would catch a mean and a quantile in one file, of which the first row would decide
    path = write_hazard(tmp_path / "h.csv", sites=((20.0, 10.0), (20.0, 10.0)))
    assert read_hazard(path).longitude.size == 2
    *rows, last = path.read_text().splitlines()
    path.write_text("\n".join([*rows, last.replace("0.1990535852767486", "0.19")]))
    with pytest.raises(CatalogError, match="site 2: has other values"):
        read_hazard(path)
