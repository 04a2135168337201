"""
Every real file of the shared folder, one by one: samples, interval and peak.

Covers ``per_obspy.formats.csmip`` (its spectra too), ``per_obspy.formats.knet`` and all plugins.
"""

import csv
import io
import os
from collections import defaultdict
from pathlib import Path

import numpy as np
import obspy
import pytest
from obspy import Stream, Trace

from per_obspy.errors import RecordRejected
from per_obspy.formats.csmip import read_spectra
from per_obspy.formats.knet import require_whole_numbers, with_knet_words
from per_obspy.records.obspy_readers import read_content
from per_obspy.spectra.elastic import response_spectra

pytestmark = pytest.mark.real_data

FOLDER = Path(os.environ.get("PER_OBSPY_DATA", Path(__file__).parents[3] / "shared" / "data"))

#: files whose interval in peaks.csv is the recorder's (real number 34), not the series' (real
#: number 62): the header's time of the peak and the length of the record fit only the latter
INTERVALS = {
    "cosmos/Cosmos12TimeSeriesTest.v1": 0.01,
    "cosmos/us1000hyfh_akbmrp_AKBMR--n.1000hyfh.BNZ.--.acc.V2c": 0.005,
}

#: film whose times wander from the mean interval, which is that in peaks.csv: it is interpolated
FILM = {
    "csmip_v2_only/NEWPORT.RAW",
    "usc/017m30lw.e0a",
    "usc/017m30lw.e0b",
    "usc/017m30lw.e0c",
}

#: files whose header disagrees with its own samples about the peak by more than rounding: AFAD has
#: one PGA for both components, before its own filter (3125), or the PGA of another file (4414)
WRONG_PEAKS = {
    "afad2023/20230206011732_3125_ap_AAD_Acc_E.asc",
    "afad2023/20230206011732_3125_ap_AAD_Acc_N.asc",
    "afad2023/20230206011732_4414_ap_AAD_Acc_E.asc",
    "afad2023/20230206011732_4414_ap_AAD_Acc_N.asc",
}

#: format and processing level of files whose headers have no peak
WITHOUT_PEAK = {("BHRC", "raw"), ("PEER_AT2", "processed"), ("USC", "raw")}

#: smallest step of the peaks that headers write, relative to the peak or in m/s2
ROUNDING = {"CSMIP_V1": 0.005, "RENADIC": 0.005, "UNAM": 1e-4, "CWB": 1e-9}


def expected() -> dict[str, list[dict[str, str]]]:
    """Return file -> its rows of peaks.csv; empty where the real files are missing."""
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
    """Return records that peaks.csv leaves out; their headers have their peaks."""
    folder = FOLDER / "records"
    paths = [path for name in OTHERS for path in sorted((folder / name).glob("*"))]
    names = [str(path.relative_to(folder)) for path in paths]
    return [name for name in names if name not in EXPECTED]


@pytest.mark.parametrize("name", EXPECTED)
def test_samples_interval_and_peak(real_data: Path, name: str):
    stream = obspy.read(str(real_data / "records" / name))
    assert len(stream) == len(EXPECTED[name])
    for trace, row in zip(stream, EXPECTED[name], strict=True):
        if name in FILM:
            assert trace.stats.digitised
            assert trace.stats.delta == 0.0025
            # The film ends where its last step begins, or one step before
            duration = float(row["dt_s"]) * (int(row["samples"]) - 1)
            assert 0 <= duration - trace.stats.delta * (trace.stats.npts - 1) < 0.0025
            # 0.11 % of the largest sample fall between the new ones of e0b, less elsewhere
            assert np.abs(trace.data).max() == pytest.approx(float(row["peak"]), rel=2e-3)
            continue
        assert trace.stats.npts == int(row["samples"])
        assert trace.stats.delta == pytest.approx(INTERVALS.get(name, float(row["dt_s"])), rel=1e-6)
        # six digits are given
        assert np.abs(trace.data).max() == pytest.approx(float(row["peak"]), rel=1e-5, abs=1e-12)


def with_words(stream: Stream) -> Stream:
    """Return a stream in the words of the vocabulary, which ObsPy's K-NET reader does not know."""
    return Stream([with_knet_words(trace) if "knet" in trace.stats else trace for trace in stream])


def largest_sample(trace: Trace) -> float:
    """Return the largest absolute sample; the peak of K-NET is counted from the mean."""
    mean = trace.data.mean() if "knet" in trace.stats else 0.0
    return float(np.abs(trace.data - mean).max())


def has_no_peak(trace: Trace) -> bool:
    """Check whether the header cannot have a peak: of its format, or of a dead channel."""
    kind = (trace.stats._format, trace.stats.processing_level)
    return kind in WITHOUT_PEAK or not trace.data.any()


