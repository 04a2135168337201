"""``per-obspy screen``: pairs of buildings against whatever ground motion the configuration names."""

from pathlib import Path
from typing import Annotated

import typer

from per_obspy.commands.endings import AsJson, tell
from per_obspy.commands.printing import shown_progress
from per_obspy.commands.run import print_result
from per_obspy.commands.screen_ensemble import screen_ensemble
from per_obspy.commands.screen_spectrum import screen_by_spectrum


def screen(
    configuration: Annotated[
        Path, typer.Argument(help="TOML file: a run, a spectrum and pairs, or scenarios.")
    ],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder of the results.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """
    Screen pairs: in every scenario of an ensemble, by a design spectrum, or again with the stations of a run.

    Of an ensemble and of a run only what has changed is computed. A single run must have been done
    before.

    Example: per-obspy screen workflows/ensemble.toml
    """
    from per_obspy.config import Design, Ensemble, screening_kind

    kind = screening_kind(configuration)
    if kind is Design:
        screen_by_spectrum(configuration, output, as_json)
    elif kind is Ensemble:
        screen_ensemble(configuration, output, as_json)
    else:
        _screen_again(configuration, output, as_json)


def _screen_again(configuration: Path, output: Path | None, as_json: bool) -> None:
    from per_obspy.pipeline.run import screen as screen_again

    with shown_progress() as progress:
        result = screen_again(configuration, output, progress=progress)
    tell(result, as_json, print_result)
