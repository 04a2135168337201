"""
Messy tables through ``pairs check`` and ``run``: read, refused or suspected as in the page.

The table of ``docs/messy_tables.md`` is compared with the output of both commands; if it
differs, the new one is in ``messy_tables.md`` of the test's folder.
"""

import io
import json
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple

import pandas as pd
import pytest
from messy_tables import NAMES, ROWS, Messy, plain, readable, refused, suspected, text_of
from pandas.testing import assert_frame_equal

from per_obspy import read_pairs
from per_obspy.cli import application
from per_obspy.config import Scenario
from per_obspy.inventory.schema import COLUMNS
from per_obspy.inventory.suspicions import ROW_SUSPICIONS
from per_obspy.simulation.earthquake import simulate, write_simulation

from .small_run import SPECTRA, plain_reports

pytestmark = pytest.mark.long

PAGE = Path(__file__).parents[2] / "docs" / "messy_tables.md"
JUDGED = ["gap", "height_1", "mass_1", "demand", "probability", "state"]
HEAD = 'name = "x"\noutput = "out"\nworkers = 1\n[records]\nfolder = "records"\n'


class Said(NamedTuple):
    """Exit code, output and errors of a command."""

    code: int
    out: str
    err: str


class Outcome(NamedTuple):
    """Output of ``pairs check`` and ``run`` for a table, and the pairs that the run judged."""

    checked: Said
    ran: Said
    pairs: pd.DataFrame | None


def called(*arguments: str) -> Said:
    """Return the output of a command."""
    out, err = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.setattr(sys, "argv", ["per-obspy", *arguments])
        with pytest.raises(SystemExit) as stop:
            application.main()
    code = stop.value.code
    return Said(code if isinstance(code, int) else 0, out.getvalue(), err.getvalue())


@pytest.fixture(scope="module")
def tried(tmp_path_factory):
    """Return a function that tries a table with the record of one simulated station."""
    folder = tmp_path_factory.mktemp("messy")
    write_simulation(simulate(Scenario(stations=1, dt=0.02)), folder / "records")

    def tried(messy: Messy, form: str = "") -> Outcome:
        Path(messy.file).write_bytes(messy.content)
        Path("run.toml").write_text(f'{HEAD}[pairs]\nfile = "{messy.file}"\n{form}{SPECTRA}')
        said = called("pairs", "check", messy.file), called("run", "run.toml")
        if said[1].code != 0:
            return Outcome(*said, None)
        table = pd.read_parquet("out/risk.parquet").set_index("pair_id").sort_index()
        return Outcome(*said, table[JUDGED])

    with pytest.MonkeyPatch.context() as patch, plain_reports():
        patch.chdir(folder)
        yield tried


@pytest.fixture(scope="module")
def outcomes(tried):
    """Output of both commands for every kind of messy table, and for the plain one."""
    tables = {"plain": plain(), **readable(), **refused(), "suspected": suspected()}
    return {kind: tried(messy) for kind, messy in tables.items()}


def test_every_readable_table_gives_the_results_of_the_plain_one(outcomes, tmp_path):
    # would catch a unit, a mark or a heading that is taken for another one
    expected = outcomes["plain"].pairs
    (tmp_path / "pairs.csv").write_bytes(plain().content)
    known = read_pairs(tmp_path / "pairs.csv")[[name for name in NAMES if name in COLUMNS]]
    for kind, messy in readable().items():
        checked, ran, pairs = outcomes[kind]
        assert (checked.code, ran.code) == (0, 0), (kind, checked, ran)
        (tmp_path / messy.file).write_bytes(messy.content)
        # Feet and inches are rounded to nine digits
        read = read_pairs(tmp_path / messy.file)[known.columns]
        assert_frame_equal(read, known, rtol=1e-9, check_exact=False)
        assert_frame_equal(pairs, expected, rtol=1e-6, check_exact=False)
        # One and the same line on both consoles
        line = checked.out.partition("\n")[0]
        assert line.startswith(f"{messy.file}: read as ")
        assert f"per-obspy: {line}\n" in ran.err


def test_every_doubtful_table_is_refused_in_one_line_by_both_commands(outcomes):
    for kind, messy in refused().items():
        checked, ran, _ = outcomes[kind]
        assert (checked.code, ran.code) == (2, 2), (kind, checked, ran)
        for said in (checked, ran):
            assert said.err.count("\n") == 1
            assert messy.file in said.err


def test_a_plain_table_is_read_without_a_word(outcomes):
    checked, ran, _ = outcomes["plain"]
    assert "read as" not in checked.out + ran.out + ran.err
    assert "Suspicious" not in checked.out


