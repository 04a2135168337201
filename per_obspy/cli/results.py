"""``per-obspy show`` and ``per-obspy observed``: one pair and the inspections of a run."""

from pathlib import Path
from typing import Annotated

import typer

from per_obspy.cli.printing import named_path, output_option
from per_obspy.errors import CatalogError
from per_obspy.names import number_of


def show(
    pair: Annotated[str, typer.Argument(help="pair_id, or a rank as #1.")],
    results: Annotated[
        Path, typer.Argument(help="Folder of the results.", parser=named_path, metavar="RESULTS")
    ],
    output: Annotated[Path | None, output_option("PNG file of its figure.")] = None,
) -> None:
    """
    Print the numbers of one pair in words, and draw it.

    Example: per-obspy show P0000019 output/demo -o pair.png
    """
    from per_obspy.report.words import pair_lines
    from per_obspy.runs.shown_pair import draw_pair, find_pair

    if output is not None and output.suffix.lower() != ".png":
        raise CatalogError(str(output), f"unknown suffix {output.suffix!r}, expected .png")
    # Drawn first: a reader that has enough ends the program at the next line
    found = find_pair(pair, results)
    if output is not None:
        draw_pair(found, output)
    if found.simulated:
        print("The ground motion is SIMULATED.")
    print(*pair_lines({str(name): value for name, value in found.row.items()}), sep="\n")
    if output is not None:
        print(f"  {output}")


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
