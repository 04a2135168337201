"""Spectra from files: both quantities, no extrapolation, and a reason for every fault."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from per_obspy.errors import CatalogError
from per_obspy.screening.design import design_motion, read_design_spectrum

PERIODS = [0.1, 0.5, 1.0, 4.0]


def _displacement(spectrum, period, damping):
    """Return SD of oscillators, m."""
    columns = {"period": period, "damping": damping}
    table = {f"{name}_{i}": np.array(column) for name, column in columns.items() for i in (1, 2)}
    return design_motion(spectrum, pd.DataFrame(table)).sd[0]


@pytest.fixture
def write(tmp_path):
    def write(text, name="spectrum.csv"):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return write


def _csv(quantity, value):
    """Return a spectrum at 2 and 5 % with values of a function of period and damping, unsorted."""
    rows = [f"{T},{xi},{value(T, xi)!r}" for xi in (0.05, 0.02) for T in PERIODS[::-1]]
    return "\n".join(["# a comment", f"period,damping,{quantity}", *rows])


def test_pseudo_acceleration_is_displacement_times_frequency_squared(write):
    # would catch: a frequency in place of the circular one, rows that are not sorted
    sd = read_design_spectrum(write(_csv("sd", lambda T, _: 0.1 * T)))
    psa = read_design_spectrum(write(_csv("psa", lambda T, _: 0.1 * T * (2 * np.pi / T) ** 2)))
    assert_allclose(psa.sd, sd.sd, rtol=1e-14)
    assert sd.periods.tolist() == PERIODS
    assert sd.dampings.tolist() == [0.02, 0.05]
    assert_allclose(sd.sd, 0.1 * np.array([PERIODS, PERIODS]), rtol=1e-14)


def test_branches_of_a_code_are_met_between_their_ends(write):
    # constant velocity (SD ~ T), reduced with damping as a power; would catch linear interpolation,
    # which is too large between the ends of such curves, and dampings taken in the wrong order
    text = _csv("sd", lambda T, xi: 0.1 * T**1.5 * (0.05 / xi) ** 0.4)
    spectrum = read_design_spectrum(write(text))
    period, damping = np.array([0.1, 0.3, 0.7, 4.0, 2.0]), np.array([0.02, 0.03, 0.05, 0.02, 0.04])
    expected = 0.1 * period**1.5 * (0.05 / damping) ** 0.4
    assert_allclose(_displacement(spectrum, period, damping), expected, rtol=1e-13)


def test_one_damping_serves_itself_only(write):
    spectrum = read_design_spectrum(write("period,damping,sd\n0.1,0.05,0.01\n1.0,0.05,0.1\n"))
    displacement = _displacement(spectrum, [0.1, 1.0], [0.05, 0.05])
    assert_allclose(displacement, [0.01, 0.1], rtol=1e-14)


FAULTS = {
    "both quantities": ("period,damping,sd,psa\n1,0.05,0.1,3.9\n", "either sd or psa"),
    "no damping": ("period,sd\n1,0.1\n", "has period, sd"),
    "text": ("period,damping,sd\n1,0.05,big\n", "sd = big m in row 1: must be a positive number"),
    "an empty cell": (
        "period,damping,sd\n1,0.05,\n",
        "sd = nan m in row 1: must be a positive number",
    ),
    "a period of 0": (
        "period,damping,sd\n0,0.05,0.1\n",
        "period = 0 s in row 1: must be a positive number",
    ),
    "per cent": (
        "period,damping,sd\n1,5,0.1\n2,5,0.1\n",
        "damping = 5 of critical in row 1: in other units?",
    ),
    "gal": (
        "period,damping,psa\n1,0.05,980\n2,0.05,500\n",
        "psa = 980 m/s2 in row 1: in other units?",
    ),
    "millimetres": (
        "period,damping,sd\n1,0.05,98\n2,0.05,98\n",
        "sd = 98 m in row 1: in other units?",
    ),
    "a row twice": (
        "period,damping,sd\n1,0.05,0.1\n1,0.05,0.2\n",
        "period = 1, damping = 0.05 occurs twice",
    ),
    "a hole": (
        "period,damping,sd\n1,0.05,0.1\n2,0.05,0.2\n1,0.02,0.1\n",
        "every damping needs the same periods",
    ),
    "one period": ("period,damping,sd\n1,0.05,0.1\n", "at least two"),
    "no row": ("period,damping,sd\n", "has no row"),
    "a negative value": (
        "period,damping,sd\n1,0.05,0.1\n2,0.05,-0.2\n",
        "sd = -0.2 m in row 2: must be a positive number",
    ),
    "milliseconds": (
        "period,damping,sd\n100,0.05,0.1\n2000,0.05,0.2\n",
        "period = 2000 s in row 2: in other units?",
    ),
    "semicolons": ("period;damping;sd\n1;0,05;0,1\n", "columns are separated by semicolons"),
    "a ragged row": (
        "period,damping,sd\n1,0.05,0.1\n2,0.05,0.2,3\n",
        "cannot be read as CSV: .*line 3",
    ),
    "a PDF document": ("%PDF-1.4\n", "not a CSV table: it is a PDF document"),
    "nothing": ("", "not a CSV table: it is an empty file"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_named(write, fault):
    text, message = FAULTS[fault]
    with pytest.raises(CatalogError, match=r"spectrum\.csv: .*" + message.replace("?", r"\?")):
        read_design_spectrum(write(text))


def test_an_absent_file_is_named(tmp_path):
    with pytest.raises(CatalogError, match=r"absent\.csv: cannot be read as CSV"):
        read_design_spectrum(tmp_path / "absent.csv")


def test_a_line_that_would_take_all_memory_is_refused(tmp_path):
    # a header of many columns takes a kilobyte of memory for each
    (tmp_path / "wide.csv").write_text("period,damping,sd" + "," * 20_000 + "\n1,0.05,0.1\n")
    with pytest.raises(CatalogError, match=r"wide\.csv: has a line of 10000 characters or more"):
        read_design_spectrum(tmp_path / "wide.csv")
