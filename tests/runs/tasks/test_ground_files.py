"""Ground motion as files: stations without coordinates, keys, station files read once."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from obspy import Stream, Trace

from per_obspy.config import Interpolation
from per_obspy.errors import MachineFault
from per_obspy.files import file_hash
from per_obspy.runs.tasks.ground_files import ground_files, read_ground, read_station_once
from per_obspy.runs.tasks.station import FinishedStation
from per_obspy.screening.site_motion import HYPOCENTRE, prepared_field
from per_obspy.spectra.station import station_spectra
from per_obspy.spectra.storage import read_spectra, without_motion, write_spectra

PERIODS = np.geomspace(0.1, 2.0, 6)


def stream(longitude, seed):
    """Return two horizontals of a station at the equator, m/s2."""
    random = np.random.default_rng(seed)
    header = {"network": "XX", "station": f"S{seed}", "delta": 0.02, "units": "m/s2"}
    header |= {"quantity": "acceleration", "processing_level": "processed"}
    # Where the station is, NaN if that is unknown
    place = {"latitude": 0.0, "longitude": longitude, "elevation": 0.0}
    return Stream(
        Trace(
            random.normal(size=1000),
            header | {"channel": f"HN{code}", "sensor_azimuth": azimuth, "coordinates": place},
        )
        for code, azimuth in (("N", 0.0), ("E", 90.0))
    )


@pytest.fixture
def stations(tmp_path):
    """Three finished stations with their station files; the place of the last is unknown."""
    finished = []
    for seed, longitude in enumerate((0.1, 0.2, np.nan), start=1):
        dataset = station_spectra(stream(longitude, seed), PERIODS, (0.05,), 30)
        dataset.attrs |= {f"hypocentre_{name}": 0.5 for name in ("longitude", "latitude", "depth")}
        shard = tmp_path / f"XX.S{seed}.nc"
        write_spectra(dataset, shard)
        # as a job leaves a station
        spectra = without_motion(read_spectra(shard))
        finished.append(FinishedStation(f"XX.S{seed}", shard, (), False, file_hash(shard), spectra))
    return finished


def test_stations_without_coordinates_serve_no_pair(stations):
    ground, rejected = ground_files(stations, (), Interpolation())
    assert [file.name for file in ground.stations] == ["XX.S1", "XX.S2"]
    assert [file.longitude for file in ground.stations] == [0.1, 0.2]
    (rejection,) = rejected
    assert (rejection.kind, rejection.name) == ("station", "XX.S3")
    assert "coordinates are unknown" in rejection.reasons[0]


def test_the_field_is_that_of_the_whole_shards(stations):
    # would catch spectra that lack what the field needs, now that no station file is read for it
    ground, _ = ground_files(stations, (), Interpolation())
    whole = [read_spectra(station.shard) for station in stations[:2]]
    expected = prepared_field(whole, Interpolation(), ground.field.source)
    np.testing.assert_array_equal(ground.field.ln_per, expected.ln_per)
    assert tuple(ground.field.source) == (0.5, 0.5, 0.5)


def test_the_key_depends_on_every_content(stations, tmp_path):
    grid, changed = tmp_path / "grid.xml", tmp_path / "other.xml"
    grid.write_text("<shakemap_grid/>")
    changed.write_text("<shakemap_grid />")

    def key(stations, shakemap=()):
        return ground_files(stations, shakemap, Interpolation())[0].key

    keys = {key(stations), key(stations[:1]), key(stations, (grid,)), key(stations, (changed,))}
    keys.add(key([stations[0]._replace(hash="another"), *stations[1:]]))
    assert len(keys) == 5
    assert key(stations) in keys  # the same again


def test_no_station_and_no_map_is_no_ground_motion():
    ground, rejected = ground_files([], (), Interpolation())
    assert (ground.stations, ground.field, rejected) == ((), None, ())
    assert read_ground(ground).stations.names.size == 0


def test_a_station_is_read_once_and_again_when_it_has_changed(stations, monkeypatch):
    opened = []
    real = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: opened.append(path) or real(path))
    ground = read_ground(ground_files(stations, (), Interpolation())[0])
    first = ground.stations.read(1)
    assert ground.stations.read(1) is first
    xr.testing.assert_identical(first, read_spectra(stations[1].shard))
    assert opened == [stations[1].shard]
    # another hash is another content; where it is not there, no pair is at fault
    with pytest.raises(MachineFault, match="changed while the run read it"):
        read_station_once(stations[1].shard, "another")
    assert len(opened) == 2


def test_the_hypocentre_is_that_of_the_first_station_that_has_one(stations):
    # would catch the station that comes last deciding
    *first, last = stations[:2]
    expected = ground_files(stations[:2], (), Interpolation())[0].key
    last.spectra.attrs = {"simulated": "false"}
    assert ground_files([*first, last], (), Interpolation())[0].key == expected
    assert ground_files([last, *first], (), Interpolation())[0].field is not None


def test_stations_of_two_earthquakes_have_no_common_hypocentre(stations):
    # would catch: the field of one of two hypocentres
    for station in stations:
        for name in HYPOCENTRE:
            station.spectra.attrs.pop(name, None)
    unknown = ground_files(stations, (), Interpolation())[0].key
    for degrees, station in enumerate(stations[:2]):
        station.spectra.attrs |= dict.fromkeys(HYPOCENTRE, float(degrees))
    assert ground_files(stations, (), Interpolation())[0].key == unknown


def test_flags_of_a_comparison_reach_the_pairs_and_decide_the_key(stations):
    # would catch: pairs of a finished chunk without a flag that another station has brought
    plain = ground_files(stations, (), Interpolation())[0]
    changed = stations[0].spectra.copy()
    changed["record_flags"] = changed["record_flags"].copy(data="implausible_amplitude")
    flagged = [stations[0]._replace(spectra=changed), *stations[1:]]
    ground = ground_files(flagged, (), Interpolation())[0]
    assert ground.key != plain.key
    first, second = (read_ground(ground).stations.read(index) for index in (0, 1))
    assert first["record_flags"].item() == "implausible_amplitude"
    assert second["record_flags"].item() == ""
    # the file is as it was
    assert read_spectra(stations[0].shard)["record_flags"].item() == ""
