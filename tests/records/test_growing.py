"""A folder that grows: half a file waits, and is neither read nor rejected."""

import os
import time

import numpy as np
import pytest
from obspy import Stream, Trace, UTCDateTime

from per_obspy.errors import TryLater
from per_obspy.records import file_list
from per_obspy.records.file_list import changed_files, file_states, growing_files
from per_obspy.records.folder import find_stations

OLD = time.time() - 3600


def write_record(folder, station, changed=OLD):
    """Write a record as MiniSEED with a time of its latest change."""
    header = {"network": "XX", "station": station, "channel": "HNZ", "sampling_rate": 100.0}
    trace = Trace(np.arange(2000, dtype=np.int32), {**header, "starttime": UTCDateTime(2024, 1, 1)})
    path = folder / f"{station}.mseed"
    Stream([trace]).write(str(path), format="MSEED")
    os.utime(path, (changed, changed))
    return path


def test_a_young_file_waits_and_is_taken_later(tmp_path):
    write_record(tmp_path, "A")
    half = write_record(tmp_path, "B", changed=time.time())
    half.write_bytes(half.read_bytes()[:300])  # would be a rejected file
    found = find_stations(tmp_path, settle=60.0)
    assert (list(found.stations), found.waiting, found.rejected) == (["XX.A"], (half,), ())
    # without the setting every file is read
    assert find_stations(tmp_path).waiting == ()
    write_record(tmp_path, "B")
    assert list(find_stations(tmp_path, settle=60.0).stations) == ["XX.A", "XX.B"]


def test_a_folder_of_young_files_is_read_later(tmp_path):
    write_record(tmp_path, "A", changed=time.time())
    with pytest.raises(TryLater, match="its 1 files are still being written, try again in 60 s"):
        find_stations(tmp_path, settle=60.0)


def test_a_file_that_changes_meanwhile_waits(tmp_path, monkeypatch):
    # a clock of the file server that is ahead, and a writer that goes on
    path = write_record(tmp_path, "A", changed=time.time() + 3600)
    states = file_states([path])
    monkeypatch.setattr(file_list.time, "sleep", lambda _: path.write_bytes(b"more"))
    assert growing_files(states, 60.0) == {path}
    # the same clock, but a writer that has finished
    path = write_record(tmp_path, "B", changed=time.time() + 3600)
    monkeypatch.setattr(file_list.time, "sleep", lambda _: None)
    assert growing_files(file_states([path]), 60.0) == set()


def test_a_file_that_changes_while_it_is_read_waits(tmp_path, monkeypatch):
    write_record(tmp_path, "A")
    path = write_record(tmp_path, "B")
    from per_obspy.records import folder

    read = folder.read_file

    def reading(file, limits):
        content = read(file, limits)
        if file == path:
            file.write_bytes(content + content)
        return content

    monkeypatch.setattr(folder, "read_file", reading)
    found = find_stations(tmp_path, settle=60.0)
    assert (list(found.stations), found.waiting) == (["XX.A"], (path,))


def test_a_file_that_vanishes_has_changed(tmp_path):
    path = write_record(tmp_path, "A")
    states = file_states([path, tmp_path / "absent"])
    assert list(states) == [path]
    path.unlink()
    assert changed_files(states) == {path}
