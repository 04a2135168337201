"""``per-obspy observed``: inspections of a finished run, read back."""

from pathlib import Path
from typing import Annotated

import typer

from per_obspy.cli.printing import named_path, output_option
from per_obspy.names import number_of


def observed(
    results: Annotated[
        Path, typer.Argument(help="Folder of a run.", parser=named_path, metavar="RESULTS")
    ],
    forms: Annotated[
        Path,
        typer.Argument(
            help="GeoPackage with the layer inspections, as QGIS or QField saved it.",
            parser=named_path,
            metavar="FORMS",
        ),
    ],
    output: Annotated[Path | None, output_option("Folder; default: RESULTS/observed.")] = None,
) -> None:
    """
    Compare inspections with the prediction, and put them into the pair table of the next run.

    Example: per-obspy observed output/demo inspected.gpkg
    """
    from per_obspy.runs.observed import observe

    folder = output or results / "observed"
    found = observe(results, forms, folder)
    # Answers first, then how good the prediction was
    seen = found.pairs["observed"]
    print(
        f"{number_of(len(found.pairs), 'pair')} seen: {int((seen == 1).sum())} hit each other, "
        f"{int((seen == 0).sum())} did not, {int(seen.isna().sum())} unsure or not said; "
        f"{found.empty} forms empty, {len(found.rejected)} rejected or in conflict"
    )
    print(*found.statements, sep="\n")
    for file in found.files:
        print(f"  {file}")
