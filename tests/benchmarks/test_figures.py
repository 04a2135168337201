"""Figures of benchmarks become one JSON file and a page, without running a benchmark."""

import json
import os
from pathlib import Path

import figures
import pytest

from .test_compare import FIGURE

#: Benchmark of two figures, one of them of a peer that is not installed.
SCRIPT = """\
from figures import note
note("ours", 2.00012345, "ms", remark="twice")
note("theirs", 30.0, "ms", peer="no-such-distribution", of="ours")
"""


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder of benchmarks with its template; the page is written there."""
    monkeypatch.setattr(figures, "FOLDER", tmp_path)
    monkeypatch.setattr(figures, "TEMPLATE", tmp_path / "page.md")
    monkeypatch.setattr(figures, "PAGE", tmp_path / "benchmarks.md")
    monkeypatch.setattr(figures, "revision", lambda: "1234567")
    paths = [str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(paths))
    (tmp_path / "page.md").write_text("# Page\n\n{{quick}}\n\n{{slow}}\n")
    (tmp_path / "quick.py").write_text(SCRIPT)
    return tmp_path


def test_a_script_becomes_figures_and_a_table(place):
    file = place / "all.json"
    figures.main(file, ["quick"])
    ours, theirs = figures.read(file)
    assert (ours["script"], ours["name"], ours["value"], ours["unit"]) == (
        "quick",
        "ours",
        2.0,
        "ms",
    )
    assert ours["revision"] == "1234567"
    assert theirs["peer_version"] == "unknown"
    page = (place / "benchmarks.md").read_text()
    assert "| ours | 2 ms |  | twice |" in page
    # Relative to ours
    assert "| theirs | 30 ms | 15 |  |" in page
    assert "no-such-distribution unknown" in page
    assert "*Not measured in this run.*" in page
    # Lines in which scripts note their figures are gone
    assert {path.name for path in place.glob("all*")} == {"all.json"}


def test_one_script_again_keeps_the_figures_of_all_others(place):
    file = place / "all.json"
    here = {"machine": figures.machine()}
    old = [FIGURE | here | {"script": "slow"}, FIGURE | here | {"script": "quick", "name": "older"}]
    file.write_text(json.dumps({"figures": old}))
    figures.main(file, ["quick"])
    assert [one["name"] for one in figures.read(file)] == ["PER", "ours", "theirs"]


def test_figures_of_other_machines_stay_and_have_their_own_table(place, monkeypatch):
    file = place / "all.json"
    here = {"machine": figures.machine(), "script": "quick"}
    old = [FIGURE | {"script": "quick"}, FIGURE | here | {"name": "older"}]
    # A newer machine takes the place of that of the same maker
    old.append(old[1] | {"machine": here["machine"].split()[0] + " of last year"})
    file.write_text(json.dumps({"figures": old}))
    monkeypatch.setattr(figures, "SCRIPTS", ["quick"])
    figures.main(file, [])
    found = [(one["machine"], one["name"]) for one in figures.read(file)]
    assert found == [("a core", "PER"), *((here["machine"], name) for name in ("ours", "theirs"))]
    page = (place / "benchmarks.md").read_text()
    # the last measured first
    assert 0 < page.index("| ours |") < page.index("*a core; ") < page.index("| PER |")


def test_a_damaged_file_is_not_written_over(place):
    file = place / "all.json"
    file.write_text('{"figures": [')
    with pytest.raises(figures.Damaged, match="no file of figures"):
        figures.main(file, ["quick"])
    assert file.read_text() == '{"figures": ['


def test_a_script_alone_notes_nothing(monkeypatch, tmp_path):
    monkeypatch.delenv(figures.LINES, raising=False)
    monkeypatch.chdir(tmp_path)
    figures.note("ours", 1.0, "ms")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("value", "text"), [(1234.5, "1230"), (987654.0, "988000"), (0.012345, "0.0123"), (12.0, "12")]
)
def test_three_digits_without_exponent(value, text):
    assert figures.digits(value) == text


def test_every_measured_script_exists_and_has_its_place_on_the_page():
    folder = Path(figures.__file__).parent
    template = (folder / "page.md").read_text(encoding="utf-8")
    for script in figures.SCRIPTS:
        assert (folder / f"{script}.py").is_file()
        assert f"\n{{{{{script}}}}}\n" in template


def test_the_page_of_the_repository_is_that_of_its_figures():
    # would catch a page that was edited instead of its template
    found = figures.read(Path(figures.PAGE).with_suffix(".json"))
    template = figures.TEMPLATE.read_text(encoding="utf-8")
    assert figures.PAGE.read_text(encoding="utf-8") == figures.page(found, template)


def test_the_machine_has_the_width_of_its_vectors(monkeypatch):
    # mutation: figures of both widths that cannot be told apart
    monkeypatch.setenv("NUMBA_CPU_FEATURES", f"+avx512f,{figures.FULL_WIDTH}")
    assert "vectors of full width" in figures.machine()
    monkeypatch.setenv("NUMBA_CPU_FEATURES", "+avx512f")
    assert "width of vectors by the compiler" in figures.machine()


def test_processors_of_one_name_are_told_apart(tmp_path, monkeypatch):
    names = []
    monkeypatch.delenv("NUMBA_CPU_FEATURES", raising=False)
    for family in ("25", "26"):
        facts = tmp_path / family
        facts.write_text(f"cpu family\t: {family}\nmodel\t\t: 17\nmodel name\t: AMD EPYC\n")
        monkeypatch.setattr(figures, "PROCESSORS", facts)
        names.append(figures.machine().partition(", width")[0])
    assert names == ["AMD EPYC (family 25, model 17)", "AMD EPYC (family 26, model 17)"]
    # Other systems have no such file
    monkeypatch.setattr(figures, "PROCESSORS", tmp_path / "none")
    assert "family" not in figures.machine()
