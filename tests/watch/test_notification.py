"""
Messages by a command and by Apprise; secrets stay out of logs and process lists.

Covers ``per_obspy.watch.apprise_delivery``.
"""

import json
import logging
import threading
import time
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from per_obspy.config import Notify, checked
from per_obspy.errors import CatalogError
from per_obspy.watch.notification import Message, notify

MESSAGE = Message("first", "Town: 3 red", "Three pairs pound.", Path("/out/report.html"))


@pytest.fixture
def service():
    """A loopback service that takes the JSON messages of Apprise."""
    received = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            size = int(self.headers["Content-Length"])
            received.append(json.loads(self.rfile.read(size)))
            self.send_response(200)
            self.end_headers()

        def log_message(self, *_):
            pass

    server = HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"json://me:geheim@127.0.0.1:{server.server_port}/", received
    server.shutdown()
    thread.join()
    server.server_close()


def script(folder, text):
    """Write a shell script and return its path."""
    path = folder / "notify.sh"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o700)
    return str(path)


def test_a_command_gets_text_and_paths_but_no_shell(tmp_path, monkeypatch):
    monkeypatch.setenv("URLS", "json://geheim@127.0.0.1/")
    command = script(tmp_path, 'cat > "$1"; env >> "$1"')
    # would catch: a shell that runs what an argument holds
    target = tmp_path / "$(touch hacked)"
    settings = Notify(command=(command, str(target)), timeout=20)
    assert notify(settings, MESSAGE) == ()
    lines = target.read_text().splitlines()
    assert lines[:3] == ["Three pairs pound.", "", "Report: /out/report.html"]
    assert {"PER_OBSPY_KIND=first", "PER_OBSPY_TITLE=Town: 3 red"} <= set(lines)
    assert {"PER_OBSPY_REPORT=/out/report.html", "PER_OBSPY_FOLDER=/out"} <= set(lines)


def test_every_way_is_tried_and_a_failure_is_a_reason(tmp_path, service, monkeypatch, caplog):
    url, received = service
    monkeypatch.setenv("URLS", f"{url} unknown://geheim@nowhere")
    settings = Notify(
        command=(script(tmp_path, "exit 7"),), apprise_urls_variable="URLS", timeout=60
    )
    reasons = notify(settings, MESSAGE)
    assert reasons == (
        f"notification by command: {tmp_path}/notify.sh ended with exit code 7",
        "notification by apprise: not delivered by all of its 2 services",
    )
    assert [(one["title"], one["message"]) for one in received] == [
        ("Town: 3 red", "Three pairs pound.\n\nReport: /out/report.html")
    ]
    assert "geheim" not in caplog.text
    assert [record.levelno for record in caplog.records] == [logging.WARNING] * 2


def test_a_command_that_hangs_is_ended_with_what_it_started(tmp_path):
    command = script(tmp_path, f"sleep 300 & echo $! > {tmp_path}/pid; wait")
    started = time.monotonic()
    (reason,) = notify(Notify(command=(command,), timeout=1), MESSAGE)
    assert "was ended after 1 s" in reason
    assert time.monotonic() - started < 10  # far below the sleep, far above the limit
    state = Path("/proc", (tmp_path / "pid").read_text().strip(), "stat")
    # a process that ended may wait as a zombie until its new parent asks for it
    deadline = time.monotonic() + 10
    while state.exists() and state.read_text().rsplit(")", 1)[1].split()[0] != "Z":
        assert time.monotonic() < deadline
        time.sleep(0.05)


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"command": ["/no/such/program"]}, "No such file"),
        ({"apprise_urls_variable": "ABSENT"}, "the environment has no variable ABSENT"),
        ({"apprise_urls_file": "/no/such/file"}, "No such file"),
        ({"apprise_urls_file": "/dev/zero"}, "is no regular file"),
    ],
)
def test_what_is_missing_is_one_reason(settings, reason):
    (found,) = notify(checked(Notify, settings), MESSAGE)
    assert reason in found


def test_a_file_of_urls_that_others_can_read_is_refused(tmp_path):
    file = tmp_path / "urls"
    file.write_text("json://geheim@127.0.0.1:1/")
    for mode in (0o644, 0o640, 0o604):
        file.chmod(mode)
        (reason,) = notify(Notify(apprise_urls_file=file), MESSAGE)
        assert f"mode {mode:o} lets others read it: chmod 600" in reason
        assert "geheim" not in reason


def test_other_occasions_are_left_alone():
    assert notify(Notify(on=("failure",), command=("/no/such/program",)), MESSAGE) == ()


@pytest.mark.parametrize("argument", ["https://me:geheim@host/", "token=abc", "--password=x"])
def test_a_command_with_a_secret_is_refused(argument):
    with pytest.raises(CatalogError, match="every process list shows"):
        checked(Notify, {"command": ["curl", argument]})
