"""Questions of ``pairs check`` in a terminal, and its output with and without one."""

import pytest
from messy_tables import NAMES, ROWS, readable, text_of

from per_obspy import read_pairs
from per_obspy.cli import pairs

DISTANCE = ["distance" if name == "gap" else name for name in NAMES]


@pytest.fixture
def answering(monkeypatch):
    """Return a function that makes a terminal whose user gives these answers."""

    def answering(*answers):
        given = iter(answers)
        monkeypatch.setattr(pairs, "is_terminal", lambda: True)
        monkeypatch.setattr("builtins.input", lambda _: next(given))
        return given

    return answering


@pytest.fixture
def table(tmp_path):
    """A table whose gaps are in cm under an ambiguous heading."""
    rows = [[*row] for row in ROWS]
    for row in rows:
        row[1] *= 100.0
    path = tmp_path / "pairs.csv"
    path.write_text(text_of(DISTANCE, rows))
    return path


def test_answers_are_written_beside_the_table_and_read_by_everyone(call, answering, table):
    # a wrong number and a wrong unit are asked again
    left = answering("99", "", "kg", "cm")
    code, out, err = call("pairs", "check", table, "--write")
    assert (code, list(left)) == (0, [])
    assert "gap (clear distance between" in out
    assert "'kg' is no unit of gap" in out
    assert "pairs.csv.toml" in err
    written = table.with_name("pairs.csv.toml").read_text()
    assert '[columns]\ngap = "distance"\n\n[units]\ngap = "cm"\n' in written
    assert read_pairs(table)["gap"].tolist() == [row[1] for row in ROWS]


def test_no_answer_leaves_the_column_missing(call, answering, table):
    answering("0")
    code, _, err = call("pairs", "check", table)
    assert code == 2
    assert 'gap = "distance"' in err
    assert not table.with_name("pairs.csv.toml").exists()


def test_without_a_terminal_nothing_is_asked_or_guessed(call, monkeypatch, table):
    monkeypatch.setattr("builtins.input", lambda _: pytest.fail("asked"))
    code, _, err = call("pairs", "check", table, "--write")
    assert (code, err.count("\n")) == (2, 1)
    assert not table.with_name("pairs.csv.toml").exists()
    # a unit that is only likely is proposed, not written
    table.write_text(table.read_text().replace("distance", "gap"))
    code, out, _ = call("pairs", "check", table, "--write")
    assert code == 0
    assert "Suspicious" in out
    assert "[units]" not in table.with_name("pairs.csv.toml").read_text()


def test_what_is_recognised_is_written_and_means_the_same(call, tmp_path):
    messy = readable()["Spanish, cp1252, gap in cm, mass in t"]
    path = tmp_path / messy.file
    path.write_bytes(messy.content)
    before = read_pairs(path)
    assert call("pairs", "check", path, "--write")[0] == 0
    written = (tmp_path / "pares.csv.toml").read_text(encoding="utf-8")
    assert 'gap = "Separación (cm)"' in written
    assert 'mass_1 = "t"' in written
    after = read_pairs(path)
    assert after["gap"].tolist() == before["gap"].tolist()
    assert after["mass_1"].tolist() == before["mass_1"].tolist()
