"""What ``import per_obspy`` offers, and that it costs nothing until it is used."""

import subprocess
import sys

import per_obspy

NAMES = {
    "CloughPenzien",
    "KanaiTajimi",
    "Structure",
    "WhiteNoise",
    "absolute_gap",
    "asce7_period",
    "azimuthal_per_spectrum",
    "bilinear_response",
    "bumper_restitution",
    "critical_gap",
    "ddc_correlation",
    "ec8_period",
    "equivalent_linear",
    "equivalent_sdof",
    "kelvin_voigt_damping",
    "kelvin_voigt_restitution",
    "linearized_correlation",
    "linked_history",
    "pairs_from_footprints",
    "per_spectrum",
    "post_impact_velocities",
    "pounding_histories",
    "pounding_history",
    "pounding_probability",
    "process",
    "psd_correlation",
    "read_pairs",
    "record_correlation",
    "relative_displacement",
    "required_restitution",
    "response_spectra",
    "risk_table",
    "rotd",
    "shear_building",
    "single_hit",
    "srss_gap",
    "station_spectra",
    "supplemental_damping",
    "transfer_energies",
}


def test_the_public_names_are_the_intended_ones():
    assert set(dir(per_obspy)) == set(per_obspy.__all__) == NAMES


def test_every_public_name_is_there_and_documented():
    for name in NAMES:
        assert getattr(per_obspy, name).__doc__, name


def test_import_is_lazy():
    code = "import sys, per_obspy; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"numba", "pandas", "xarray", "obspy", "scipy", "matplotlib"} & set(loaded)


def test_a_format_plugin_loads_nothing_heavy():
    plugin = "import per_obspy.formats.peer_at2"
    code = (
        f"import sys, obspy; before = set(sys.modules); {plugin}; print(*set(sys.modules) - before)"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"numba", "pandas", "xarray", "matplotlib"} & set(loaded)
