"""
Bundles of strong-motion centres as they are downloaded.

No real bundle is at hand: these are made of the documented parts (a zip of zips, one per station or
record, with documents) from real records of the formats. They test
per_obspy.records.file_list and per_obspy.records.metadata with archives.
"""

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from per_obspy.records.folder import find_stations, read_station

pytestmark = pytest.mark.real_data


@pytest.fixture(scope="module")
def records(real_data: Path) -> Path:
    return real_data / "records"


def packed(members: dict[str, bytes]) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, member in members.items():
            archive.writestr(name, member)
    return content.getvalue()


def test_a_bundle_of_the_virtual_data_centre(records: Path, tmp_path: Path):
    # One zip per station below a folder of the network, with a text for people
    bundle = {"README.txt": b"COSMOS Virtual Data Center", "__MACOSX/._readme": b"\x00\x05\x16"}
    for file in sorted((records / "cosmos").iterdir()):
        station = packed({f"{file.stem}/{file.name}": file.read_bytes(), "disclaimer.pdf": b"%PDF"})
        bundle[f"networks/{file.stem}.zip"] = station
    (tmp_path / "download.zip").write_bytes(packed(bundle))
    found = find_stations(tmp_path)
    outside = find_stations(records / "cosmos")
    assert found.rejected == ()
    assert list(found.stations) == list(outside.stations)
    # The same samples, ground and event as outside of any archive
    for name, paths in found.stations.items():
        stream, rejected = read_station(paths, found.inventory, name)
        same, _ = read_station(outside.stations[name], outside.inventory, name)
        assert rejected == ()
        for trace, plain in zip(stream, same, strict=True):
            np.testing.assert_array_equal(trace.data, plain.data)
            assert trace.stats.coordinates == plain.stats.coordinates
            assert trace.stats.event == plain.stats.event
            assert ".zip/networks/" in trace.stats.source


def test_volumes_side_by_side(real_data: Path, tmp_path: Path):
    # Uncorrected, corrected and spectra of one station, as a centre packs them
    (folder,) = {path.parent for path in (real_data / "spectra_v3").rglob("*.[vV]1")}
    files = [
        path for path in sorted(folder.iterdir()) if path.suffix.lower() in (".v1", ".v2", ".v3")
    ]
    inner = packed({path.name: path.read_bytes() for path in files})
    (tmp_path / "CE.zip").write_bytes(packed({"station.zip": inner, "readme.htm": b"<html>"}))
    found = find_stations(tmp_path)
    assert found.stations
    # Spectra are no records: each is a row, and nothing else
    names = {row.name.rpartition("/")[2].lower()[-3:] for row in found.rejected}
    assert names <= {".v3"}
    for name, paths in found.stations.items():
        stream, _ = read_station(paths, found.inventory, name)
        assert {trace.stats.processing_level for trace in stream} <= {"raw", "processed"}


def test_one_form_of_a_record_in_two_formats_is_read(records: Path, tmp_path: Path):
    # The same record as acceleration (V1) and, for longer, as counts, under the same codes
    folder = records / "ridgecrest2019_mseed"
    names = ("CI.CLC..HNE.mseed", "CI.CLC..HNN.mseed", "CI.CLC..HNZ.mseed", "CI.CLC.xml")
    members = {name: (folder / name).read_bytes() for name in names}
    v1 = (records / "ridgecrest2019_csmip" / "CICLC.v1").read_bytes()
    (tmp_path / "a.zip").write_bytes(packed({"raw.zip": packed(members), "v1/CICLC.V1": v1}))
    found = find_stations(tmp_path)
    stream, rejected = read_station(found.stations["CI.CLC"], found.inventory, "CI.CLC")
    assert sorted(trace.id[-3:] for trace in stream) == ["HNE", "HNN", "HNZ"]
    seconds = {record.path.suffix: record.end - record.start for record in found.records}
    assert seconds[".mseed"] > seconds[".V1"] + 10
    assert {trace.stats.units for trace in stream} == {"counts"}
    assert len(rejected) == 3
    assert all(row.source.endswith("CICLC.V1") for row in rejected)
    assert all("(MSEED in counts), which is read instead" in row.reasons[0] for row in rejected)


def test_station_metadata_of_itaca_reach_its_records(records: Path):
    found = find_stations(records / "itaca2009")
    # Of the folder only the official spectra (.rs) are no records
    assert {row.name[-3:] for row in found.rejected} == {".rs"}
    known = {"IT.2987": (42.373474, 13.337026, 684.842), "IT.3620": (42.027458, 13.425929, 199.0)}
    for name, (latitude, longitude, vs30) in known.items():
        stream, rejected = read_station(found.stations[name], found.inventory, name)
        assert rejected == ()
        for trace in stream:
            stats = trace.stats
            assert (stats.coordinates.latitude, stats.coordinates.longitude) == (
                latitude,
                longitude,
            )
            assert stats.vs30 == vs30
            assert stats.coordinates_source.endswith(".metadata")
    assert {record.event.magnitude for record in found.records} == {6.3}
