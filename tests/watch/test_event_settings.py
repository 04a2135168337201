"""Configuration of a watcher, and the settings of the run of one earthquake.

Tests ``per_obspy.config.watch`` as well.
"""

import pytest

from per_obspy.config import Run, load
from per_obspy.errors import CatalogError
from per_obspy.watch.event_settings import read_settings, settings_of_event
from per_obspy.watch.state import EventState

TEXT = """\
name = "city"
output = "out"
[records.fdsn]
providers = ["GEONET"]
before = 20
after = 240
[pairs]
file = "pairs.csv"
[watch]
service = "USGS"
"""


GROUP = """\
[notify]
command = ["mail"]
[[notify.groups]]
name = "a"
address = "b"
least_class = "high"
area = "none"
"""


def written(folder, text):
    (folder / "city.toml").write_text(text)
    return folder / "city.toml"


def event(time: str) -> EventState:
    return EventState(
        event_id="x", first_seen=time, confirmed=time, time=time, latitude=0.0, longitude=0.0
    )


def run_of(folder, time: str, delay: float) -> Run:
    settings = read_settings(written(folder, TEXT))
    return settings_of_event(settings, folder / "x", event(time), delay)


def test_the_window_ends_where_records_may_end_by_then(tmp_path):
    fdsn = run_of(tmp_path, "2026-11-23T01:00:03.7", 120.0).records.fdsn
    # Origin rounded down to 10 s; 120 s of delay less 60 s of latency
    assert fdsn.start == "2026-11-23T00:59:40.000000"
    assert fdsn.end == "2026-11-23T01:01:00.000000"
    fdsn = run_of(tmp_path, "2026-11-23T01:00:03.7", 900.0).records.fdsn
    assert fdsn.end == "2026-11-23T01:04:00.000000"


def test_a_small_change_of_the_origin_time_changes_nothing(tmp_path):
    runs = [run_of(tmp_path, f"2026-11-23T01:00:0{second}", 900.0) for second in (2, 8)]
    assert runs[0] == runs[1]


def test_the_run_of_an_earthquake_knows_no_watcher(tmp_path):
    run = run_of(tmp_path, "2026-11-23T01:00:00", 900.0)
    assert (run.watch, run.output) == (None, tmp_path / "x" / "work")
    assert run.records.event == tmp_path / "x" / "event.xml"


def test_a_map_is_of_the_earthquake_and_of_the_service_that_lists_it(tmp_path):
    text = TEXT.replace("before = 20", "shakemap = true")
    settings = read_settings(written(tmp_path, text))
    fdsn = settings_of_event(settings, tmp_path, event("2026-11-23"), 900.0).records.fdsn
    assert (fdsn.event_id, fdsn.event_provider) == ("x", "USGS")
    # Files name no map, and a run without an identifier has none
    with pytest.raises(CatalogError, match=r"shakemap needs watch\.service"):
        read_settings(written(tmp_path, text.replace('service = "USGS"', 'folder = "x"')))
    text = text.partition("[watch]")[0].replace("[pairs]", '[records]\nevent = "x"\n[pairs]')
    text = text.replace("shakemap = true", 'shakemap = true\ncache = "c"')
    with pytest.raises(CatalogError, match=r"shakemap needs records\.fdsn\.event_id"):
        load(written(tmp_path, text), Run)


def test_a_folder_of_records_waits_for_half_written_files(tmp_path):
    text = TEXT.replace('[records.fdsn]\nproviders = ["GEONET"]\nbefore = 20\nafter = 240', "")
    text = text.replace("[pairs]", '[records]\nfolder = "in"\n[pairs]')
    assert read_settings(written(tmp_path, text)).records.settle == 10.0
    text = text.replace('folder = "in"', 'folder = "in"\nsettle = 0')
    assert read_settings(written(tmp_path, text)).records.settle == 0.0


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('[watch]\nservice = "USGS"\n', "", r"no section \[watch\]"),
        ('service = "USGS"', 'service = "USSGS"', "is neither a base URL"),
        ('service = "USGS"', "", "give either service"),
        ('service = "USGS"', 'service = "USGS"\nfolder = "x"', "give either service"),
        ('service = "USGS"', 'service = "USGS"\ndelays = [60, 30]', "must be positive and rise"),
        ('service = "USGS"', 'service = "USGS"\ndelays = [30]', "latency must be shorter"),
        ('service = "USGS"', 'service = "USGS"\nregion = {latitude = 95, longitude = 0}', "95"),
        ("before = 20", 'event_id = "x"', "records.fdsn.event_id is of one earthquake"),
        ("before = 20", 'start = "2020-01-01"', "records.fdsn.start is of one earthquake"),
        ("[watch]", f"{GROUP}[watch]", r"notify\.groups\.0\.area: .*none: cannot be read"),
        ("before = 20", "shakemap_version = 2", "shakemap_version is of one earthquake"),
        ('[records.fdsn]\nproviders = ["GEONET"]\n', "[fdsn]\n", r"no section \[records\]"),
    ],
)
def test_wrong_configurations_are_one_line(tmp_path, old, new, reason):
    assert old in TEXT
    with pytest.raises(CatalogError, match=reason) as error:
        read_settings(written(tmp_path, TEXT.replace(old, new)))
    assert "\n" not in str(error.value)
