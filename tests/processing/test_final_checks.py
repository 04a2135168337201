import numpy as np
from numpy.testing import assert_allclose
from obspy import Trace

from per_obspy.config import Checks
from per_obspy.processing.motion_checks import AT_REST, final_findings, integrate

DT = 0.01


def trace(samples):
    return Trace(
        np.asarray(samples, dtype=float), {"delta": DT, "quantity": "acceleration", "units": "m/s2"}
    )


def test_a_constant_acceleration_gives_a_line_and_a_parabola():
    given = trace(np.full(101, 3.0))
    velocity = integrate(given)
    displacement = integrate(velocity)
    # the trapezoidal rule is exact for a constant, and for a line
    time = np.arange(101) * DT
    assert_allclose(velocity.data, 3 * time, rtol=1e-12)
    assert_allclose(displacement.data, 1.5 * time**2, rtol=1e-12)
    assert (displacement.stats.quantity, displacement.stats.units) == ("displacement", "m")
    assert (given.stats.quantity, given.stats.units) == ("acceleration", "m/s2")


def test_a_motion_that_comes_to_rest_is_fine():
    time = np.arange(1001) * DT
    rest = np.gradient(np.gradient(np.exp(-((time - 5) ** 2)), DT), DT)
    assert final_findings(trace(rest), Checks()) == []


def test_a_motion_that_goes_on_is_found_with_its_figures():
    found = [
        finding
        for finding in final_findings(trace(np.ones(1000)), Checks())
        if finding.check in AT_REST
    ]
    assert [(finding.check, finding.level) for finding in found] == [
        ("final_velocity", "reject"),
        ("final_displacement", "reject"),
    ]
    assert "over its peak: 1, allowed 0.1" in found[0].reason
