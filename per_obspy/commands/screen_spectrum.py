"""``per-obspy screen`` by a design or user spectrum, without a record."""

import json
from pathlib import Path

from per_obspy.commands.endings import end_if_nothing, why_nothing
from per_obspy.commands.printing import print_table

#: Columns of the worst pairs that are printed.
SHOWN = (
    "pair_id",
    "period_1",
    "period_2",
    "gap",
    "demand",
    "demand_rule",
    "state",
    "probability",
    "impact_velocity",
)


def screen_by_spectrum(configuration: Path, output: Path | None, as_json: bool) -> None:
    """Screen pairs by a design or user spectrum instead of a record, and print what was found."""
    from per_obspy.config import Design, load
    from per_obspy.inventory.files.reading import read_pairs
    from per_obspy.screening.by_spectrum.design_spectrum import read_design_spectrum
    from per_obspy.screening.by_spectrum.design_table import design_table
    from per_obspy.tables.design import write_design

    settings = load(configuration, Design)
    spectrum = read_design_spectrum(settings.spectrum)
    table = design_table(
        spectrum, read_pairs(settings.pairs), settings.building, settings.screening
    )
    files = write_design(table, output or settings.output)
    states = {state: int((table["state"] == state).sum()) for state in ("yes", "possible", "no")}
    rejected = len(table.attrs["rejected"])
    if as_json:
        said = {
            "pairs": len(table),
            **states,
            "rejected": rejected,
            "files": [str(path) for path in files],
        }
        print(json.dumps(said))
    else:
        counts = ", ".join(f"{count} {state}" for state, count in states.items())
        print(
            f"{len(table)} pairs ({counts}), {rejected} rejected; the radius is SD, a design spectrum has no PER"
        )
        worst = table.head(10)
        titles = [name.replace("_", " ") for name in SHOWN]
        print_table(
            f"The {len(worst)} worst pairs", titles, worst[list(SHOWN)].itertuples(index=False)
        )
        print(*files, sep="\n")
    if table.empty:
        end_if_nothing(0, why_nothing(files[-1]))
