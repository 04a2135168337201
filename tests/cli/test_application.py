"""
The command line as a user meets it: help, exit codes, one line per error, no traceback.

Covers ``per_obspy.cli.printing``, ``per_obspy.cli.printing`` and
``per_obspy.cli.run``.
"""

import json
import os
import signal
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

import pandas as pd
import pytest

import per_obspy
from per_obspy.runs.output_folder import locked_folder

CHECKOUT = Path(__file__).parents[2]
HEADER = "pair_id,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,gap"
ROW = "a,0.3,0.0,10,0.3001,0.0,12,0.05"


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    """A folder of simulated records, made by the command."""
    folder = tmp_path_factory.mktemp("records")
    (folder / "scenario.toml").write_text("[scenario]\nstations = 2\ndt = 0.02\n")
    command = [
        sys.executable,
        "-m",
        "per_obspy",
        "simulate",
        str(folder / "scenario.toml"),
        "-o",
        str(folder / "made"),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "6 simulated records" in done.stdout
    return folder / "made"


@pytest.fixture
def configuration(records, tmp_path):
    """A run of those records on one pair of buildings."""
    (tmp_path / "pairs.csv").write_text(f"{HEADER}\n{ROW}\n")
    file = tmp_path / "run.toml"
    file.write_text(
        f'name = "one pair"\noutput = "out"\nworkers = 1\n[records]\nfolder = "{records}"\n'
        '[pairs]\nfile = "pairs.csv"\n[screening]\nlargest_distance = 1e5\n[spectra]\ncount = 5\n'
    )
    return file


def test_version(call):
    code, out, _ = call("--version")
    assert (code, out.strip()) == (0, per_obspy.__version__)
    assert out.strip() == version("per_obspy")


def test_help_names_the_section_of_the_configuration(call):
    # would catch: square brackets taken for markup
    code, out, _ = call("fetch", "-h")
    assert code == 0
    assert "[records.fdsn]" in out


@pytest.mark.parametrize("arguments", [["--help"], ["catalog", "list"]])
def test_a_reader_that_has_enough_is_no_failure(arguments):
    # 1 is left to crashes
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "per_obspy", *arguments]
    done = subprocess.run(
        command, check=False, stdout=write, stderr=subprocess.PIPE, text=True, cwd=CHECKOUT
    )
    os.close(write)
    assert (done.returncode, done.stderr) == (0, "")


def test_help_loads_nothing_heavy():
    code = "import sys, per_obspy.cli.application; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"numba", "pandas", "xarray", "obspy", "matplotlib", "numpy"} & set(loaded)


def test_a_run_prints_the_worst_pairs_and_where_everything_is(call, configuration):
    code, out, err = call("run", configuration)
    assert code == 0
    assert "1 pair" in out
    assert "looked at" not in out
    assert "The worst pair" in out
    assert "risk.csv" in out
    assert "stations: 2 of 2" in err  # plain lines, because nobody watches


@pytest.mark.parametrize("name", ["=1+1", "007"])
def test_names_of_the_worst_pairs_are_those_of_the_pair_table(call, configuration, name):
    # would catch: an apostrophe before a formula, a number for digits
    row = f"{name}{ROW[ROW.index(',') :]}"
    (configuration.parent / "pairs.csv").write_text(f"{HEADER}\n{row}\n")
    code, out, _ = call("run", configuration)
    assert code == 0
    assert f" {name} " in out


def test_what_was_seen_is_compared(call, configuration):
    (configuration.parent / "pairs.csv").write_text(
        f"{HEADER},observed\n{ROW},0\nb{ROW[1:-4]}0,1\nc{ROW[1:]},\n"
    )
    code, out, _ = call("run", configuration)
    assert code == 0
    # a touching pair pounds; the other has five times the gap that it needs
    assert "2 pairs were looked at, 1 pounded: 100% of the pounded ones were yes or likely" in out
    assert "0% of the others yes" in out
    assert (configuration.parent / "out" / "figures" / "reliability.png").is_file()


def test_json_is_for_machines(call, configuration):
    code, out, _ = call("run", configuration, "--json")
    assert code == 0
    assert json.loads(out)["counts"]["pairs"] == 1


def test_pairs_are_screened_again_with_the_stations_of_a_run(call, configuration):
    code, _, err = call("screen", configuration)
    assert code == 2
    assert "no stations here: run `per-obspy run` first" in err.strip().splitlines()[-1]
    call("run", configuration)
    (configuration.parent / "pairs.csv").write_text(f"{HEADER}\n{ROW}\nb{ROW[1:]}\n")
    code, out, _ = call("screen", configuration, "--json")
    assert code == 0
    assert json.loads(out)["counts"]["pairs"] == 2


