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


def write_curve(path, period, years=50.0, sites=((20.0, 10.0),), kind="mean", ordinate=None):
    """Write the hazard curve of one period, or of PGA (0), of the spectra of ``write_hazard``."""
    ordinate = 0.05 / period if ordinate is None else ordinate
    levels = ordinate * (RATES / 0.01) ** (-1 / EXPONENT)
    chances = -np.expm1(-RATES * years)
    # Beyond both ends: an intensity that is surely exceeded, and one that never is
    levels, chances = [levels[0] / 2, *levels, 2 * levels[-1]], [1.0, *chances, 0.0]
    measure = f"SA({period})" if period else "PGA"
    head = f"#,,,\"generated_by='OpenQuake engine', kind='{kind}', investigation_time={years}, "
    rows = [",".join(map(repr, [east, north, 0.0, *map(float, chances)])) for east, north in sites]
    names = ",".join(["lon", "lat", "depth", *(f"poe-{level!r}" for level in map(float, levels))])
    path.write_text("\n".join([f"{head}imt='{measure}'\"", names, *rows]) + "\n")
    return path


def write_curves(folder, periods=PERIODS):
    folder.mkdir(exist_ok=True)
    for period in periods:
        write_curve(folder / f"hazard_curve-mean-SA({period})_12.csv", period)
    return folder


def write_shape(path, shortest=0.04, damping=0.05):
    periods = [shortest, *PERIODS]
    rows = [f"{period},{damping},{7.0 / max(period, 0.1)}" for period in periods]
    path.write_text("\n".join(["period,damping,psa", *rows]) + "\n")
    return path


def test_curves_and_a_shape_give_what_spectra_give(tmp_path):
    # one power law, written as spectra, as curves of every period, and as one curve whose shape is
    # known; would catch a wrong time, unit, order or anchor
    rows = [{"gap": gap, "period_1": 0.7} for gap in (0.0, 0.02, 0.1)]
    expected, _ = screened(read_hazard(write_hazard(tmp_path / "h.csv")), rows)
    shape, one, peak = write_shape(tmp_path / "s.csv"), tmp_path / "one.csv", tmp_path / "pga.csv"
    for hazard in (
        read_hazard(write_curves(tmp_path / "curves")),
        read_hazard(write_curve(one, 1.0, years=1.0), shape),
        read_hazard(write_curve(peak, 0, ordinate=0.05 / 0.1), shape),
    ):
        table, rejected = screened(hazard, rows)
        assert not rejected
        for name in ("annual_probability", "gap_for_target", "demand"):
            # ends of the rates by one rounding more
            assert_allclose(table[name], expected[name], rtol=1e-6)


def test_forms_of_curves_that_are_no_fault(tmp_path):
    expected = read_hazard(write_curves(tmp_path / "curves"))
    folder = tmp_path / "curves"
    for number, file in enumerate(sorted(folder.iterdir())):
        head, names, row = file.read_text().splitlines()
        # columns in another order, names of sites, a site twice, equal chances of weak motions
        weak = names.split(",")[3]
        names = f"custom_site_id,poe-1e-7,{','.join(names.split(',')[::-1])}"
        row = f"a,{1.0},{','.join(row.split(',')[::-1])}"
        assert weak in names
        file.write_text("\n".join([head, names, row, row] if number else [head, names, row]) + "\n")
    # other kinds, other measures and other files
    write_curve(folder / "quantile.csv", 1.0, kind="quantile-0.85", ordinate=0.3)
    write_curve(folder / "std.csv", 1.0, kind="std", ordinate=0.3)
    write_hazard(folder / "uhs.csv")
    (folder / "notes.csv").write_text("a,b\n1,2\n")
    found = read_hazard(folder)
    for name in ("longitude", "latitude", "rates", "periods", "sd"):
        assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-12)


def test_a_site_without_a_curve_is_no_pair_without_risk(tmp_path):
    # far from every source all probabilities are 0: would catch a site that serves no motion at all
    folder = write_curves(tmp_path / "curves")
    for file in folder.iterdir():
        text = file.read_text()
        cells = len(text.splitlines()[1].split(",")) - 3
        file.write_text(f"{text}30.0,10.0,0.0{',0.0' * cells}\n")
    hazard = read_hazard(folder)
    assert np.isnan(hazard.rates[1]).all()
    there = {"longitude_1": 30.0, "longitude_2": 30.0001}
    table, rejected = screened(hazard, [{}, there])
    assert list(table.index) == ["P0"]
    assert "outside the nearest site's no rates" in rejected[0].reasons[0]


SECOND = "c/hazard_curve-mean-SA(1.0)_12.csv"


@pytest.mark.parametrize(
    ("file", "old", "new", "reason"),
    [
        (SECOND, "poe-", "iml-", "no hazard curve"),
        (SECOND, "SA(1.0)", "SA(0.5)", "one measure twice, in haz"),
        (
            SECOND,
            "\n20.0",
            "\n21.0",
            "has other sites than hazard_curve-mean-SA(0.5)",
        ),
        (
            SECOND,
            "kind='mean'",
            "kind='rlz-001'",
            "one measure is no",
        ),
        (SECOND, ",1.0,", ",nan,", "site 1: a probability is missing or not 0"),
        (SECOND, ",1.0,", ",1.5,", "site 1: a probability is missing or not 0"),
        (SECOND, ",1.0,", ",0.5,", "site 1: the probability grows"),
        (SECOND, "poe-0.0", "poe--0.0", "needs two intensities"),
        (
            SECOND,
            "investigation_time=50.0",
            "investigation_time=0",
            "no inv",
        ),
        ("one.csv", "kind='mean'", "kind='std'", "a deviation and no hazard"),
        ("one.csv", "imt='SA(1.0)'", "imt='PGV'", "needs imt='PGA'"),
        ("one.csv", "", "", "one measure is no spectrum: give curves"),
    ],
)
def test_damaged_curves(tmp_path, file, old, new, reason):
    write_curves(tmp_path / "c", (0.5, 1.0))
    write_curve(tmp_path / "one.csv", 1.0)
    path = tmp_path / file
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    given = path if file == "one.csv" else path.parent
    if reason == "no hazard curve":  # one measure is left
        reason = "one measure is no spectrum"
    with pytest.raises(CatalogError, match=re.escape(reason)):
        read_hazard(given)


def test_a_shape_that_does_not_fit(tmp_path):
    shape, uhs = write_shape(tmp_path / "s.csv"), write_hazard(tmp_path / "h.csv")
    peak = write_curve(tmp_path / "pga.csv", 0, ordinate=0.5)
    long = write_curve(tmp_path / "long.csv", 5.0)
    for hazard, given, reason in (
        (uhs, shape, "is of spectra, which need no shape"),
        (write_curves(tmp_path / "c"), shape, "is for one measure, there are 5"),
        (peak, write_shape(tmp_path / "t.csv", shortest=0.06), "no ordinate for the curve of PGA"),
        (long, shape, r"no ordinate for the curve of SA\(5\)"),
        (peak, write_shape(tmp_path / "u.csv", damping=0.02), "needs a damping of 0.05"),
    ):
        with pytest.raises(CatalogError, match=reason):
            read_hazard(hazard, given)
