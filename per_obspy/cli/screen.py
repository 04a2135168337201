"""``per-obspy screen``: screen pairs by a run, a design spectrum or an ensemble of scenarios."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from per_obspy.cli.printing import (
    AsJson,
    Dask,
    Language,
    Strict,
    output_option,
    percent,
    print_and_end,
    print_files,
    print_worst,
    state_texts,
    stop_if_nothing,
    why_nothing,
)
from per_obspy.cli.run import print_coverage, print_nothing, print_result
from per_obspy.cli.watch import (
    LogFile,
    LogForm,
    LogFormat,
    Quiet,
    log_ending,
    logged,
)
from per_obspy.errors import CatalogError, printable
from per_obspy.names import number_of

if TYPE_CHECKING:
    import pandas as pd

    from per_obspy.config import Design, Run
    from per_obspy.results.coverage import Coverage
    from per_obspy.runs.output_folder import Result

#: Columns of the worst pairs that are printed: by a design spectrum, and of an ensemble where the
#: table has them.
SPECTRUM_COLUMNS = (
    "pair_id",
    "period_1",
    "period_2",
    "gap",
    "demand",
    "demand_rule",
    "state",
    "probability",
    "expected_impact_velocity",
)

#: Those by a seismic hazard.
HAZARD_COLUMNS = (*SPECTRUM_COLUMNS[:5], "gap_for_target", "state", "annual_probability")
ENSEMBLE_COLUMNS = (
    "rank",
    "pair_id",
    "expected_impact_velocity",
    "probability",
    "annual_probability",
    "worst_scenario",
    "gap",
    "gap_for_target",
)

#: Rows of the worst pairs that are printed.
WORST = 10


class Screened(NamedTuple):
    """Table, coverage, files (``rejected.csv`` last) and alert of a screening by a spectrum."""

    table: "pd.DataFrame"
    coverage: "Coverage"
    files: list[Path]
    alert: str


def screen(
    configuration: Annotated[
        Path,
        typer.Argument(
            help="TOML file: a run, a spectrum and pairs, or scenarios; or a folder with one."
        ),
    ],
    output: Annotated[Path | None, output_option("Folder of the results.")] = None,
    dask: Dask = None,
    language: Language = None,
    strict: Strict = False,
    as_json: AsJson = False,
    log: LogFile = None,
    log_format: LogForm = LogFormat.text,
    quiet: Quiet = False,
) -> None:
    """
    Screen pairs by an ensemble of scenarios, a design spectrum, or the stations of a run.

    Of an ensemble and of a run only changed parts are computed again. A single run needs results
    of an earlier ``per-obspy run``.

    Example: per-obspy screen workflows/ensemble.toml
    """
    from per_obspy.config import Design, Ensemble, screening_kind
    from per_obspy.runs.ensemble import screen_scenarios
    from per_obspy.runs.inputs.arguments import named_configuration
    from per_obspy.runs.inputs.input_kinds import Kind
    from per_obspy.runs.run import screen as screen_again
    from per_obspy.runs.tasks.executor import dask_executor

    configuration = named_configuration(
        configuration, (Kind.CONFIGURATION, Kind.DESIGN, Kind.ENSEMBLE)
    )
    # The kind decides which options hold
    kind = screening_kind(configuration)
    if strict and kind in (Design, Ensemble):
        raise typer.BadParameter("only a run compares its rows", param_hint="--strict")
    if dask is not None and kind is Design:
        raise typer.BadParameter("a design spectrum needs no cluster", param_hint="--dask")
    with logged(log, log_format, quiet) as progress, dask_executor(dask) as executor:
        if kind is Design:
            design = _screened_by_spectrum(configuration, output, language)
        elif kind is Ensemble:
            result = screen_scenarios(configuration, output, executor, progress, language)
            log_ending(result.record)
        else:
            settings = _in_language(configuration, language)
            result = screen_again(settings, output, executor, progress)
            log_ending(result.record)
    # Results are printed when no line of the log can come between
    if kind is Design:
        _end_design(design, as_json, quiet)
    else:
        shown = _print_ensemble if kind is Ensemble else print_result
        print_and_end(result, as_json, print_nothing if quiet else shown, strict)


def _in_language(configuration: Path, language: Language) -> "Path | Run":
    """Return the configuration of a run with the language of the command line, if it has one."""
    from per_obspy.config import Run, in_language, load

    return configuration if language is None else in_language(load(configuration, Run), language)


def _screened_by_spectrum(configuration: Path, output: Path | None, language: Language) -> Screened:
    """Screen pairs by a design or user spectrum instead of a record."""
    from per_obspy.config import Design, in_language, load
    from per_obspy.inventory.files.reading import read_pairs, recognised_line
    from per_obspy.report.page.background import require_background
    from per_obspy.runs.inputs.extras import require_extras

    # Whatever would stop the report later
    settings = in_language(load(configuration, Design), language)
    require_extras(settings)
    require_background(settings.report.background)
    pairs = read_pairs(settings.pairs)
    table = _spectrum_table(settings, configuration, pairs)
    coverage = _coverage(settings, table)
    files, alert = _write_design(settings, table, coverage, output or settings.output)

    if recognised := pairs.attrs["recognised"]:
        print(f"per-obspy: {recognised_line(settings.pairs, recognised)}", file=sys.stderr)
    for sentence in pairs.attrs["suspicions"]:
        print(printable(f"per-obspy: {sentence}"), file=sys.stderr)
    return Screened(table, coverage, files, alert)


def _spectrum_table(
    settings: "Design", configuration: Path, pairs: "pd.DataFrame"
) -> "pd.DataFrame":
    """Screen pairs by the hazard of many motions, or by one spectrum."""
    from per_obspy.screening.design import design_table, read_design_spectrum
    from per_obspy.screening.hazard import hazard_table
    from per_obspy.screening.hazard_files import is_hazard, read_hazard

    given = settings.building, settings.screening
    if is_hazard(settings.spectrum):
        hazard = read_hazard(settings.spectrum, settings.shape)
        return hazard_table(hazard, pairs, *given, settings.target_rate)
    # Without a hazard nothing is scaled
    if settings.shape is not None:
        raise CatalogError(str(configuration), "shape: spectrum is no hazard curve that needs one")
    if "target_rate" in settings.model_fields_set:
        raise CatalogError(str(configuration), "target_rate: spectrum is no hazard with rates")
    return design_table(read_design_spectrum(settings.spectrum), pairs, *given)


def _end_design(design: Screened, as_json: bool, quiet: bool) -> None:
    """Print the result of a screening by a spectrum, and stop without a usable pair."""
    from per_obspy.config.screening import EVERY_STATE

    table, coverage, files, alert = design
    # Print the counts, for machines or with the worst pairs
    counts = {state: int((table["state"] == state).sum()) for state in EVERY_STATE}
    rejected = len(table.attrs["rejected"])
    if as_json:
        names = [str(path) for path in files]
        known = {"rejected": rejected, "coverage": coverage.as_record(), "files": names}
        print(json.dumps({"pairs": len(table), **counts, **known}))
    elif not quiet:
        print_coverage({"coverage": coverage.as_record(), "alert": alert})
        _print_spectrum_result(table, counts, rejected, files)
    if table.empty:
        stop_if_nothing(0, why_nothing(files[-1]))


def _write_design(
    settings: "Design", table: "pd.DataFrame", coverage: "Coverage", folder: Path
) -> tuple[list[Path], str]:
    """Write the files of a screening by a design spectrum, ``rejected.csv`` last, and its alert."""
    from per_obspy.results.risk import write_design
    from per_obspy.runs.report import report_design

    *files, rejected = write_design(table, folder)
    made = report_design(settings, table, coverage, folder)
    for fault in made.faults:
        print(f"per-obspy: {fault}", file=sys.stderr)
    return [*files, *made.outputs, rejected], made.alert


def _coverage(settings: "Design", table: "pd.DataFrame") -> "Coverage":
    """Return the coverage of a screening by a spectrum."""
    from per_obspy.inventory.files.reading import ALL, checked_file
    from per_obspy.results.coverage import CoverageTally
    from per_obspy.runs.losses import areas_left_out, search_of_tables

    rejected = table.attrs["rejected"]
    rows = len(table) + len(rejected)
    tally = CoverageTally(search_of_tables({settings.pairs: rows}))
    tally.add(rejected)
    # The file is read again for the places of what is left out
    for block in checked_file(settings.pairs).rows(ALL) if rejected else ():
        tally.add((), areas_left_out(settings.totals, rejected, block))
    return tally.coverage({"pairs": len(table), "rejected_pair": len(rejected)})


def _print_spectrum_result(
    table: "pd.DataFrame", counts: dict[str, int], rejected: int, files: list[Path]
) -> None:
    """Print counts, worst pairs and files of a screening by a spectrum."""
    words = ", ".join(state_texts(counts))
    print(
        f"{number_of(len(table), 'pair')} ({words}), {rejected} rejected; "
        "the radius is SD, a design spectrum has no PER"
    )
    # A hazard has its own gap
    columns = HAZARD_COLUMNS if "gap_for_target" in table else SPECTRUM_COLUMNS
    _print_worst(table.head(WORST), columns)
    folder = files[-1].parent
    print_files(folder, [path.relative_to(folder).as_posix() for path in files], "design")


def _print_ensemble(result: "Result") -> None:
    """Print counts, worst pairs and files of an ensemble."""
    import pandas as pd

    # Counts, and a warning where the motion is simulated
    folder, record = result.folder, result.record
    if result.did_nothing:
        print("Up to date: these scenarios were joined before.")
    if record["simulated"]:
        print("The ground motion of a scenario is SIMULATED.")
    print_coverage(record)
    counts = record["counts"]
    print(
        f"{number_of(len(record['scenarios']), 'scenario')}, {number_of(counts['pairs'], 'pair')}; "
        f"{counts['rejected_pair']} rejected; without a probability: {counts['unknown_gap']} of "
        f"unknown gap, {counts['missing_scenario']} that a scenario lacks"
    )

    # The worst pairs, and where everything is
    texts = {"pair_id": str, "worst_scenario": str}
    worst = pd.read_csv(folder / "ensemble.csv", nrows=WORST, dtype=texts)
    _print_worst(worst, [name for name in ENSEMBLE_COLUMNS if name in worst])
    print_files(folder, {*record["outputs"], "ensemble.json"}, "ensemble")


def _print_worst(worst: "pd.DataFrame", columns: "tuple[str, ...] | list[str]") -> None:
    """Print some columns of the worst pairs as a table."""
    from per_obspy.report.layers.qgis import column_aliases
    from per_obspy.results.table_files import rounded_table
    from per_obspy.screening.columns import known_column

    # Impacts with two digits, probabilities in percent, all else in the unit of its column
    chances = [name for name in columns if name.endswith("probability")]
    shown = rounded_table(worst[list(columns)]).astype(dict.fromkeys(chances, object))
    for name in chances:
        # Chances of a year keep their digits
        shown[name] = worst[name].map(percent) if name == "probability" else 100.0 * worst[name]
    units = {name: column.unit for name in columns if (column := known_column(name))}
    titles = list(column_aliases(columns, units | dict.fromkeys(chances, "%")).values())
    rows = shown.itertuples(index=False)
    print_worst(titles, [*rows])
