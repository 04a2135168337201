"""Every function of pairs and of their prevention refuses bad numbers, and names the argument."""

import inspect

import numpy as np
import pytest

import per_obspy
from per_obspy.pounding.correlation import directional_correlation, worst_azimuth
from per_obspy.pounding.relative import (
    approach,
    directional_relative_displacement,
    yielding_approach,
    yielding_relative_displacement,
)
from per_obspy.pounding.structure import Structure

RECORD = [0.0, 1.0, -1.0, 0.0]
LEFT, RIGHT, YIELDS = Structure(1.5, 0.05, 4e5), Structure(0.6, 0.02, 1e5), Structure(1, 0.05, 1, 1)
WHITE = per_obspy.WhiteNoise(0.01)

#: Good numbers, and one that is out of range, of arguments without their 1 or 2.
NUMBERS = {
    "period": (1.0, 0.0), "damping": (0.05, -0.1),
    "damping_1": (0.05, 1.0), "damping_2": (0.05, 1.0), "mass": (2.0, -1.0), "per": (0.3, -1.0),
    "correlation": (0.5, 1.5), "gap": (0.2, -0.1), "critical_gap": (0.5, -0.1),
    "restitution": (0.5, 1.01), "participation": (1.0, -1.0), "yield_displacement": (0.1, 0.0),
    "hardening": (0.1, 1.0), "dt": (0.01, 0.0), "azimuth": (10.0, np.inf), "target": (1.2, 0.9),
    "velocity": (1.0, np.inf), "dispersion": (0.4, -0.1), "dispersion_correlation": (0.5, 1.2),
    "model_dispersion": (0.1, -1.0), "gap_dispersion": (0.1, -1.0), "stiffness": (4e8, -1.0),
    "viscosity": (1.0, -1.0), "shortest_period": (0.5, 0.0), "yield_force": (1.0, 0.0),
    "share": (1.0, -1.0), "largest": (0.2, 0.0), "ductility": (2.0, 0.0), "peak_factor": (3.0, 0.0),
    "intensity": (0.1, 0.0), "frequency": (10.0, 0.0), "duration": (20.0, -1.0),
    "low_frequency": (1.0, 0.0), "low_damping": (0.6, 0.0), "gaps": (0.01, -0.1),
    "acceleration": (RECORD, [0.0, np.nan]), "north": (RECORD, []), "east": (RECORD, [[1.0]]),
}  # fmt: skip
OTHERS = {
    "structures": [LEFT, RIGHT], "structure_1": LEFT, "structure_2": RIGHT, "ground": WHITE,
    "method": "iwan", "azimuths": [[0.0]], "psd": [1.0, 1.0], "frequencies": [0.0, 100.0],
}  # fmt: skip
NAMES = """
    critical_gap srss_gap absolute_gap ddc_correlation record_correlation psd_correlation
    ground_correlation post_impact_velocities transfer_energies single_hit required_restitution
    required_gap kelvin_voigt_restitution kelvin_voigt_damping jankowski_damping
    mahmoud_jankowski_damping bumper_restitution pounding_probability pounding_histories
    pounding_history relative_displacement linked_history kelvin_voigt_history
    hertz_damp_history supplemental_damping equivalent_linear ductility_correlation
    davenport_peak_factor WhiteNoise KanaiTajimi CloughPenzien Structure
"""
FUNCTIONS = [
    *(getattr(per_obspy, name) for name in NAMES.split()),
    directional_correlation, directional_relative_displacement, approach, worst_azimuth,
    yielding_approach, yielding_relative_displacement,
]  # fmt: skip


def numbers_of(name):
    """Return a good and a bad number of an argument."""
    return NUMBERS.get(name) or NUMBERS[name.rstrip("_12")]


