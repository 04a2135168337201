"""A run that notifies: first result, changed class counts, failure; never twice the same."""

import json
import sys

import pandas as pd
import pytest

from per_obspy.config import Run, checked
from per_obspy.config.watch import Group
from per_obspy.errors import CatalogError
from per_obspy.runs.output_folder import Result
from per_obspy.watch import notified_run as module
from per_obspy.watch.groups import counts_of
from per_obspy.watch.notified_run import class_counts, notified_run, notify_result, undelivered


def notifying(folder, **notify):
    """Return the settings of a run with messages."""
    run = {"name": "Town", "output": folder / "out", "simulation": folder / "x.toml"}
    return checked(Run, {**run, "notify": notify})


@pytest.fixture
def sent(tmp_path):
    """A command that keeps every message, and the messages."""
    program = (
        "import json, os, sys; env = {k: v for k, v in os.environ.items() if 'PER_OBSPY_' in k};"
        "print(json.dumps([env, sys.stdin.read()]), file=open(sys.argv[1], 'a'))"
    )
    file = tmp_path / "sent"
    settings = notifying(tmp_path, command=(sys.executable, "-S", "-c", program, str(file)))

    def messages():
        lines = file.read_text().splitlines() if file.exists() else []
        return [json.loads(line) for line in lines]

    return settings, messages


def result_of(folder, classes, longitude=(), simulated=False):
    """Write a risk table with these classes and return the result of its run."""
    folder.mkdir(exist_ok=True)
    table = {"rank": range(1, len(classes) + 1), "risk_class": classes}
    places = {"longitude": list(longitude), "latitude": 0.5, "quarter": "7"} if longitude else {}
    pd.DataFrame(table | places).to_parquet(folder / "risk.parquet")
    (folder / "summary.txt").write_text("the summary")
    record = {"state": "complete", "simulated": simulated}
    return Result(folder, record, did_nothing=False)


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
    for _ in range(2):
        with pytest.raises(CatalogError, match="geheim"):
            notified_run(settings)
    ((facts, text),) = messages()
    assert facts["PER_OBSPY_KIND"] == "failure"
    assert text == "pairs.csv: a table of https://***@host is wrong\n"
    # a result after it, and then the failure again, is news
    monkeypatch.setattr(module, "run", lambda *_: result_of(tmp_path / "out", ["red"]))
    notified_run(settings)
    monkeypatch.setattr(module, "run", failing)
    with pytest.raises(CatalogError):
        notified_run(settings)
    assert [facts["PER_OBSPY_KIND"] for facts, _ in messages()] == ["failure", "first", "failure"]


def test_a_message_that_fails_is_a_fact_and_no_error(tmp_path):
    settings = notifying(tmp_path, command=["/no/such/program"])
    (reason,) = notify_result(settings, result_of(tmp_path / "out", ["red"]), "Town")
    latest = json.loads((tmp_path / "out" / "notification.json").read_text())
    assert latest["failed"] == [reason]
    assert latest["classes"] == {"red": 1}


@pytest.mark.parametrize("content", ["", "[]", '{"classes": 3, "groups": [1]}'])
def test_a_damaged_latest_message_counts_as_none(tmp_path, sent, content):
    settings, messages = sent
    result = result_of(tmp_path / "out", ["red"])
    (tmp_path / "out" / "notification.json").write_text(content)
    notify_result(settings, result, "Town")
    assert [facts["PER_OBSPY_KIND"] for facts, _ in messages()] == ["first"]


#: A town from 0 to 1 degree east, and the one east of it, as a FeatureCollection and as WKT.
WEST = (
    '{"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {}, "geometry": '
    '{"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]]}}]}'
)
EAST = "MULTIPOLYGON (((1 0, 2 0, 2 1, 1 1, 1 0)))"


@pytest.fixture
def groups(tmp_path, sent):
    """Two towns, and everybody who minds a severe pair."""
    (tmp_path / "west.json").write_text(WEST)
    (tmp_path / "east.wkt").write_text(EAST)
    notify = sent[0].notify.model_dump() | {
        "groups": [
            {
                "name": "West",
                "address": "w@x",
                "area": tmp_path / "west.json",
                "least_class": "high",
            },
            {
                "name": "Este",
                "address": "e@x",
                "area": tmp_path / "east.wkt",
                "least_class": "high",
                "least_count": 2,
                "language": "es",
            },
            {"name": "Seven", "address": "7@x", "where": {"quarter": "7"}, "least_class": "severe"},
        ]
    }
    return notifying(tmp_path, **notify)


