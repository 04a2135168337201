"""``per-obspy run`` and its parts: ``simulate``, ``process``, ``spectra`` and ``report``."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from per_obspy.cli.printing import (
    AsJson,
    Dask,
    Language,
    Strict,
    named_path,
    output_option,
    percent,
    print_and_end,
    print_files,
    print_worst,
    shown_progress,
    state_texts,
    stop_if_nothing,
)
from per_obspy.cli.watch import (
    LogFile,
    LogForm,
    LogFormat,
    Quiet,
    log_ending,
    logged,
)
from per_obspy.errors import printable
from per_obspy.names import number_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from per_obspy.errors import Rejection
    from per_obspy.runs.output_folder import Result

#: Columns of the worst pairs that are printed, with their titles.
SHOWN = {
    "pair_id": "pair",
    "station": "station",
    "period_1": "T1 (s)",
    "period_2": "T2 (s)",
    "gap": "gap (m)",
    "demand": "demand (m)",
    "state": "pounding",
    "probability": "probability (%)",
    "expected_impact_velocity": "impact (m/s)",
    "expected_amplification": "ampl.",
}

#: Flags of stations that are printed, with their meanings.
WARNINGS = {
    "baseline_shift": "with a baseline shift",
    "second_event": "with a second event",
    "clipped": "that may be clipped",
    "wrapped": "with a counter that overflowed",
    "filled": "with a filled gap",
    "implausible_record": "with an implausible record",
    "assumed_corners": "with assumed corners",
    "digitised": "digitised from film",
    "nominal_sensitivity": "with a nominal sensitivity only",
    "undated": "without a date",
    "contradicting_coordinates": "with contradicting coordinates",
    "implausible_amplitude": "with an implausible amplitude",
    "implausible_place": "in an implausible place",
    "repeated_record": "with the record of another",
    "record_warning": "with other warnings",
    "one_horizontal": "with one horizontal",
    "unknown_azimuths": "with horizontals of unknown azimuth",
}

#: Stations of each warning that are printed by name.
NAMED_STATIONS = 3

#: Damping of the spectra that are drawn, fraction of critical.
PLOT_DAMPING = 0.05


Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change a key of the configuration, as screening.exact=false; repeat for several.",
    ),
]


def run(
    first: Annotated[
        str,
        typer.Argument(
            metavar="CONFIGURATION | RECORDS",
            help="TOML file or a folder with one; or records: folder, archive, file or event id.",
        ),
    ],
    second: Annotated[
        str | None,
        typer.Argument(metavar="PAIRS", help="Pair table or footprints, or a folder with one."),
    ] = None,
    output: Annotated[Path | None, output_option("Folder of the results.")] = None,
    changes: Changes = None,
    after: Annotated[
        Path | None,
        typer.Option(help="Results of an earlier earthquake, whose damage the pairs have."),
    ] = None,
    dask: Dask = None,
    language: Language = None,
    strict: Strict = False,
    as_json: AsJson = False,
    log: LogFile = None,
    log_format: LogForm = LogFormat.text,
    quiet: Quiet = False,
) -> None:
    """
    Do a whole run: records to spectra to risk table to figures.

    One argument is a configuration, or a folder that holds one.

    Two are records and pairs, in either order: content decides.

    Results: -o, else the configured folder, else results/RECORDS-PAIRS.

    Example: per-obspy run records pairs.csv -o out --set screening.exact=false
    """
    from per_obspy.runs.inputs.arguments import requested_run
    from per_obspy.runs.tasks.executor import dask_executor
    from per_obspy.watch.notified_run import notified_run

    # An empty name would be the folder of the shell
    for name in (first, first if second is None else second):
        named_path(name)
    spoken = [f"report.language={language}"] if language else []
    spoken += [f"after={json.dumps(str(after))}"] if after else []
    with logged(log, log_format, quiet) as progress, dask_executor(dask) as executor:
        asked = requested_run(first, second, output, [*(changes or ()), *spoken])
        if asked.line and not quiet:
            print(printable(asked.line), file=sys.stderr)
        result = notified_run(asked.configuration, output, progress, executor)
        log_ending(result.record)
    print_and_end(result, as_json, print_nothing if quiet else print_result, strict)


def report(
    configuration: Annotated[
        Path, typer.Argument(help="TOML file of the run, or a folder with one, as of its results.")
    ],
    output: Annotated[Path | None, output_option("Folder of the results.")] = None,
    language: Language = None,
    as_json: AsJson = False,
) -> None:
    """
    Write totals, page, figures and map layers again from the risk table of an earlier run.

    Example: per-obspy report workflows/demo.toml
    """
    from per_obspy.config import Run, in_language, load
    from per_obspy.runs.inputs.arguments import named_configuration
    from per_obspy.runs.run import report as report_again

    file = named_configuration(configuration)
    settings = file if language is None else in_language(load(file, Run), language)
    with shown_progress() as progress:
        result = report_again(settings, output, progress=progress)
    print_and_end(result, as_json, print_result)


def simulate(
    scenario: Annotated[Path, typer.Argument(help="TOML file of the scenario.")],
    output: Annotated[Path, output_option("Folder for MiniSEED, StationXML and QuakeML.")],
) -> None:
    """
    Simulate the records of a scenario earthquake.

    Example: per-obspy simulate catalogs/demo/scenario.toml -o output/simulated
    """
    from per_obspy.config import Simulation, load
    from per_obspy.simulation.earthquake import simulate as simulated
    from per_obspy.simulation.earthquake import write_simulation

    simulation = simulated(load(scenario, Simulation).scenario)
    write_simulation(simulation, output)
    print(f"{len(simulation.stream)} simulated records are in {output}")


def spectra(
    sources: Annotated[list[Path], typer.Argument(help="Waveform files, archives or folders.")],
    output: Annotated[Path, output_option("netCDF file.")] = Path("spectra.nc"),
    damping: Annotated[
        list[float] | None, typer.Option(help="Fraction of critical; repeat for several.")
    ] = None,
    shortest: Annotated[float, typer.Option(help="Shortest period, s.")] = 0.05,
    longest: Annotated[float, typer.Option(help="Longest period, s.")] = 10.0,
    count: Annotated[int, typer.Option(help="Number of periods.")] = 100,
    plot: Annotated[
        bool, typer.Option("--plot", help="Draw spectra and state space of every station.")
    ] = False,
    plot_period: Annotated[
        float,
        typer.Option(min=0.01, max=100.0, help="Of the oscillator in the state-space figure, s."),
    ] = 1.0,
    dask: Dask = None,
    as_json: AsJson = False,
    log: LogFile = None,
    log_format: LogForm = LogFormat.text,
    quiet: Quiet = False,
) -> None:
    """
    Write the spectra of records to one netCDF file.

    Example: per-obspy spectra RSN6_ELC180.AT2 -o spectra.nc --plot
    """
    from per_obspy.config import Processing, Spectra, checked
    from per_obspy.runs.process import plot_station, spectra_of
    from per_obspy.runs.tasks.executor import dask_executor
    from per_obspy.runs.tasks.parallel import Workers

    # The grid, checked as in a configuration
    given: dict[str, object] = {"shortest": shortest, "longest": longest, "count": count}
    if damping:
        given["dampings"] = damping
    grid = checked(Spectra, given)

    # Spectra of all stations, and figures of each on request
    with logged(log, log_format, quiet) as progress, dask_executor(dask) as executor:
        workers = Workers(0, executor, progress)
        done, rejected = spectra_of(sources, output, Processing(), grid, workers)
    shards = [station.shard for station in done if station.shard]
    files = [str(output)] if shards else []
    for shard in shards if plot else []:
        files += map(str, plot_station(shard, PLOT_DAMPING, plot_period, output.parent))
    if not as_json:
        files = [str(output.with_suffix(".rejected.csv")), *files]
    _print_stations({"stations": len(shards)}, rejected, files, as_json, quiet)


def _print_stations(
    counts: "Mapping[str, int]",
    rejected: "Sequence[Rejection]",
    files: "Sequence[str]",
    as_json: bool,
    quiet: bool,
) -> None:
    """Print the number of stations, the rejected ones and the files; stop if no station is left."""
    if as_json:
        rows = [rejection._asdict() for rejection in rejected]
        print(json.dumps({**counts, "rejected": rows, "files": files}))
    elif not quiet:
        named = f"{number_of(counts['stations'], 'station')}, {len(rejected)} rejected"
        print(named, *files, sep="\n  ")
    stop_if_nothing(counts["stations"])


def process(
    sources: Annotated[list[Path], typer.Argument(help="Waveform files, archives or folders.")],
    output: Annotated[Path, output_option("Folder of the results.")],
    event: Annotated[Path | None, typer.Option(help="QuakeML file; no event is fine.")] = None,
    settings: Annotated[
        Path | None, typer.Option(help="TOML file with a run's processing section.")
    ] = None,
    report: Annotated[
        bool, typer.Option("--report", help="Draw a page a record, one PDF a station.")
    ] = False,
    dask: Dask = None,
    as_json: AsJson = False,
    log: LogFile = None,
    log_format: LogForm = LogFormat.text,
    quiet: Quiet = False,
) -> None:
    """
    Write processed records as MiniSEED, with a table of their corners and reasons.

    Example: per-obspy process shared/records -o processed --report
    """
    from per_obspy.config import Processing, load
    from per_obspy.runs.process import process_records
    from per_obspy.runs.tasks.executor import dask_executor
    from per_obspy.runs.tasks.parallel import Workers

    # Process every station
    chosen = load(settings, Processing) if settings else Processing()
    with logged(log, log_format, quiet) as progress, dask_executor(dask) as executor:
        workers = Workers(0, executor, progress)
        result = process_records(sources, output, chosen, event, report, workers)

    # Print counts and files, for machines or people
    stations = sum(station.shard is not None for station in result.done)
    counts = {"stations": stations, "resumed": sum(station.resumed for station in result.done)}
    files = [str(path) for path in result.files]
    _print_stations(counts, result.rejected, files, as_json, quiet)


def print_nothing(result: "Result") -> None:
    """Print no result: a quiet command prints faults only."""


def print_result(result: "Result") -> None:
    """Print the counts of a run, its worst pairs and its files."""
    folder, record = result.folder, result.record
    if result.did_nothing:
        print("Up to date: these inputs were run before.")
    _print_counts(record)
    _print_warnings(record.get("warnings", {}))
    _print_trusted(record.get("trusted", {}))
    # Agreement with observed pounding, worst pairs, files
    if "evaluation.json" in record["outputs"]:
        _print_evaluation(json.loads((folder / "evaluation.json").read_text(encoding="utf-8")))
    if "risk.csv" in record["outputs"]:
        _print_worst(folder)
    print(printable(f"per-obspy run {folder / 'configuration.toml'} does it again."))
    print_files(folder, {*record["outputs"], "run.json", "configuration.toml"})


def _print_counts(record: dict[str, Any]) -> None:
    """Print the earthquake of a run, whether its motion is simulated, and its counts."""
    counts = record["counts"]
    if record["simulated"]:
        print(_simulated_line(counts))
    print_coverage(record)
    for line in _earthquake_lines(record.get("earthquakes", ())):
        print(line)
    # Stations, pairs by state, and all rejections together
    states = ", ".join(state_texts(counts))
    rejected = sum(count for name, count in counts.items() if name.startswith("rejected_"))
    alone = counts.get("stations_amplitudes_only", 0)
    others = f" and {alone} with amplitudes only" if alone else ""
    stations = f"{number_of(counts['stations'], 'station')}{others}"
    print(f"{stations}, {number_of(counts['pairs'], 'pair')}: {states}; {rejected} rejected")
    _print_apart(counts)


def _print_apart(counts: "Mapping[str, int]") -> None:
    """Print what an earlier earthquake left, and what people reported, where there is any."""
    if "after_damage_unknown" in counts:
        left, unknown = counts["after_damage_residual"], counts["after_damage_unknown"]
        line = f"after the earlier earthquake: {number_of(left, 'pair')} with the gap that it left"
        print(f"{line}, {unknown} of unknown damage")
    if people := counts.get("intensities_left_out", 0):
        print(f"{people} intensities that people reported are left out")


def print_coverage(record: "Mapping[str, Any]") -> None:
    """Print the rows that have a verdict, those left out with their reasons, and the alert."""
    from per_obspy.report.coverage import coverage_sentences
    from per_obspy.results.coverage import Coverage

    for sentence in coverage_sentences(Coverage.of_record(record)):
        print(printable(sentence))
    if record.get("alert"):
        print(printable(record["alert"]))


def _print_warnings(warnings: dict[str, list[str]]) -> None:
    """Print the number and the first names of the stations with each warning, on one line."""
    # The noun is written once, and only the first stations are named
    texts = list[str]()
    for flag, meaning in WARNINGS.items():
        stations = warnings.get(flag, [])
        if stations:
            more = ", ..." if len(stations) > NAMED_STATIONS else ""
            names = ", ".join(map(printable, stations[:NAMED_STATIONS]))
            noun = "" if texts else " station" if len(stations) == 1 else " stations"
            texts.append(f"{len(stations)}{noun} {meaning} ({names}{more})")
    if texts:
        print(f"warnings: {', '.join(texts)}; see stations.csv")


def _print_trusted(trusted: dict[str, list[str]]) -> None:
    """Print which stations are used because they are trusted, and trusted names without records."""
    if kept := trusted.get("kept"):
        print(f"used although implausible (records.trust): {', '.join(kept)}")
    if unknown := trusted.get("unknown"):
        print(f"records.trust: no records of {', '.join(unknown)}")


def _simulated_line(counts: dict[str, int]) -> str:
    """Return the warning that motion is simulated, with the number of stations if not of all."""
    stations, simulated = counts["stations"], counts.get("stations_simulated", 0)
    if 0 < simulated < stations:
        return f"The ground motion of {simulated} of {stations} stations is SIMULATED."
    return "The ground motion is SIMULATED."


def _earthquake_lines(earthquakes: "Sequence[dict[str, Any]]") -> list[str]:
    """Return lines on the screened one of several earthquakes, and on undated records."""
    lines = []
    for group in earthquakes:
        if len(earthquakes) > 1 and group["screened"]:
            # The others are left out, each by its start
            lines += _left_out_lines(group, [one for one in earthquakes if not one["screened"]])
        undated = group.get("undated", 0)
        if group["screened"] and undated and undated < group["records"]:
            lines.append(f"{undated} records have no date and are taken for this one.")
    return lines


def _left_out_lines(screened: dict[str, Any], groups: "Sequence[dict[str, Any]]") -> list[str]:
    """Return lines on the records of a folder that are not of the screened earthquake."""
    lines = []
    # Groups that may differ by their clocks only are no other earthquakes for sure
    apart = [group for group in groups if not group.get("joined_by")]
    clocks = [group for group in groups if group.get("joined_by")]
    if apart:
        others = ", ".join(group["start"] for group in apart)
        facts = f"{number_of(screened['stations'], 'station')}; others, left out: {others}"
        lines.append(f"Records of {len(apart) + 1} earthquakes: {screened['start']}, {facts}")
    # Both may be true of one folder
    if clocks:
        starts = ", ".join(
            f"{group['start']} ({number_of(group['stations'], 'station')})" for group in clocks
        )
        lines.append(
            f"Screened: records from {screened['start']}, {screened['stations']} stations. Not "
            f"used: {starts}: another earthquake, or the same by clocks that differ, as no station "
            f"has both; records.event_gap = {clocks[0]['joined_by']:g} takes them as one."
        )
    return lines


def _print_evaluation(found: dict[str, Any]) -> None:
    """Print the agreement of the prediction with the pairs that were inspected."""
    # A share of no pairs is None and left out
    shares = {
        "of the pounded ones were yes or likely": found["hit_rate"],
        "at least possible": found["hit_rate_with_possible"],
        "of the others yes or likely": found["false_alarm_rate"],
    }
    words = [f"{value:.0%} {name}" for name, value in shares.items() if value is not None]
    print(f"{found['pairs']} pairs were looked at, {found['pounded']} pounded: {', '.join(words)}")
    if found["brier_score"] is not None:
        share_alone = found["brier_score_of_the_share"]
        print(f"Brier score {found['brier_score']:.3f}; the share alone {share_alone:.3f}")


def _print_worst(folder: Path) -> None:
    """Print the worst pairs as a table."""
    # Without libraries of tables, which a finished run would wait for
    from per_obspy.results.ranked_table import ranked_table, table_files

    with ranked_table(table_files(folder)) as table:
        found = [row for rows in table.ranked(10, list(SHOWN)) for row in rows.to_pylist()]
    # In the order of the columns that was asked for
    worst = [tuple(map(_said, SHOWN, map(row.get, SHOWN))) for row in found]
    print_worst(list(SHOWN.values()), worst)
    print(
        "Ranked by impact, doubled where floors meet columns, half as much again where a tall "
        "building stands beside a low one."
    )


def _said(name: str, value: object) -> object:
    """Return a cell as people say it: a chance in percent, an impact with its two sure digits."""
    if name == "probability":
        return percent(value)
    # The contact law allows no more
    is_known = isinstance(value, float) and value == value
    return f"{value:.2g}" if name.startswith("expected_") and is_known else value
