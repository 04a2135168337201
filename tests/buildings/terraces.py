"""Contacts of made-up rows, which the tests of their histories share."""

import numpy as np

#: Ground motion to the north and east, m/s², at 0.01 s: 20 s of two filtered noises.
DT = 0.01


def motion(seed=3, samples=2000):
    """Return north, east and the sampling interval."""
    noise = np.random.default_rng(seed).standard_normal((2, samples))
    window = np.hanning(samples)
    smooth = [np.convolve(part, np.hanning(21), "same") for part in noise]
    north, east = (2.0 * window * part / part.std() for part in smooth)
    return north, east, DT


def contacts(count, seed=5, **columns):
    """Return contacts of a row whose neighbouring pairs agree about their building."""
    generator = np.random.default_rng(seed)
    period = generator.uniform(0.3, 1.5, count + 1)
    mass = generator.uniform(1e5, 9e5, count + 1)
    # two participations per building: its contacts are at different heights
    share = generator.uniform(0.6, 1.4, (2, count))
    table = {
        "gap": generator.uniform(0.0, 0.02, count),
        "restitution": generator.uniform(0.4, 0.8, count),
        "contact_log_std": np.where(np.arange(count) % 2, 0.0, 0.1),
        "derived": np.full(count, "", dtype=object),
        "turned": np.zeros(count, dtype=bool),
        "period_1": period[:-1],
        "period_2": period[1:],
        "participation_1": share[0],
        "participation_2": share[1],
        "contact_mass_1": mass[:-1] / share[0] ** 2,
        "contact_mass_2": mass[1:] / share[1] ** 2,
    }
    for i in (1, 2):
        table[f"damping_{i}"] = np.full(count, 0.05)
        table[f"yield_displacement_{i}"] = np.full(count, np.inf)
        table[f"hardening_{i}"] = np.zeros(count)
        table[f"amplification_alone_{i}"] = np.full(count, np.nan)
    # the table has no history of the pairs
    table["impacts_alone"] = table["impact_velocity_alone"] = np.full(count, np.nan)
    return table | columns


def turned(table):
    """Return the same row read from its other end."""
    other = {"_1": "_2", "_2": "_1"}
    result = {}
    for name, column in table.items():
        result[name[:-2] + other[name[-2:]] if name[-2:] in other else name] = column[::-1]
    return result
