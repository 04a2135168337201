"""Status of a watcher as a file that is whole or refused."""

import os

import pytest

from per_obspy.errors import CatalogError
from per_obspy.files import is_part
from per_obspy.watch.health import STATUS, WatchStatus, read_status
from per_obspy.watch.state import write_state


def test_what_was_written_is_read(tmp_path):
    status = WatchStatus(last_poll="2026-01-02T03:04:05+00:00", events_open=2, running=True)
    assert status.pid == os.getpid()
    file = tmp_path / STATUS
    write_state(file, status)
    assert read_status(tmp_path) == status
    assert [path.name for path in tmp_path.iterdir()] == [file.name]
    assert not is_part(file)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "EOF"),
        ('{"events_open": -1}', "events_open"),
        ('{"next_due": "soon"}', "next_due"),
        ("[1]", "object"),
        ("\xff", "decode"),
    ],
)
def test_a_damaged_status_is_one_line(tmp_path, text, problem):
    (tmp_path / "status.json").write_text(text, encoding="latin-1")
    with pytest.raises(CatalogError, match=problem) as caught:
        read_status(tmp_path)
    assert len(str(caught.value).splitlines()) == 1


def test_a_later_version_may_write_more(tmp_path):
    (tmp_path / "status.json").write_text('{"events_open": 3, "mood": "good"}')
    assert read_status(tmp_path).events_open == 3
