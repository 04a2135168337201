"""Figures that became worse are named, and files that do not compare are refused."""

import json

import pytest
from compare import main

FIGURE = {
    "script": "spectra",
    "name": "PER",
    "value": 10.0,
    "unit": "ms",
    "peer": "",
    "peer_version": "",
    "of": "",
    "remark": "",
    "machine": "a core",
    "load_before": 0.1,
    "revision": "1234567",
    "date": "2026-11-23",
}


@pytest.fixture
def files(tmp_path):
    """Return a function that writes both files from the differences of their figures."""

    def files(old, new):
        paths = tmp_path / "old.json", tmp_path / "new.json"
        for path, figures in zip(paths, (old, new), strict=True):
            path.write_text(json.dumps({"figures": [FIGURE | one for one in figures]}))
        return paths

    return files


#: Values before and after, their unit, and whether that is worse by more than a tenth.
CHANGES = [(10.0, 10.9, "ms", False), (10.0, 11.1, "ms", True), (10.0, 5.0, "ms", False)]
CHANGES += [(2.0, 2.3, "GB", True), (100.0, 92.0, "pairs/s", False)]
CHANGES += [(100.0, 90.0, "pairs/s", True), (100.0, 200.0, "pairs/s", False)]


@pytest.mark.parametrize(("before", "after", "unit", "is_worse"), CHANGES)
def test_a_figure_that_became_worse_by_more_than_a_tenth_is_named(
    files, capsys, before, after, unit, is_worse
):
    old, new = files([{"value": before, "unit": unit}], [{"value": after, "unit": unit}])
    assert main(old, new) == int(is_worse)
    out, _ = capsys.readouterr()
    assert (f"spectra: PER: {before:g} -> {after:g} {unit}" in out) == is_worse
    assert out.endswith("1 figures compared\n")


def test_a_figure_that_is_gone_or_has_another_unit_is_named(files, capsys):
    old = [{}, {"name": "SD"}, {"name": "SV"}]
    assert main(*files(old, [{}, {"name": "SD", "unit": "s"}])) == 1
    out, _ = capsys.readouterr()
    lines = ["spectra: SD: not in the new file", "spectra: SV: not in the new file"]
    assert out.splitlines() == [*lines, "1 figures compared"]


def test_figures_of_the_same_name_belong_to_their_script(files):
    old = [{"value": 10.0}, {"value": 1.0, "script": "rows"}]
    new = [{"value": 1.0, "script": "rows"}, {"value": 10.0}]
    assert main(*files(old, new)) == 0


def test_a_slower_peer_is_no_matter(files):
    changed = [{}, {"name": "other", "peer": "pyrotd", "value": 50.0}]
    assert main(*files([{}, {"name": "other", "peer": "pyrotd"}], changed)) == 0


def test_two_machines_do_not_compare(files, capsys):
    old, new = files([{}], [{"machine": "another core", "value": 20.0}])
    assert main(old, new) == 2
    out, _ = capsys.readouterr()
    assert out.startswith("different machines: a core; another core\n")
    assert "2.00 times worse" in out


def test_each_machine_compares_with_itself(files, capsys):
    old = [{}, {"machine": "another core", "value": 20.0}, {"machine": "a third", "value": 1.0}]
    new = [{"machine": "another core", "value": 21.0}, {"value": 12.0}]
    assert main(*files(old, new)) == 1
    out, _ = capsys.readouterr()
    assert out.startswith("spectra: PER: 10 -> 12 ms, 1.20 times worse")
    assert out.endswith("\n2 figures compared\n")


def test_files_without_a_common_figure_do_not_compare(files):
    assert main(*files([], [{}])) == 2


DAMAGED = {
    "cut": '{"figures": [',
    "another file": '{"numbers": []}',
    "a list": "[1]",
    "no object": '{"figures": [1]}',
    "text for a number": json.dumps({"figures": [FIGURE | {"value": "fast"}]}),
    "not a number": json.dumps({"figures": [FIGURE | {"value": float("nan")}]}),
    "zero": json.dumps({"figures": [FIGURE | {"value": 0.0}]}),
    "no unit": json.dumps({"figures": [{k: v for k, v in FIGURE.items() if k != "unit"}]}),
}


@pytest.mark.parametrize("kind", DAMAGED)
def test_a_damaged_file_is_one_line(files, capsys, kind):
    old, new = files([{}], [{}])
    new.write_text(DAMAGED[kind])
    assert main(old, new) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"{new}: ")
    assert err.count("\n") == 1


def test_a_missing_file_is_one_line(files, tmp_path, capsys):
    old, _ = files([{}], [{}])
    assert main(old, tmp_path / "absent.json") == 2
    assert capsys.readouterr().err.count("\n") == 1
