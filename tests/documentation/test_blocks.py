"""Every command and code block of README and docs runs, or gives the reason why it does not."""

import contextlib
import os
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pandas as pd
import pytest
from blocks import PYTHON, SHELLS, Block, blocks, commands, pages
from pydantic import ValidationError

from per_obspy.cli import application
from per_obspy.config import Design, Ensemble, Run, Simulation
from per_obspy.config.pairs import TableForm

pytestmark = pytest.mark.long

#: Pages whose files other pages use come first.
FIRST = ("docs/start/assessment.md", "docs/start/planner.md")

ALL = [block for page in pages() for block in blocks(page)]
BY_PAGE = {name: [block for block in ALL if block.page == name] for name in {b.page for b in ALL}}
RUN = [
    name
    for name in (*FIRST, *sorted(BY_PAGE.keys() - set(FIRST)))
    if any(b.kind == "run" and b.language in (*SHELLS, PYTHON) for b in BY_PAGE[name])
]

#: Signs by which a line needs a shell.
SHELL_SIGNS = set("|&;$<>*~(")

#: Models of which a TOML block may be a part.
MODELS = (Run, Design, Ensemble, Simulation, TableForm)

_SHELL = 'per-obspy() { "$PYTHON" -m per_obspy "$@"; }; python() { "$PYTHON" "$@"; }; set -e\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One folder for all pages, where a reader would try them."""
    return tmp_path_factory.mktemp("reader")


@pytest.fixture(scope="module", autouse=True)
def _first_pages(folder):
    """Run the tutorials, whose files and results the other pages use."""
    for name in FIRST:
        _run_page(BY_PAGE[name], folder)


def _run_page(page: list[Block], folder: Path) -> None:
    """Follow a page as a reader does: save files, run commands and programs."""
    with contextlib.chdir(folder):
        for block in page:
            if block.kind == "file":
                Path(block.note).write_text(block.text, encoding="utf-8")
            elif block.kind == "run" and block.language in SHELLS:
                for command in commands(block):
                    _run_command(command, block)
            elif block.kind == "run" and block.language == PYTHON:
                exec(compile(block.text, block.page, "exec"), {})  # the point of this test


def _run_command(command: str, block: Block) -> None:
    """Run one command: per-obspy in this process, which starts faster; others in a shell."""
    text = command.partition("  #")[0].strip()
    words = shlex.split(text)
    if words[0] != "per-obspy" or SHELL_SIGNS & set(text):
        environment = {**os.environ, "PYTHON": sys.executable}
        subprocess.run(["bash", "-c", _SHELL + text], env=environment, check=True)
        return
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", words)
        with pytest.raises(SystemExit) as end:
            application.main()
    assert not end.value.code, f"{block.page}: {text} ends with {end.value.code}"


@pytest.mark.parametrize("name", [name for name in RUN if name not in FIRST])
def test_the_blocks_of_a_page_run(name, folder):
    _run_page(BY_PAGE[name], folder)


def test_the_tutorials_leave_the_files_that_they_name(folder):
    # would catch tutorials that are not run: all other pages begin with their files
    for name in ("out/report.html", "out/risk.csv", "out/summary.txt", "plan/design.qgz"):
        assert (folder / name).is_file(), name


def test_every_block_that_does_not_run_has_a_reason():
    without = [b for b in ALL if b.kind == "not run" and len(b.note.split()) < 4]
    assert without == []


@pytest.mark.parametrize("block", [b for b in ALL if b.language == "toml"], ids=lambda b: b.page)
def test_every_key_of_a_toml_block_exists(block):
    if block.kind == "not run":
        return
    content = tomllib.loads(block.text)
    faults = {model.__name__: _faults(model, content) for model in MODELS}
    assert [] in faults.values(), faults


def _faults(model, content):
    """Return the faults of a part of a configuration, except missing keys."""
    try:
        model.model_validate(content)
    except ValidationError as error:
        whole = {("value_error", ())}  # of the whole file, such as a missing source of records
        return [
            (fault["type"], fault["loc"])
            for fault in error.errors()
            if fault["type"] != "missing" and (fault["type"], fault["loc"]) not in whole
        ]
    return []


def test_the_worked_pairs_are_those_of_the_tutorial(folder):
    text = (pages()[0].parent / "docs" / "start" / "reading.md").read_text(encoding="utf-8")
    lines = text.partition("risk.csv of start/assessment.md -->\n")[2].partition("\n\n")[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines.splitlines()]
    header, _, *shown = rows
    assert header[0] == "pair"
    table = pd.read_parquet(folder / "out" / "risk.parquet").set_index("pair_id")
    assert [row[0] for row in shown] == list(table.index)
    for name, gap, demand, rule, probability, state, impact, severity in shown:
        pair = table.loc[name]
        expected = (
            f"{pair['gap']:g} m",
            f"{pair['demand']:.3f} m",
            pair["demand_rule"],
            f"{pair['probability']:.2f}",
            pair["state"],
            f"{pair['expected_impact_velocity']:.2f} m/s",
            pair["risk_class"],
        )
        assert (gap, demand, rule, probability, state, impact, severity) == expected
    # numbers of the text below the table
    assert table.loc["touching", "impacts"] == 66
    assert table.loc["yielding", ["ductility_1", "ductility_2"]].round(1).tolist() == [3.3, 1.6]
    assert round(table.loc["yielding", "demand_estimated"], 3) == 0.065
    assert round(table.loc["yielding", "missing_gap"], 3) == 0.009
    assert round(table.loc["yielding", "supplemental_damping"], 3) == 0.036
    assert table.loc["yielding", "ln_per_ratio_1"] < 0
    assert table.loc["derived periods", "impact_velocity_84"] == 0
