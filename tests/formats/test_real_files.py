"""Every real file of the shared folder, one by one: samples, interval and peak."""

import csv
import io
import os
from collections import defaultdict
from pathlib import Path

import numpy as np
import obspy
import pytest

from per_obspy.errors import RecordRejected
from per_obspy.formats.csmip import read_spectra
from per_obspy.spectra.elastic import response_spectra

pytestmark = pytest.mark.real_data

FOLDER = Path(os.environ.get("PER_OBSPY_DATA", Path(__file__).parents[3] / "shared" / "data"))

#: files whose interval in peaks.csv is the recorder's (real number 34), not the series' (real
#: number 62): the header's time of the peak and the length of the record fit only the latter
INTERVALS = {
    "cosmos/Cosmos12TimeSeriesTest.v1": 0.01,
    "cosmos/us1000hyfh_akbmrp_AKBMR--n.1000hyfh.BNZ.--.acc.V2c": 0.005,
}

#: files whose header disagrees with its own samples about the peak by more than rounding
PEAKS = {
    "afad2023/20230206011732_3125_ap_AAD_Acc_E.asc": "one PGA for both components, before AFAD's own filter",
    "afad2023/20230206011732_3125_ap_AAD_Acc_N.asc": "one PGA for both components, before AFAD's own filter",
    "afad2023/20230206011732_4414_ap_AAD_Acc_E.asc": "the PGA is not this file's",
    "afad2023/20230206011732_4414_ap_AAD_Acc_N.asc": "the PGA is not this file's",
}

#: smallest step of the peaks that headers write, relative to the peak or in m/s2
ROUNDING = {"CSMIP_V1": 0.005, "RENADIC": 0.005, "UNAM": 1e-4, "CWB": 1e-9}


def expected() -> dict[str, list[dict[str, str]]]:
    if not (FOLDER / "records" / "peaks.csv").exists():
        return {}
    rows = defaultdict(list)
    with (FOLDER / "records" / "peaks.csv").open() as file:
        for row in csv.DictReader(file):
            rows[row["file"]].append(row)
    return rows


EXPECTED = expected()
OTHERS = ("csmip_v2_only", "ridgecrest2019_csmip", "unam_asa", "usc")


def other_files() -> list[str]:
    """Return records that peaks.csv leaves out; their headers tell their peaks."""
    folder = FOLDER / "records"
    found = [path for name in OTHERS for path in sorted((folder / name).glob("*"))]
    return [
        str(path.relative_to(folder))
        for path in found
        if str(path.relative_to(folder)) not in EXPECTED
    ]


@pytest.mark.parametrize("name", EXPECTED)
def test_samples_interval_and_peak(real_data: Path, name: str):
    stream = obspy.read(str(real_data / "records" / name))
    assert len(stream) == len(EXPECTED[name])
    for trace, row in zip(stream, EXPECTED[name], strict=True):
        assert trace.stats.npts == int(row["samples"])
        assert trace.stats.delta == pytest.approx(INTERVALS.get(name, float(row["dt_s"])), rel=1e-6)
        # six digits are given
        assert np.abs(trace.data).max() == pytest.approx(float(row["peak"]), rel=1e-5, abs=1e-12)


@pytest.mark.parametrize("name", [*EXPECTED, *other_files()])
def test_the_header_agrees_with_its_own_samples(real_data: Path, name: str):
    stream = obspy.read(str(real_data / "records" / name))
    compared = [trace for trace in stream if "header_peak" in trace.stats]
    if name in PEAKS:
        assert all(
            abs(trace.stats.header_peak / np.abs(trace.data).max() - 1) > 0.005
            for trace in compared
        )
        return
    for trace in compared:
        rounding = ROUNDING.get(trace.stats._format, 0.0)
        assert np.abs(trace.data).max() == pytest.approx(
            trace.stats.header_peak, rel=1e-4, abs=rounding
        )