def cases():
    """Yield each function with good arguments, and with one that is bad."""
    for function in FUNCTIONS:
        names = [name for name in inspect.signature(function).parameters if name not in SWITCHES]
        good = {name: OTHERS.get(name) or numbers_of(name)[0] for name in names}
        if function in (yielding_approach, yielding_relative_displacement):
            good["acceleration"] = [RECORD, RECORD]
        elif function is per_obspy.pounding_histories:
            del good["azimuth"]
        for name in sorted(good.keys() - OTHERS.keys()):
            for value in (np.nan, numbers_of(name)[1]):
                yield pytest.param(function, good, name, value, id=f"{function.__name__}-{name}")


SWITCHES = ("tension", "free_vibration")


@pytest.mark.parametrize(("function", "good", "name", "value"), list(cases()))
def test_a_bad_number_is_refused_by_the_name_of_its_argument(function, good, name, value):
    # mutation: a check left out, the name of structure 1 for structure 2
    if name == min(good.keys() - OTHERS.keys()):
        function(**good)
    with pytest.raises(ValueError, match=rf"\b{name} (must|adds)"):
        function(**{**good, name: value})


PAIR = 1.0, 0.05, 1.0, 0.05


@pytest.mark.parametrize(("message", "call"), [
    ("both infinite", lambda: per_obspy.post_impact_velocities(1, 0, np.inf, np.inf, 0.5)),
    ("both infinite", lambda: per_obspy.transfer_energies(1, 0, np.inf, np.inf, 0.5)),
    ("equally long, got 4 and 3", lambda: approach(RECORD, RECORD[1:], 0.01, *PAIR, 0.0)),
    ("equally long, got 4 and 3",
     lambda: directional_correlation(RECORD, RECORD[1:], 0.01, *PAIR, [[0.0]])),
    ("acceleration is 0", lambda: per_obspy.record_correlation([0.0, 0.0], 0.01, *PAIR)),
    ("frequencies must increase", lambda: per_obspy.psd_correlation([1, 1], [1, 1], *PAIR)),
    ("psd is 0", lambda: per_obspy.psd_correlation([0, 0], [0, 1], *PAIR)),
    ("equal length", lambda: per_obspy.psd_correlation([1, 1, 1], [0, 1], *PAIR)),
    ("damping_1", lambda: per_obspy.psd_correlation([1, 1], [0, 1], 1, 0.0, 1, 0.1)),
    ("damping_2", lambda: per_obspy.ground_correlation(WHITE, 1, 0.1, 1, 0.0)),
    ("damping", lambda: per_obspy.linearized_correlation(Structure(1, 0, 1), LEFT, WHITE)),
    ("method", lambda: per_obspy.equivalent_linear("jeng", 2.0, 1.0, 0.05, 0.0)),
    ("damping of", lambda: per_obspy.equivalent_linear("jeng_unverified", 12.0, 1.0, 0.05, 0.0)),
    ("not below critical", lambda: per_obspy.bumper_restitution(1.0, 10.0, 1.0, 1.0, 1.0)),
    ("damping", lambda: per_obspy.kelvin_voigt_restitution(1.0)),
    ("restitution must be positive", lambda: per_obspy.jankowski_damping(0.0)),
    ("not below critical",
     lambda: per_obspy.supplemental_damping(RECORD, 0.01, *PAIR, 0.1, largest=0.96)),
    ("gaps must be one", lambda: per_obspy.pounding_history(RECORD, 0.01, [LEFT] * 2, [1, 2], 0.5)),
    ("two or more", lambda: per_obspy.pounding_history(RECORD, 0.01, [LEFT], 0.1, 0.5)),
    ("north and east", lambda: yielding_relative_displacement(RECORD, 0.01, *PAIR, 0.0)),
    ("stiffness", lambda: per_obspy.linked_history(RECORD, 0.01, LEFT, RIGHT, 0, yield_force=1)),
    ("yield_displacement", lambda: per_obspy.linked_history(RECORD, 0.01, LEFT, YIELDS, 1.0)),
    ("yield_displacement",
     lambda: per_obspy.hertz_damp_history(RECORD, 0.01, LEFT, YIELDS, 1.0, 1.0, 0.5)),
])  # fmt: skip
def test_arguments_that_do_not_go_together_are_refused(message, call):
    with pytest.raises(ValueError, match=message):
        call()
