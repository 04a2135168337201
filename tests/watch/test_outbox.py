"""Messages that a killed watcher has left: the next one delivers them."""

import sys

import pytest
from watched_city import magnified

from per_obspy.config import Notify
from per_obspy.watch import notified_run, watch
from per_obspy.watch.watch import OUTBOX

#: Appends the title of a message to a file.
PROGRAM = "import os; print(os.environ['PER_OBSPY_TITLE'], file=open(os.sys.argv[1], 'a'))"


@pytest.fixture
def sent(city, tmp_path):
    """Return a function that lists the titles of all messages."""
    file = tmp_path / "sent"
    notify = Notify(command=(sys.executable, "-S", "-c", PROGRAM, str(file)))
    city.settings = city.settings.model_copy(update={"notify": notify})
    return lambda: file.read_text().splitlines() if file.exists() else []


def killed(*_, **__):
    raise KeyboardInterrupt


@pytest.mark.parametrize("place", ["message_waits", "keep", "_deliver"])
def test_a_kill_between_a_revision_and_its_message_delays_the_message(
    city, server, sent, simulation, monkeypatch, place
):
    city.at(61)
    assert sent() == ["city: xx1: 2 low (first result)"]
    # A station falls silent: other counts
    server.silent = {"S002"}
    server.events["xx1"] = magnified(simulation, 7.2)
    with monkeypatch.context() as patch:
        patch.setattr(watch, place, killed)
        with pytest.raises(KeyboardInterrupt):
            city.at(301)
    assert city.revisions() == ["0001", "0002"]
    assert len(sent()) == 1
    # Its revision is that of the message, whatever is due at the next start
    city.at(310)
    assert sent()[1:] == ["city: xx1: 1 low (changed from 2 low)"]
    city.at(320)
    assert len(sent()) == 2
    assert not (city.event() / OUTBOX).exists()


def test_a_kill_before_the_note_of_a_delivery_repeats_the_message(city, sent, monkeypatch):
    # At least once: whether a command was heard is known after it only
    with monkeypatch.context() as patch:
        patch.setattr(notified_run, "write_json", killed)
        with pytest.raises(KeyboardInterrupt):
            city.at(61)
    city.at(90)
    assert sent() == ["city: xx1: 2 low (first result)"] * 2


def test_the_message_about_a_failure_waits_as_well(city, sent, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(watch, "done_task", lambda *_: 1 / 0)
        patch.setattr(watch, "_deliver", killed)
        with pytest.raises(KeyboardInterrupt):
            city.at(61)
    assert sent() == []
    city.at(90)
    assert sent() == ["city: xx1: failed"]


@pytest.mark.parametrize("damage", [b"{", b"[]", b'{"revision": 7, "failure": null}'])
def test_a_damaged_message_holds_up_nothing(city, sent, damage):
    city.at(61)
    (city.event() / OUTBOX).write_bytes(damage)
    assert city.at(90).errors == ()
    assert not (city.event() / OUTBOX).exists()
    assert len(sent()) == 1