@pytest.mark.parametrize("name", [*EXPECTED, *other_files()])
def test_the_header_agrees_with_its_own_samples(real_data: Path, name: str):
    stream = with_words(obspy.read(str(real_data / "records" / name)))
    assert len(stream) > 0
    for trace in stream:
        peak = trace.stats.get("header_peak")
        # A plugin that loses the peak of its header must not pass
        assert (peak is None) == has_no_peak(trace)
        if peak is None:
            continue
        largest = largest_sample(trace)
        if name in WRONG_PEAKS:
            assert abs(peak / largest - 1) > 0.005
        else:
            rounding = ROUNDING.get(trace.stats._format, 0.0)
            assert largest == pytest.approx(peak, rel=1e-4, abs=rounding)


@pytest.mark.parametrize("name", [name for name in INTERVALS if name in EXPECTED])
def test_the_time_of_the_peak_proves_the_interval(real_data: Path, name: str):
    path = real_data / "records" / name
    line = next(line for line in path.read_text().splitlines() if "Max =" in line)
    seconds = float(line.split()[-2])
    # The index of the peak times the interval is its time
    trace = obspy.read(str(path))[0]
    assert np.argmax(np.abs(trace.data)) * trace.stats.delta == pytest.approx(seconds, abs=1e-6)


@pytest.mark.parametrize("name", [name for name in EXPECTED if "knet" not in name])
def test_a_cut_file_is_never_a_shorter_record(real_data: Path, tmp_path: Path, name: str):
    content = (real_data / "records" / name).read_bytes()
    whole = obspy.read(str(real_data / "records" / name))
    lengths = [len(trace) for trace in whole]
    for part in (0.02, 0.31, 0.77, 0.98):
        (tmp_path / "cut").write_bytes(content[: int(part * len(content))])
        try:
            stream = obspy.read(str(tmp_path / "cut"), format=whole[0].stats._format)
        except RecordRejected:
            continue
        # A cut between whole channels leaves fewer of them
        assert [len(trace) for trace in stream] == lengths[: len(stream)]


def v2_and_v3() -> list[str]:
    """Return official spectra with the corrected record in the same folder."""
    folder = FOLDER / "spectra_v3"
    return sorted(str(path.relative_to(folder)) for path in folder.glob("*/*.[vV]3"))


@pytest.mark.parametrize("name", v2_and_v3())
def test_official_spectra_fit_the_corrected_record(real_data: Path, name: str):
    """Readers, units and interval are right if our spectra of volume 2 are those of volume 3."""
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
        folder = name.split("/")[0]
        file = ((FOLDER / "records" / name).stat().st_size, name)
        smallest[folder] = min(smallest.get(folder, file), file)
    # ObsPy's K-NET reader raises errors of other classes
    return [name for _, name in smallest.values() if "knet" not in name]


PIECES = [b"-999", b"9" * 12, b"0", b" ", b"\n", b"-", b"1E30", b"\xff\xfe", b"*****", b""]


def damaged(content: bytes, random: np.random.Generator) -> bytes:
    """Overwrite a piece of the header, and a piece anywhere."""
    changed = bytearray(content)
    for reach in (2000, len(content)):
        place = int(random.integers(min(reach, len(content))))
        stop = place + int(random.integers(20))
        changed[place:stop] = PIECES[int(random.integers(len(PIECES)))]
    return bytes(changed)


@pytest.mark.parametrize("name", one_file_of_each_format())
def test_damaged_real_files_are_refused_or_read(real_data: Path, name: str):
    """Any error but a RecordRejected fails."""
    path = real_data / "records" / name
    content = path.read_bytes()
    reader_name = obspy.read(str(path))[0].stats._format
    random = np.random.default_rng(5)
    for _ in range(12):
        # The plugin by name: a damaged start need not be recognized
        try:
            stream = obspy.read(io.BytesIO(damaged(content, random)), format=reader_name)
        except RecordRejected:
            continue
        assert all(np.isfinite(trace.data).all() for trace in stream)


def test_a_cut_k_net_file_is_refused_or_whole(real_data: Path):
    # would catch a sample that the count may lack, and one that lost its last digits
    path = real_data / "records" / "aomori2018_knet" / "AOM0011801241951.EW"
    content = path.read_bytes()
    (whole,) = obspy.read(str(path))
    for cut in range(1, 16):
        try:
            require_whole_numbers(content[:-cut], path.name)
            (trace,) = obspy.read(io.BytesIO(content[:-cut]), format="KNET")
            samples = with_knet_words(trace).data
        except RecordRejected:
            continue
        np.testing.assert_array_equal(samples, whole.data)
    # every path to ObsPy asks
    with pytest.raises(RecordRejected, match="last number: the file ends inside a column"):
        read_content(obspy.read, content[:-3], path)
