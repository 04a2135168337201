"""Arguments are refused with their name and the value, before any number is made of them."""

import numpy as np
import pytest

from per_obspy import checks


@pytest.mark.parametrize(
    ("check", "value", "message"),
    [
        (checks.finite, [1.0, np.nan], r"gap must be finite, got nan at index 1"),
        (checks.finite, np.inf, r"gap must be finite, got inf"),
        (checks.finite, "12", r"gap must be real numbers, got <U2"),
        (checks.finite, None, r"gap must be real numbers, got object"),
        (checks.finite, [1 + 2j], r"gap must be real numbers, got complex128"),
        (checks.positive, [[1.0, 2.0], [3.0, 0.0]], r"gap must be positive, got 0.0 at index 1, 1"),
        (checks.positive_or_infinite, np.nan, r"gap must be positive, got nan"),
        (checks.not_negative, -1e-300, r"gap must be zero or more, got -1e-300"),
        (checks.fraction_of_critical, 1.0, r"gap must be at least 0 and below 1, got 1.0"),
        (checks.record, [], r"gap must be one row of samples, got the shape \(0,\)"),
        (checks.record, [[1.0]], r"gap must be one row of samples, got the shape \(1, 1\)"),
    ],
)
def test_a_bad_value_is_named(check, value, message):
    with pytest.raises(ValueError, match=message):
        check("gap", value)


def test_masked_samples_are_refused_because_numpy_would_drop_the_mask():
    with pytest.raises(ValueError, match="acceleration has masked values"):
        checks.record("acceleration", np.ma.masked_equal([1.0, 2.0], 2.0))


def test_counts_are_numbers():
    assert checks.record("acceleration", np.array([1, 2], dtype=np.int32)).dtype == np.float64


def test_between_is_closed():
    assert checks.between("correlation", [-1, 1], -1, 1).tolist() == [-1.0, 1.0]
    with pytest.raises(ValueError, match=r"correlation must be between -1 and 1, got 1\.5"):
        checks.between("correlation", 1.5, -1, 1)


def test_a_single_number_is_wanted():
    assert checks.number("mass", 2, checks.positive) == 2.0
    with pytest.raises(ValueError, match=r"mass must be a single number, got the shape \(2,\)"):
        checks.number("mass", [1.0, 2.0], checks.positive)
