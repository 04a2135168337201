"""A small simulated run that several test modules share: three stations, sixty pairs, or fewer."""

import json
import re
import zlib
from base64 import b64decode
from collections.abc import Iterable, Iterator
from concurrent.futures import Executor, Future
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Any

import pytest

from per_obspy.files import written_whole
from per_obspy.report import files as report_files
from per_obspy.report.results import Drawings
from per_obspy.runs import report

SCENARIO = "[scenario]\nstations = 3\nmagnitude = 6.5\ndt = 0.02\n[pairs]\ncount = 60\n"
SPECTRA = "[spectra]\ncount = 12\ndampings = [0.05]\nazimuth_step = 30\n"


class InProcess(Executor):
    """Do the work at once in this process: no test needs more, but those of the pool."""

    def submit(self, function, /, *arguments):
        future = Future()
        try:
            future.set_result(function(*arguments))
        except Exception as error:  # noqa: BLE001 - whatever it is, its result raises it
            future.set_exception(error)
        return future


def write_configuration(folder: Path, text: str = "") -> Path:
    """
    Write the configuration of the run, with further lines, and return its path.

    One worker is this process itself: processes of a pool cost seconds each, and only tests of the
    pool need them.
    """
    (folder / "scenario.toml").write_text(SCENARIO)
    file = folder / "run.toml"
    head = 'name = "small"\noutput = "out"\nworkers = 1\nsimulation = "scenario.toml"\n'
    file.write_text(f"{head}{text}{SPECTRA}")
    return file


def write_smallest_configuration(folder: Path, text: str = "") -> Path:
    """Write the configuration of a run of one station and four pairs, and return its path."""
    file = write_configuration(folder, text)
    scenario = SCENARIO.replace("stations = 3", "stations = 1").replace("count = 60", "count = 4")
    (folder / "scenario.toml").write_text(scenario)
    return file


def plain_figure(*arguments: object, **_: object) -> None:
    """Write a figure as a short file: most of the time of a small run goes into its figures."""
    (path,) = (argument for argument in arguments if isinstance(argument, Path))
    with written_whole(path) as part:
        part.write_bytes(b"a figure")


#: Functions that draw, and those that write short files instead; those of the page are the last.
PLAIN = (
    (report_files, "draw_overview", plain_figure),
    (report_files, "draw_record_to_pair", plain_figure),
    (report_files, "write_summary_page", plain_figure),
    (report, "page_drawings", lambda *_: nullcontext(Drawings)),
    (report_files, "write_page", plain_figure),
)
REAL = tuple((module, name, getattr(module, name)) for module, name, _ in PLAIN)


@contextmanager
def replaced(functions: Iterable[tuple[object, str, object]]) -> Iterator[None]:
    """Replace functions of modules for a while."""
    with pytest.MonkeyPatch.context() as patch:
        for module, name, function in functions:
            patch.setattr(module, name, function)
        yield


def plain_figures() -> AbstractContextManager[None]:
    """Write the figures and the PDF of every run in here as short files."""
    return replaced(PLAIN[:-2])


def plain_reports() -> AbstractContextManager[None]:
    """Write figures, PDF and page as short files: they take two thirds of a small run."""
    return replaced(PLAIN)


def real_reports() -> AbstractContextManager[None]:
    """Write figures, PDF and page as they are, whatever surrounds it."""
    return replaced(REAL)


def page_content(path: Path) -> dict[str, Any]:
    """Return the content of a page, without its tables of numbers."""
    block = re.search(
        r'<script type="application/octet-stream" id="data">([^<]*)<', path.read_text()
    )
    data = zlib.decompress(b64decode(block[1]))
    return json.loads(data[4 : 4 + int.from_bytes(data[:4], "little")])


def write_folder_configuration(folder: Path, output: str, text: str = "") -> Path:
    """Write the configuration of a run of the records in a folder, and return its path."""
    file = folder / "folder.toml"
    head = f'name = "folder"\noutput = "{output}"\nworkers = 1\n[records]\nfolder = "records"\n'
    file.write_text(f'{head}[pairs]\nfile = "out/pairs.csv"\n{text}')
    return file
