"""Published repairs of baselines that shift during the shaking, for comparison."""

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from per_obspy.processing.filter.baseline import boore_segments
from per_obspy.processing.filter.baseline_spread import Shaking, without_drift

Array = NDArray[np.float64]

#: Trials of t2 between t3 and the last fraction of the record.
TRIALS, LATEST = 15, 0.85

#: Samples of the displacement of which one is used for its flatness.
THIN = 10


def wu_wu(samples: Array, dt: float, shaking: Shaking) -> Array:
    """
    Return the record repaired with t1 at the onset and t3 at the end of the shaking.

    Wu & Wu 2007, J. Seismol. 11, 159-170, choose both by eye.
    """
    return _flattest(samples, dt, [shaking.onset], [shaking.end])


def chao(samples: Array, dt: float, shaking: Shaking) -> Array:
    """
    Return the record repaired with t1 and t3 at 25 % and 65 % of the energy.

    Chao, Wu & Zhao 2010, J. Seismol. 14, 495-504.
    """
    first, third = _times_of_energy(samples, dt, shaking, (0.25, 0.65))
    return _flattest(samples, dt, [first], [third])


def ebasco(samples: Array, dt: float, shaking: Shaking) -> Array:
    """
    Return the flattest of the records repaired with several t1 and t3.

    After D'Amico and others 2018 and Schiappapietra and others 2021, Geosciences 11, 67: three
    straight lines of the velocity, of which the second joins the others.
    """
    times = _times_of_energy(samples, dt, shaking, (0.05, 0.25, 0.5, 0.75, 0.95))
    return _flattest(samples, dt, [shaking.onset, *times[:2]], times[2:])


REPAIRS: dict[str, Callable[[Array, float, Shaking], Array]] = {
    "Wu & Wu 2007": wu_wu,
    "Chao and others 2010": chao,
    "eBASCO": ebasco,
}


def _times_of_energy(
    samples: Array, dt: float, shaking: Shaking, shares: Iterable[float]
) -> list[float]:
    """Return the times at which the energy after the onset reaches shares of the whole, s."""
    fast = without_drift(samples, dt)
    fast[: round(shaking.onset / dt)] = 0.0
    energy = np.cumsum(fast**2)
    return [float(np.searchsorted(energy, share * energy[-1]) * dt) for share in shares]


def _flattest(samples: Array, dt: float, firsts: list[float], thirds: list[float]) -> Array:
    """Return the correction by two shifts, t2 after t3, whose final displacement is flattest."""
    latest = LATEST * samples.size * dt
    best, flattest = samples, 0.0
    for first in firsts:
        for third in thirds:
            # t2 from t3 on, at least a second after t1
            for second in np.linspace(third, max(latest, third), TRIALS):
                if second < first + 1.0 or second > latest:
                    continue
                corrected = boore_segments(samples, dt, first, float(second))
                flatness = _flatness(corrected, dt, third)
                if flatness > flattest:
                    best, flattest = corrected, flatness
    return best


def _flatness(corrected: Array, dt: float, third: float) -> float:
    """Return |r| / (|b| s²) of the displacement after t3: its correlation, slope and variance."""
    velocity = cumulative_trapezoid(corrected, dx=dt, initial=0)
    displacement = cumulative_trapezoid(velocity, dx=dt, initial=0)[round(third / dt) :: THIN]
    time = np.arange(displacement.size) * dt * THIN
    # Slope of the straight line through it
    slope = np.polyfit(time, displacement, 1)[0]
    correlation = np.corrcoef(time, displacement)[0, 1]
    return float(abs(correlation) / (abs(slope) * displacement.var()))
