"""``per-obspy init`` and ``per-obspy warm-up``: a first configuration, and compiled kernels."""

from pathlib import Path
from typing import Annotated

import typer

from per_obspy.cli.printing import TO_OPEN, named_path, output_option
from per_obspy.errors import printable


def init(
    records: Annotated[
        str | None,
        typer.Argument(help="Folder, archive, file or event id; not given: looked for here."),
    ] = None,
    pairs: Annotated[
        str | None, typer.Argument(help="Pair table or footprints; not given: looked for here.")
    ] = None,
    output: Annotated[Path, output_option("TOML file.")] = Path("run.toml"),
    force: Annotated[
        bool, typer.Option("--force", help="Write the file again if it exists.")
    ] = False,
) -> None:
    """
    Write a configuration for the inputs found, with every other key and its help as comments.

    Example: per-obspy init records pairs.csv -o run.toml
    """
    from per_obspy.config.section import read_toml
    from per_obspy.runs.inputs.discovery import write_first_configuration

    # An empty name would be the folder of the shell
    for name in (records, pairs):
        if name is not None:
            named_path(name)
    lines = write_first_configuration(output, records, pairs, force)
    for line in (*lines, f"{output} is written; next: per-obspy run {output}"):
        print(printable(line))
    results = output.parent / str(read_toml(output)["output"])
    print(printable(f"then open, in this order: {', '.join(TO_OPEN).format('risk')} in {results}"))


def warm_up() -> None:
    """
    Compile all kernels, so that no later command waits for them: for images and clusters.

    They are stored in the package's folder, or in NUMBA_CACHE_DIR if that is set.
    """
    from per_obspy.cli.printing import shown_progress
    from per_obspy.runs.tasks.kernels import compile_kernels

    with shown_progress() as progress:
        compile_kernels(progress)
    print("all kernels are compiled")
