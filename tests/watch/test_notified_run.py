"""A run that notifies: first result, changed class counts, failure; never twice the same."""

import json
import sys

import pytest

from per_obspy.config import Notify, Run
from per_obspy.errors import CatalogError
from per_obspy.runs.output_folder import Result
from per_obspy.watch import notified_run as module
from per_obspy.watch.notified_run import class_counts, notified_run, notify_result


@pytest.fixture
def sent(tmp_path):
    """A command that keeps every message, and the messages."""
    program = (
        "import json, os, sys; env = {k: v for k, v in os.environ.items() if 'PER_OBSPY_' in k};"
        "print(json.dumps([env, sys.stdin.read()]), file=open(sys.argv[1], 'a'))"
    )
    file = tmp_path / "sent"
    settings = Notify(command=(sys.executable, "-c", program, str(file)))

    def messages():
        lines = file.read_text().splitlines() if file.exists() else []
        return [json.loads(line) for line in lines]

    return settings, messages


def result_of(folder, classes, state="complete"):
    """Write a risk table with these classes and return the result of its run."""
    import pandas as pd

    folder.mkdir(exist_ok=True)
    table = pd.DataFrame({"rank": range(1, len(classes) + 1), "risk_class": classes})
    table.to_parquet(folder / "risk.parquet")
    (folder / "summary.txt").write_text("the summary")
    return Result(folder, {"state": state}, did_nothing=False)


def test_a_first_result_and_changed_counts_are_notified_once(tmp_path, sent):
    settings, messages = sent
    folder = tmp_path / "out"
    for classes in (["red", "green"], ["green", "red"], ["red", "red"]):
        assert notify_result(settings, result_of(folder, classes), "Town") == ()
    kinds = [facts["PER_OBSPY_KIND"] for facts, _ in messages()]
    assert kinds == ["first", "changed"]
    first, changed = (facts["PER_OBSPY_TITLE"] for facts, _ in messages())
    # The class of the worst pair comes first, whatever its name is
    assert first == "Town: 1 red, 1 green (first result)"
    assert changed == "Town: 2 red (changed from 1 red, 1 green)"
    assert messages()[0][1].startswith("the summary\n\nReport: ")
    assert class_counts(folder) == {"red": 2}


def test_the_same_failure_is_notified_once_and_raised_every_time(tmp_path, sent, monkeypatch):
    settings, messages = sent
    problem = "a table of https://me:geheim@host is wrong"

    def failing(*_):
        raise CatalogError("pairs.csv", problem)

    monkeypatch.setattr(module, "run", failing)
    run = Run(name="Town", output=tmp_path / "out", simulation=tmp_path / "x.toml", notify=settings)
    for _ in range(2):
        with pytest.raises(CatalogError, match="geheim"):
            notified_run(run)
    ((facts, text),) = messages()
    assert facts["PER_OBSPY_KIND"] == "failure"
    assert text == "pairs.csv: a table of https://***@host is wrong\n"
    # a result after it, and then the failure again, is news
    monkeypatch.setattr(module, "run", lambda *_: result_of(tmp_path / "out", ["red"]))
    notified_run(run)
    monkeypatch.setattr(module, "run", failing)
    with pytest.raises(CatalogError):
        notified_run(run)
    assert [facts["PER_OBSPY_KIND"] for facts, _ in messages()] == ["failure", "first", "failure"]


def test_a_message_that_fails_is_a_fact_and_no_error(tmp_path):
    settings = Notify(command=("/no/such/program",))
    (reason,) = notify_result(settings, result_of(tmp_path / "out", ["red"]), "Town")
    latest = json.loads((tmp_path / "out" / "notification.json").read_text())
    assert latest["failed"] == [reason]
    assert latest["classes"] == {"red": 1}


@pytest.mark.parametrize("content", ["", "[]", '{"classes": 3}'])
def test_a_damaged_latest_message_counts_as_none(tmp_path, sent, content):
    settings, messages = sent
    result = result_of(tmp_path / "out", ["red"])
    (tmp_path / "out" / "notification.json").write_text(content)
    notify_result(settings, result, "Town")
    assert [facts["PER_OBSPY_KIND"] for facts, _ in messages()] == ["first"]
