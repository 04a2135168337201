"""``per-obspy screen``: pairs of buildings against whatever ground motion the configuration names."""

from pathlib import Path
from typing import Annotated

import typer

from per_obspy.commands.design import screen_by_spectrum
from per_obspy.commands.printing import shown_progress
from per_obspy.commands.walk import tell


def screen(
    configuration: Annotated[Path, typer.Argument(help="TOML file of a run, or of a spectrum and pairs.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Folder of the results.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON, for machines.")] = False,
) -> None:
    """
    Screen pairs again with the stations of an earlier run, or by a design spectrum.

    Of a run only what has changed is computed. A configuration with a spectrum needs no run before.

    Example: per-obspy screen workflows/demo.toml
    """
    from per_obspy.config import Design, screening_kind

    if screening_kind(configuration) is Design:
        screen_by_spectrum(configuration, output, as_json)
    else:
        _screen_again(configuration, output, as_json)


def _screen_again(configuration: Path, output: Path | None, as_json: bool) -> None:
    from per_obspy.run import screen as screen_again

    with shown_progress() as progress:
        result = screen_again(configuration, output, progress=progress)
    tell(result.folder, result.record, result.did_nothing, as_json)
