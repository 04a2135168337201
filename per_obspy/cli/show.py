"""``per-obspy show``: description and figure of one pair of finished results."""

from pathlib import Path
from typing import Annotated

import typer

from per_obspy.cli.printing import named_path, output_option
from per_obspy.errors import CatalogError


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
