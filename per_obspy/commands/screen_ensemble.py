"""``per-obspy screen`` of several scenarios together."""

from pathlib import Path
from typing import TYPE_CHECKING

from per_obspy.commands.endings import tell
from per_obspy.commands.printing import print_table, shown_progress

if TYPE_CHECKING:
    from per_obspy.jobs.output_folder import Result

#: Columns of the worst pairs that are printed, where the table has them.
SHOWN = ("rank", "pair_id", "probability", "annual_probability", "worst_scenario", "gap")


def screen_ensemble(configuration: Path, output: Path | None, as_json: bool) -> None:
    """Screen pairs in every scenario and print their joint probabilities."""
    from per_obspy.pipeline.ensemble import screen_scenarios

    with shown_progress() as progress:
        result = screen_scenarios(configuration, output, progress=progress)
    tell(result, as_json, _print_ensemble)


def _print_ensemble(result: "Result") -> None:
    import pandas as pd

    folder, record = result.folder, result.record
    if result.did_nothing:
        print("Nothing to do: the same scenarios were joined before.")
    if record["simulated"]:
        print("The ground motion of a scenario is SIMULATED.")
    counts, scenarios = record["counts"], record["scenarios"]
    print(
        f"{len(scenarios)} scenarios, {counts['pairs']} pairs; {counts['rejected_pair']} rejected"
    )
    worst = pd.read_csv(
        folder / "ensemble.csv", nrows=10, dtype={"pair_id": str, "worst_scenario": str}
    )
    names = [name for name in SHOWN if name in worst]
    rows = worst[names].itertuples(index=False)
    print_table(f"The {len(worst)} worst pairs", [name.replace("_", " ") for name in names], rows)
    for name in sorted({*record["outputs"], "ensemble.json"}):
        print(f"  {folder / name}")