@pytest.mark.parametrize("name", [name for name in INTERVALS if name in EXPECTED])
def test_the_time_of_the_peak_proves_the_interval(real_data: Path, name: str):
    path = real_data / "records" / name
    said = next(line for line in path.read_text().splitlines() if "Max =" in line).split()[-2]
    trace = obspy.read(str(path))[0]
    assert np.argmax(np.abs(trace.data)) * trace.stats.delta == pytest.approx(float(said), abs=1e-6)


@pytest.mark.parametrize("name", [name for name in EXPECTED if "knet" not in name])
def test_a_cut_file_is_never_a_shorter_record(real_data: Path, tmp_path: Path, name: str):
    content = (real_data / "records" / name).read_bytes()
    whole = obspy.read(str(real_data / "records" / name))
    for part in (0.02, 0.31, 0.77, 0.98):
        (tmp_path / "cut").write_bytes(content[: int(part * len(content))])
        try:
            stream = obspy.read(str(tmp_path / "cut"), format=whole[0].stats._format)
        except RecordRejected:
            continue
        assert [len(trace) for trace in stream] == [len(trace) for trace in whole][: len(stream)]


def v2_and_v3() -> list[str]:
    folder = FOLDER / "spectra_v3"
    return sorted(str(path.relative_to(folder)) for path in folder.glob("*/*.[vV]3"))


@pytest.mark.parametrize("name", v2_and_v3())
def test_official_spectra_fit_the_corrected_record_beside_them(real_data: Path, name: str):
    """Reader, units and interval of volume 2 and volume 3 are right if our spectra of one give the other."""
    path = real_data / "spectra_v3" / name
    stream = obspy.read(str(path.with_suffix(path.suffix.replace("3", "2"))))
    spectra = read_spectra(path)
    assert len(stream) == len(spectra)
    for trace, official in zip(stream, spectra, strict=True):
        five = int(np.argmin(np.abs(official.damping - 0.05)))
        ours = response_spectra(trace.data, trace.stats.delta, official.periods, 0.05)
        for kind in ("sd", "sv", "sa"):
            error = np.abs(getattr(ours, kind) / getattr(official, kind)[five] - 1)
            # three digits are printed (up to 0.5 %), the agency's maxima are at samples (some per
            # cent at 0.04 s)
            assert np.median(error) < 0.015
            assert np.percentile(error, 95) < 0.06


@pytest.mark.parametrize("start", ["", "Response and Fourier amplitude spectra"])
def test_what_is_no_volume_3_is_refused(tmp_path: Path, start: str):
    (tmp_path / "no.v3").write_text(start + "\nnothing else\n")
    with pytest.raises(RecordRejected, match=r"no\.v3: line \d+, "):
        read_spectra(tmp_path / "no.v3")


def one_file_of_each_format() -> list[str]:
    """Return the smallest real file of each folder of peaks.csv."""
    smallest: dict[str, tuple[int, str]] = {}
    for name in EXPECTED:
        size = (FOLDER / "records" / name).stat().st_size
        smallest[name.split("/")[0]] = min(
            smallest.get(name.split("/")[0], (size, name)), (size, name)
        )
    return [name for _, name in smallest.values() if "knet" not in name]


@pytest.mark.parametrize("name", one_file_of_each_format())
def test_damaged_real_files_are_refused_or_read(real_data: Path, name: str):
    """Overwrite pieces of the header and of the samples: nothing but a RecordRejected may come out."""
    content = (real_data / "records" / name).read_bytes()
    reader_name = obspy.read(str(real_data / "records" / name))[0].stats._format
    random = np.random.default_rng(5)
    pieces = [b"-999", b"9" * 12, b"0", b" ", b"\n", b"-", b"1E30", b"\xff\xfe", b"*****", b""]
    for _ in range(12):
        damaged = bytearray(content)
        for reach in (2000, len(content)):
            place = int(random.integers(min(reach, len(content))))
            damaged[place : place + int(random.integers(20))] = pieces[
                int(random.integers(len(pieces)))
            ]
        try:
            stream = obspy.read(io.BytesIO(bytes(damaged)), format=reader_name)
        except RecordRejected:
            continue
        assert all(np.isfinite(trace.data).all() for trace in stream)