def test_a_group_hears_of_its_area_from_its_threshold_on_and_of_changes_there_only(
    tmp_path, sent, groups
):
    def told(classes, longitude, **facts):
        before = len(sent[1]())
        notify_result(groups, result_of(tmp_path / "out", classes, longitude, **facts), "Town")
        new = [(facts, text) for facts, text in sent[1]()[before:] if facts["PER_OBSPY_GROUP"]]
        return {facts["PER_OBSPY_ADDRESS"]: (facts["PER_OBSPY_TITLE"], text) for facts, text in new}

    # One high pair in each town: that is enough for the west only
    first = told(["high", "high", "low"], [0.5, 1.5, 0.2], simulated=True)
    assert list(first) == ["w@x"]
    title, text = first["w@x"]
    assert title == "Town: West: 1 high (first result)"
    assert text.startswith("SIMULATED ground motion")
    assert "Pairs of neighbouring buildings of class high or worse in West: 1 high." in text
    assert "nothing says that buildings are safe" in text
    # A second one in the east, and one more low pair in the west, which hears nothing of it
    second = told(["high", "high", "high", "low", "low"], [0.5, 1.5, 1.6, 0.2, 0.3])
    assert list(second) == ["e@x"]
    title, text = second["e@x"]
    assert title == "Town: Este: 2 alta (primer resultado)"
    assert "Pares de edificios vecinos de clase alta o peor en Este: 2 alta." in text
    # A severe one in the west, which is in quarter 7 as well; the east falls below its threshold
    third = told(["severe", "high", "low"], [0.5, 1.5, 0.2])
    assert {address: title for address, (title, _) in third.items()} == {
        "w@x": "Town: West: 1 severe (before: 1 high)",
        "e@x": "Town: Este: 1 alta (ya no alcanza su umbral; antes: 2 alta)",
        "7@x": "Town: Seven: 1 severe (first result)",
    }
    # Below its threshold the east hears nothing more, and nothing new is no message
    assert told(["severe", "low", "low"], [0.5, 1.5, 0.2]) == {}
    assert told(["severe", "low", "low"], [0.5, 1.5, 0.2]) == {}
    # The inventory has lost a column: two groups are told as before, and the reason is a fact
    table = result_of(tmp_path / "out", ["severe", "severe", "low"], [0.5, 0.6, 1.5])
    pd.read_parquet(tmp_path / "out" / "risk.parquet").drop(columns="quarter").to_parquet(
        tmp_path / "out" / "risk.parquet"
    )
    (reason,) = notify_result(groups, table, "Town")
    assert "notification of Seven: notify.groups: Seven: where: the risk table has not" in reason
    assert undelivered([tmp_path / "out"]) == reason
    assert sent[1]()[-1][0]["PER_OBSPY_TITLE"] == "Town: West: 2 severe (before: 1 severe)"


def test_pairs_of_a_group_are_found_however_their_values_are_written(tmp_path):
    # would catch groups that hear nothing for ever: a column of numbers with an empty cell, an
    # area across 180 degrees; text with a zero in front is another quarter
    folder = result_of(tmp_path / "out", ["high"] * 3, [-179.5, 179.5, 0.0]).folder
    table = pd.read_parquet(folder / "risk.parquet")
    table.assign(quarter=[7.0, 8.0, None], code=["7", "07", None]).to_parquet(
        folder / "risk.parquet"
    )
    (tmp_path / "area").write_text("POLYGON ((179 0, 181 0, 181 1, 179 1, 179 0))")

    def count(**choice):
        group = Group(name="a", address="b", least_class="high", **choice)
        return sum(counts_of(folder, group, {"high": 0.0}).values())

    assert count(where={"quarter": "7"}) == count(where={"code": "7"}) == 1
    assert count(area=tmp_path / "area") == 2
    for nobody in ({"quarter": "9"}, {"code": 'it\'s "7"'}, {"code": "8", "quarter": "8"}):
        with pytest.raises(CatalogError, match="groups: a: no pair of the risk table is"):
            count(where=nobody)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (
            {"least_class": "huge"},
            r"notify\.groups\.0\.least_class: 'huge' is none of severe, high",
        ),
        ({"language": "xx"}, r"notify\.groups\.0\.language: 'xx' is no language"),
        ({"least_count": 0}, r"notify\.groups\.0\.least_count"),
        ({"address": ""}, r"notify\.groups\.0: give either address, or Apprise URLs"),
        ({"apprise_urls_variable": "URLS"}, r"notify\.groups\.0: give either address"),
        ({"area": "absent"}, r"notify\.groups\.0\.area: absent: cannot be read.*No such file"),
        ({"area": "POINT (1 2)"}, r"groups\.0\.area: .*holds something else than polygons"),
        ({"area": "POLYGON EMPTY"}, r"groups\.0\.area: .*holds something else than polygons"),
        ({"area": "POLYGON ((0 0, 1 1, 0 1, 1 0, 0 0))"}, "not valid: Self-intersection"),
        ({"area": "POLYGON ((0 0, 9999 0, 9999 9, 0 0))"}, "is not in degrees"),
        ({"area": '{"type": "Nonsense"}'}, "cannot be read as GeoJSON or WKT"),
    ],
)
def test_a_wrong_group_is_one_line_with_its_key(tmp_path, change, problem):
    if " " in change.get("area", ""):
        (tmp_path / "area").write_text(change["area"])
        change = {"area": tmp_path / "area"}
    group = {"name": "a", "address": "b", "least_class": "high", **change}
    with pytest.raises(CatalogError, match=problem) as error:
        notified_run(notifying(tmp_path, command=["mail"], groups=[group]))
    assert "\n" not in str(error.value)
    assert not (tmp_path / "out").exists()


def test_groups_have_names_of_their_own_and_a_way(tmp_path):
    group = {"name": "a", "address": "b", "least_class": "high"}
    with pytest.raises(CatalogError, match=r"notify: groups: 'a' has an address: give command"):
        notifying(tmp_path, groups=[group])
    with pytest.raises(CatalogError, match=r"notify: groups: the name 'a' occurs twice"):
        notifying(tmp_path, command=["mail"], groups=[group, group])
