"""Public names of ``per_obspy``: complete, documented, and imported only when they are used."""

import inspect
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
    "combined_dispersion",
    "combined_dispersion_correlation",
    "constant_yield_spectra",
    "critical_gap",
    "davenport_peak_factor",
    "ddc_correlation",
    "ductility_correlation",
    "ec8_period",
    "equivalent_linear",
    "equivalent_sdof",
    "ground_correlation",
    "hertz_damp_history",
    "jankowski_damping",
    "kelvin_voigt_damping",
    "kelvin_voigt_history",
    "kelvin_voigt_restitution",
    "linearized_correlation",
    "linked_history",
    "lognormal_dispersion",
    "mahmoud_jankowski_damping",
    "pairs_from_footprints",
    "per_spectrum",
    "period_dispersion",
    "post_impact_velocities",
    "plot_pair",
    "plot_risk",
    "plot_spectra",
    "pounding_histories",
    "pounding_history",
    "pounding_probability",
    "process",
    "psd_correlation",
    "read_pairs",
    "read_records",
    "record_correlation",
    "relative_displacement",
    "required_gap",
    "required_restitution",
    "response_spectra",
    "risk_table",
    "rotd",
    "run",
    "screen",
    "shear_building",
    "single_hit",
    "srss_gap",
    "station_spectra",
    "stream_spectra",
    "supplemental_damping",
    "transfer_energies",
}


def test_the_public_names_are_the_intended_ones():
    assert set(dir(per_obspy)) == set(per_obspy.__all__) == NAMES


def test_every_public_name_is_there_and_documented():
    for name in NAMES:
        assert getattr(per_obspy, name).__doc__, name


#: Functions of whole files and tables, whose examples are the workflows.
WITHOUT_EXAMPLE = {
    "pairs_from_footprints",
    "process",
    "read_pairs",
    "read_records",
    "risk_table",
    "run",
    "screen",
    "station_spectra",
}


def test_every_function_of_physics_has_all_sections_and_an_example():
    missing = []
    for name in NAMES - WITHOUT_EXAMPLE:
        public = getattr(per_obspy, name)
        if inspect.isfunction(public):
            sections = inspect.getdoc(public).splitlines()
            needed = {"Parameters", "Returns", "Raises", "Examples"} - set(sections)
            missing += [f"{name}: {section}" for section in sorted(needed)]
    assert missing == []


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


def test_a_run_needs_no_library_of_an_extra():
    code = "import sys, per_obspy.runs.stages, per_obspy.cli.screen; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    extras = {"h3", "openpyxl", "playwright", "pyogrio", "pyproj", "python_calamine", "shapely"}
    assert not extras & set(loaded)
