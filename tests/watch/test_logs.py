"""Logs of commands; covers ``per_obspy.cli.watch``."""

import json
import logging
from pathlib import Path

import pytest

from per_obspy.cli.watch import LogFormat, logged
from per_obspy.errors import CatalogError
from per_obspy.watch.logs import without_secrets

log = logging.getLogger("per_obspy.records.fdsn")


def test_steps_are_lines_and_quiet_leaves_warnings(capsys):
    for quiet, expected in ((False, "stations: 1 of 2\n"), (True, "")):
        with logged(None, LogFormat.text, quiet) as progress:
            progress("stations", 1, 2)
            log.warning("no answer")
        assert capsys.readouterr().err == f"{expected}per-obspy: no answer\n"


def test_colours_that_the_environment_asks_for_make_no_bars(capsys, monkeypatch):
    # would catch: escape sequences in the mail of a cron job
    monkeypatch.setenv("FORCE_COLOR", "1")
    with logged(None, LogFormat.text, quiet=False) as progress:
        progress("stations", 1, 2)
    assert capsys.readouterr().err == "stations: 1 of 2\n"


def fail_after_two_events(file):
    """Log a step and a warning with secrets, then fail."""
    with logged(file, LogFormat.json, quiet=True) as progress:
        progress("stations", 1, 2)
        log.warning("line 1\nline 2 https://me:geheim@host/?token=geheim&a=1")
        raise CatalogError("run.toml", "wrong")


def test_a_log_file_has_one_object_per_event_and_the_error_that_ends(tmp_path):
    file = tmp_path / "logs" / "run.jsonl"
    with pytest.raises(CatalogError):
        fail_after_two_events(file)
    events = [json.loads(line) for line in file.read_text().splitlines()]
    assert [event["level"] for event in events] == ["info", "warning", "error"]
    assert (events[0]["stage"], events[0]["done"], events[0]["total"]) == ("stations", 1, 2)
    assert events[1]["event"] == "line 1 line 2 https://***@host/?token=***&a=1"
    assert events[2]["event"] == "run.toml: wrong"
    # the next command adds to it
    with logged(file, LogFormat.text, quiet=True) as progress:
        progress("report", 1, 1)
    assert file.read_text().splitlines()[-1].endswith("report: 1 of 1")


@pytest.mark.parametrize(
    "text",
    [
        "https://user:p/ss@wo@rd@host/x",
        "ftp://geheim@host",
        "https://host/?access=1&password=geheim",
        "token: geheim",
        "api_key=geheim",
    ],
)
def test_secrets_of_addresses_are_masked(text):
    masked = without_secrets(text)
    assert not any(word in masked for word in ("geheim", "p/ss", "wo@rd"))
    assert "***" in masked


def test_a_log_that_cannot_be_written_is_one_line(capsys):
    if not Path("/dev/full").exists():
        pytest.skip("there is no /dev/full here")
    with logged(Path("/dev/full"), LogFormat.text, quiet=True) as progress:
        for number in range(3):
            progress("stations", number, 3)
    assert capsys.readouterr().err.count("/dev/full: the log cannot be written") == 1


def test_a_file_in_no_folder_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(CatalogError, match="cannot be written"),
        logged(tmp_path / "file" / "log", LogFormat.text, quiet=True),
    ):
        pass


def test_a_quiet_command_prints_only_what_is_wrong(call, tmp_path):
    (tmp_path / "text.mseed").write_text("no record")
    file = tmp_path / "log"
    options = ("--quiet", "--log", file, "--log-format", "json")
    code, out, err = call("process", tmp_path / "text.mseed", "-o", tmp_path / "out", *options)
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    (event,) = map(json.loads, file.read_text().splitlines())
    assert event["level"] == "error"
    assert f"per-obspy: {event['event']}" == err.strip()
