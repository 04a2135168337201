"""Scripts that redraw the paper and repeat its reliability, with and without real records."""

import re
import runpy
import sys
from pathlib import Path

import pytest

from per_obspy import single_hit

pytestmark = pytest.mark.long

WORKFLOWS = Path(__file__).parents[2] / "workflows"


@pytest.fixture
def start(monkeypatch, capsys):
    """Return the exit code, output and errors of a script in this process, which has libraries."""

    def started(script: str, data: Path, *arguments: str) -> tuple[object, str, str]:
        monkeypatch.syspath_prepend(WORKFLOWS)
        monkeypatch.setenv("PER_OBSPY_DATA", str(data))
        monkeypatch.setattr(sys, "argv", [script, *arguments])
        code: object = 0
        try:
            runpy.run_path(str(WORKFLOWS / script), run_name="__main__")
        except SystemExit as ended:
            code = ended.code
        return code, *capsys.readouterr()

    return started


@pytest.fixture
def output_of(start):
    """Return the output of a script that ends well."""

    def output_of(script: str, data: Path, *arguments: str) -> str:
        code, output, errors = start(script, data, *arguments)
        assert not code, errors
        return output

    return output_of


def test_figures_of_the_simulated_lakebed(output_of, tmp_path):
    said = output_of("paper_figures.py", tmp_path / "absent", "-o", str(tmp_path), "-n", "5")
    drawn = {path.name for path in tmp_path.glob("*.png")}
    assert drawn == {f"fig{number}_simulated_lakebed.png" for number in range(1, 9)} | {
        "correlation_ductility.png"
    }
    assert "a simulated one is drawn" in said
    # five periods make ten pairs, at three gaps
    assert (
        len(re.findall(r"of 10 pairs: bias \d\.\d\d, scatter \d\.\d\d, \d+% under-predicted", said))
        == 3
    )


def test_the_docstring_of_single_hit_says_what_the_page_on_reliability_says():
    page = (WORKFLOWS.parent / "docs" / "reliability.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (0\.\d+) \| (.*) \|$", page, re.MULTILINE)
    assert [ratio for ratio, _ in rows] == ["0.95", "0.8", "0.5", "0.05"]
    for ratio, cells in rows:
        equal, mexico, heavier, _, lighter, _ = cells.split(" | ")
        said = re.search(rf"^\s+{float(ratio):.2f}\s+(.*)$", str(single_hit.__doc__), re.MULTILINE)
        assert said is not None
        assert re.split(r"\s{2,}", said[1].strip()) == [equal, mexico, heavier, lighter]


@pytest.mark.real_data
def test_the_tables_replace_the_measured_part_of_their_page(output_of, real_data, tmp_path):
    page = tmp_path / "page.md"
    page.write_text("By hand.\n\n## Measured\n\nlong ago\n", encoding="utf-8")
    said = output_of("reliability_tables.py", real_data, "-o", str(page), "-n", "3")
    assert page.read_text(encoding="utf-8") == f"By hand.\n\n## Measured\n\n{said}"
    # three pairs, both ways, sixteen components
    assert "of 96 cases" in said


def test_the_tables_need_real_records(start, tmp_path):
    code, _, errors = start("reliability_tables.py", tmp_path / "absent")
    assert code == 2
    assert "PER_OBSPY_DATA" in errors


def test_estimates_for_yielding_pairs(output_of, tmp_path):
    said = output_of("yielding_estimates.py", tmp_path / "absent", "-s", "2", "-n", "15")
    rows = re.findall(
        r"simulated (\w+), 15 pairs \| ([\w .()]+) \| (\d+\.\d+), \d+\.\d+, (\d+)%", said
    )
    assert [row[0] for row in rows] == ["rock"] * 3 + ["lakebed"] * 3
    for ground in ("rock", "lakebed"):
        (_, _, elastic, low), (_, _, linear, _), (_, name, governing, few) = [
            row for row in rows if row[0] == ground
        ]
        assert name == "the one that governs"
        # the largest of several is no smaller than each of them, and so is its median
        assert float(governing) >= max(float(elastic), float(linear))
        assert int(few) <= int(low)
