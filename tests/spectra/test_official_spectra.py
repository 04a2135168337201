"""Spectra that agencies and databases published with their records."""

from pathlib import Path

import numpy as np
import obspy
import pytest
from numpy.testing import assert_allclose

from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.formats.csmip import read_spectra
from per_obspy.spectra.bilinear import constant_yield_spectra
from per_obspy.spectra.elastic import response_spectra

pytestmark = pytest.mark.real_data


@pytest.fixture(scope="module")
def csmip(real_data):
    """Every channel of the CSMIP volumes: (our spectra, official spectra, usable periods)."""
    channels = []
    for volume_3 in sorted((real_data / "spectra_v3").glob("*/*.[vV]3")):
        volume_2 = volume_3.with_suffix(volume_3.suffix.replace("3", "2"))
        records = [
            trace for trace in obspy.read(str(volume_2)) if trace.stats.quantity == "acceleration"
        ]
        for official, trace in zip(read_spectra(str(volume_3)), records, strict=True):
            ours = response_spectra(
                trace.data, trace.stats.delta, official.periods, official.damping
            )
            usable = (official.periods >= 5 * trace.stats.delta) & (
                official.periods <= 0.8 / trace.stats.corners.highpass
            )
            channels.append((ours, official, usable))
    assert len(channels) == 25  # 9 + 10 + 3 + 3
    return channels


@pytest.mark.parametrize("quantity", ["sd", "sv", "sa"])
def test_official_csmip_spectra(csmip, quantity):
    # all channels, periods and dampings. The tables have three digits (0.17 % on average at their
    # low end), and their program looks at samples that it interpolates in its own way: 5 dt is the
    # limit of agreement at short periods
    ratios = [getattr(ours, quantity) / getattr(official, quantity) for ours, official, _ in csmip]
    errors = np.abs(np.concatenate([ratio.ravel() for ratio in ratios]) - 1)
    assert errors.size > 7000
    assert np.median(errors) <= 0.003
    assert np.percentile(errors, 95) <= 0.03


def test_radius_lies_between_the_bounds_of_official_spectra(csmip):
    excess = []
    for ours, official, usable in csmip:
        velocity = official.sv * official.periods / (2 * np.pi)
        low, high = np.maximum(official.sd, velocity), np.hypot(official.sd, velocity)
        excess.append(np.maximum(low / ours.per, ours.per / high)[:, usable].ravel() - 1)
    # 0.5 % for three digits; 14 of 5457 values lie up to 0.91 % outside, in two weak records near
    # their corner
    excess = np.concatenate(excess)
    assert np.mean(excess <= 0.005) >= 0.995
    assert excess.max() <= 0.01


@pytest.fixture(scope="module")
def northridge(real_data):
    """RSN1044 and, per damping in per cent, its table."""
    folder = real_data / "records" / "peer_at2"
    trace = obspy.read(str(folder / "RSN1044_DirRot2.AT2"))[0]
    tables = {
        damping: _numbers(folder / f"RSN1044_Damping{damping}.txt", header=6)
        for damping in (2, 5, 10)
    }
    return trace, tables


def _numbers(path, header):
    """Return the table of numbers in a text file after so many lines of header."""
    lines = path.read_text(errors="replace").splitlines()[header:]
    return np.array([np.array(line.split(), dtype=float) for line in lines if line.strip()])


@pytest.mark.parametrize("damping", [2, 5, 10])
def test_northridge_elastic_spectra(northridge, damping):
    # periods 0.05 to 4 s, five digits; the tables come from a stepping program at dt = 0.02 s: 1 %
    # at 0.05 s
    trace, tables = northridge
    table = tables[damping]
    ours = response_spectra(trace.data, trace.stats.delta, table[:, 0], damping / 100)
    for values, column, unit in (
        (ours.sa, 1, STANDARD_GRAVITY),
        (ours.sv, 5, 0.01),
        (ours.sd, 9, 0.01),
    ):
        errors = np.abs(values / unit / table[:, column] - 1)
        assert np.median(errors) <= 0.002
        assert errors.max() <= 0.011


@pytest.mark.parametrize(("ductility", "column"), [(2.0, 10), (4.0, 11), (6.0, 12)])
def test_northridge_constant_ductility(northridge, ductility, column):
    # elastoplastic, at the strength that the table implies; catches a wrong ductility and hardening
    trace, tables = northridge
    table = tables[5][3::8]
    yielding = table[:, column] / 100 / ductility
    coefficients = yielding * (2 * np.pi / table[:, 0]) ** 2 / STANDARD_GRAVITY
    ours = constant_yield_spectra(
        trace.data, trace.stats.delta, table[:, 0], 0.05, coefficients, 0.0
    )
    errors = np.abs(100 * ours.sd / table[:, column] - 1)
    assert np.median(errors) <= 0.002
    assert errors.max() <= 0.012


def test_mexico_city_1985(real_data):
    # SCT, east-west, 5 %: the record of Valles-Mattox & Reinhorn 1996, Fig. 3; three digits
    columns = np.loadtxt(real_data / "records" / "mexico1985_sct" / "sct190985.txt")
    spectra = response_spectra(9.81 * columns[:, 2], 0.02, [1.0, 1.5, 2.0, 2.5])
    assert_allclose(spectra.per, [0.0595, 0.239, 0.984, 1.19], rtol=3e-3)
    assert_allclose([spectra.sd[2], spectra.sa[2] / 9.81], [0.984, 0.995], rtol=1e-3)


ITACA = [
    f"{number}/{number}_{component}"
    for number in ("16833", "16839")
    for component in ("H1", "H2", "V")
]


@pytest.mark.parametrize("name", ITACA)
def test_official_itaca_spectra(real_data, name):
    # its column called 2 % is not 2 %; from 20 dt on, as peaks are sampled there
    record = real_data / "records" / "itaca2009" / name
    trace = obspy.read(f"{record}.cor.acc")[0]
    table = _numbers(Path(f"{record}.rs"), header=1)
    table = table[table[:, 0] >= 20 * trace.stats.delta]
    for column, damping in ((2, 0.05), (4, 0.10), (5, 0.20)):
        ours = response_spectra(trace.data, trace.stats.delta, table[:, 0], damping)
        # Pseudo-acceleration in the unit of the record
        errors = np.abs(ours.psa / table[:, column] - 1)
        assert np.median(errors) <= 0.003, (damping, np.median(errors))
        assert errors.max() <= 0.02, (damping, errors.max())