def test_gaps_in_centimetres_are_suspected_by_both_commands(outcomes, tried):
    checked, ran, _ = outcomes["suspected"]
    sentence = "1 of 1 gaps above 0 are wider than 3 m: given in centimetres or millimetres?"
    assert f"Suspicious: {sentence}" in checked.out
    assert f"per-obspy: {sentence}\n" in ran.err
    # the mend that pairs check proposes
    assert '[pairs.units]\ngap = "cm"' in checked.out
    mended = tried(suspected(), '[pairs.units]\ngap = "cm"\n')
    assert "wider than 3 m" not in mended.ran.err
    assert mended.pairs.loc["a", "gap"] == 0.05


def test_the_record_of_a_run_has_what_the_console_says(tried):
    tried(readable()["Turkish, cp1254, gap in cm"])
    notes = json.loads(Path("out/run.json").read_text())["pair_tables"]
    assert len(notes["recognised"]) == 1
    assert notes["recognised"][0].startswith("ciftler.csv: read as text in cp1254; ")
    tried(suspected())
    notes = json.loads(Path("out/run.json").read_text())["pair_tables"]
    assert notes["recognised"] == []
    assert "centimetres" in notes["suspicions"][0]


def test_odd_rows_have_the_same_sentences_in_every_command_and_flags_in_the_table(tried):
    # would catch a path with rules of its own, and flags that a chunk loses
    again = ("d", 0.07, *ROWS[0][5:8], *ROWS[0][2:5], "", "")
    one_place = ("e", 0.3, 0.3006, 0.1001, 9.0, 0.3006, 0.1001, 12.0, "", "")
    wide = ("f", 4.0, 0.3008, 0.1001, 9.0, 0.3009, 0.1001, 12.0, "", "")
    light = ("g", 0.1, 0.3062, -0.1062, 9.0, 0.3063, -0.1062, 12.0, 900.0, "")
    table = text_of(NAMES, [*ROWS, again, one_place, wide, light]).encode()
    checked, ran, _ = tried(Messy("pairs.csv", table))
    assert (checked.code, ran.code) == (0, 0)
    notes = json.loads(Path("out/run.json").read_text())["pair_tables"]["suspicions"]
    assert len(notes) == 4
    assert read_pairs("pairs.csv").attrs["suspicions"] == notes
    for sentence in notes:
        assert f"Suspicious: {sentence}\n" in checked.out
        assert f"per-obspy: {sentence}\n" in ran.err
    # one flag for each odd row, and none for the others
    flags = pd.read_parquet("out/risk.parquet").set_index("pair_id")["flags"].str.split()
    odd = flags.map(lambda names: [name for name in names if name in ROW_SUSPICIONS]).to_dict()
    assert {name: odd[name] for name in "abc"} == {"a": [], "b": [], "c": []}
    assert (odd["d"], odd["e"], odd["f"]) == (["repeated_pair"], ["odd_positions"], ["odd_gap"])
    assert odd["g"] == ["odd_building"]
    meanings = pd.read_csv("out/risk.columns.csv").set_index("name")["meaning"]
    assert meanings["flag_repeated_pair"] == ROW_SUSPICIONS["repeated_pair"]


#: What the user writes into ``[pairs]`` -> kind of the refused table that it mends.
MENDS = {
    'decimal = ","\n': "`2,345` and no number that decides",
    'encoding = "cp1254"\n': "names in cp1252 or cp1254, English headings",
    '[pairs.columns]\ngap = "distance"\n': "an ambiguous heading",
    'sheet = "2026"\n': "a workbook with two pair tables",
}


@pytest.mark.parametrize("form", MENDS)
def test_what_is_refused_is_read_with_what_the_message_asks_for(tried, form):
    _, ran, pairs = tried(refused()[MENDS[form]], form)
    assert ran.code == 0, ran
    assert list(pairs.index) == (["Şişli-1", "Şişli-2"] if "encoding" in form else ["a", "b", "c"])
    if "decimal" in form:
        assert pairs["gap"].tolist() == [2.345] * 3


def test_the_page_has_what_the_commands_say(outcomes, tmp_path):
    lines = ["| table | outcome | output of both commands |", "|---|---|---|"]
    lines += [f"| {kind} | read | {_cell(outcomes[kind].checked.out)} |" for kind in readable()]
    lines += [f"| {kind} | refused | {_cell(outcomes[kind].checked.err)} |" for kind in refused()]
    said = outcomes["suspected"].ran.err.partition("per-obspy: ")[2]
    lines.append(f"| gaps in cm under the heading `gap` | suspected | {_cell(said)} |")
    found = "\n".join(lines)
    (tmp_path / "messy_tables.md").write_text(found, encoding="utf-8")
    assert found in PAGE.read_text(encoding="utf-8"), f"see {tmp_path / 'messy_tables.md'}"


def _cell(text: str) -> str:
    """Return the first line of a command as a cell of the page."""
    line = text.partition("\n")[0].removeprefix("per-obspy: ")
    return line.replace("|", "\\|").strip()