def test_a_table_that_shrinks_is_told_and_stops_a_strict_run(call, configuration):
    # would catch: a half saved table that replaces the result without a word
    table = configuration.parent / "pairs.csv"
    table.write_text(f"{HEADER}\n{ROW}\nb{ROW[1:]}\n")
    assert call("run", configuration)[0] == 0
    table.write_text(f"{HEADER}\n{ROW}\n")
    code, _, err = call("run", configuration, "--strict")
    assert code == 3
    assert "rows lost: the pair tables hold 1 rows, 2 in the previous run" in err
    # the rows of the run before count, and nothing is lost any more
    code, _, err = call("screen", configuration, "--strict")
    assert (code, "rows lost" in err) == (0, False)


def test_wrong_folders_stop_with_one_line(call, configuration, tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "texts").mkdir()
    (tmp_path / "texts" / "readme.txt").write_text("hello")
    text = configuration.read_text()
    before = text[text.index("[records]") : text.index("[pairs]")]
    # a folder without records is nothing usable, one that is not there wrong input
    for folder, expected in (("absent", 2), ("empty", 3), ("texts", 3)):
        configuration.write_text(text.replace(before, f'[records]\nfolder = "{folder}"\n'))
        code, _, err = call("run", configuration)
        assert code == expected
        assert folder in err.strip().splitlines()[-1]


def test_a_wrong_key_is_named(call, configuration):
    configuration.write_text(configuration.read_text() + "\n[processing]\nhighpas = 0.1\n")
    code, _, err = call("run", configuration)
    assert code == 2
    assert "run.toml: processing.highpas: unknown key (got 0.1)" in err


def test_nothing_in_reach_exits_with_3(call, configuration):
    far = ROW.replace("0.3,", "90.3,").replace("0.3001,", "90.3001,")
    (configuration.parent / "pairs.csv").write_text(f"{HEADER}\n{far}\n")
    code, _, err = call("run", configuration)
    assert code == 3
    assert "rejected.csv; first pair a: nearest station" in err.splitlines()[-1]
    rejected = pd.read_csv(configuration.parent / "out" / "rejected.csv")
    assert rejected[rejected["kind"] == "pair"]["reasons"].str.contains("m away").all()


def test_a_folder_that_another_run_holds_exits_with_75(call, configuration):
    with locked_folder(configuration.parent / "out"):
        for command in ("run", "screen", "report"):
            code, _, err = call(command, configuration)
            assert code == 75
            line = err.strip().splitlines()[-1]
            assert f"out: another run holds this folder: process {os.getpid()} on " in line


def test_output_that_cannot_be_written_exits_with_75():
    if not Path("/dev/full").exists():
        pytest.skip("there is no /dev/full here")
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "per_obspy", "--version"]
        done = subprocess.run(command, check=False, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 75
    assert done.stderr.startswith("per-obspy: standard output: cannot be written: No space left")
    assert len(done.stderr.splitlines()) == 1


def test_no_such_command_exits_with_2(call):
    assert call("fly")[0] == 2


@pytest.mark.parametrize(
    "command", ["run", "report", "screen", "process", "spectra", "simulate", "pairs find"]
)
def test_an_empty_output_is_refused(call, tmp_path, monkeypatch, command):
    # would catch results all over the folder of the shell, from a variable that was never set
    monkeypatch.chdir(tmp_path)
    code, _, errors = call(*command.split(), "input", "-o", "")
    assert code == 2
    assert "the path is empty" in " ".join(errors.replace("│", " ").split())
    assert not list(tmp_path.iterdir())


INTERRUPTED = """
import sys
import time
from per_obspy.cli import application
from per_obspy.runs.tasks.parallel import Workers, Work, results
notes = f"open({sys.argv[2]!r} + str(__import__('os').getpid()), 'w').close()"
task = f"{notes} or __import__('time').sleep(100)"

@application.app.command()
def sleep(folder: str) -> None:
    list(results([task, task], eval_work(), Workers(2)))

def eval_work():
    return Work(eval, lambda *_: None)

if __name__ == "__main__":
    application.main()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
def test_the_interrupt_key_ends_a_run_in_one_word(tmp_path):
    # would catch a traceback of every worker, and workers that go on
    script = tmp_path / "sleeps.py"
    script.write_text(INTERRUPTED)
    at_work = tmp_path / "at_work"
    at_work.mkdir()
    command = [sys.executable, str(script), "sleep", str(at_work) + os.sep]
    # The key of a terminal reaches the whole group, workers as well
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    while len(list(at_work.iterdir())) < 2:
        assert running.poll() is None
        time.sleep(0.05)
    os.killpg(running.pid, signal.SIGINT)
    _, errors = running.communicate()
    assert (running.returncode, errors) == (130, "interrupted\n")
    for file in at_work.iterdir():
        state = Path("/proc", file.name, "stat")
        # a process that ended may wait as a zombie until its new parent asks for it
        assert not state.exists() or state.read_text().rsplit(")", 1)[1].split()[0] == "Z"
