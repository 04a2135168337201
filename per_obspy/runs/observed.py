"""What teams saw after a run, beside its prediction, and in the pair table of the next run."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import binomtest

from per_obspy.config import Run, load
from per_obspy.errors import CatalogError, Rejection, require_extra, shortened
from per_obspy.inventory.files.reading import read_pairs
from per_obspy.inventory.files.writing import write_pairs
from per_obspy.report.evaluation import write_evaluation
from per_obspy.results.parts import bounded_database, parquet_rows
from per_obspy.results.ranked_table import table_files
from per_obspy.results.table_files import write_rejected
from per_obspy.runs.inputs.drawn_pairs import pair_table
from per_obspy.runs.inspections import Answers, Form, agreed, read_forms
from per_obspy.runs.pairs import named_files
from per_obspy.runs.shown_pair import is_simulated
from per_obspy.screening.evaluation import evaluation

#: Standard deviation of a gap that was measured with a tape, m (reasoned).
TAPE = 0.005


class Observed(NamedTuple):
    """What the forms of a run say."""

    #: One row per pair that was seen: ``pair_id, observed`` (1, 0, NaN), ``gap`` (m or NaN),
    #: ``damage`` (the worst), ``inspections`` (number).
    pairs: pd.DataFrame
    #: Forms that cannot be used, and pairs whose forms disagree.
    rejected: tuple[Rejection, ...]
    #: Forms without an answer.
    empty: int
    #: Comparison with the prediction in sentences; none if no pair has an observation.
    statements: tuple[str, ...]
    files: tuple[Path, ...]


def observe(results: Path, forms: Path, folder: Path) -> Observed:
    """
    Compare inspections with the results of a run, and put them into its pair table.

    Parameters
    ----------
    results : Path
        Folder of a finished run.
    forms : Path
        GeoPackage with a layer ``inspections``, or another layer with its fields.
    folder : Path
        Gets ``pairs.parquet`` (the pair table of the run with measured gaps and ``observed``),
        ``rejected.csv``, ``evaluation.json`` and ``figures/reliability.png``.

    Raises
    ------
    CatalogError
        If the folder holds no run, or the forms cannot be read or lack a field.
    MissingExtra
        If the libraries of layers are not installed.
    """
    require_extra("gis", "pyogrio", "shapely")
    table = table_files(results, "risk")
    if not table:
        raise CatalogError(str(results), "no results of a run here: no risk.parquet")
    # The forms, and what the run said of their pairs
    answers = read_forms(forms)
    predicted = _predicted(results, table, {form.pair_id for form in answers.forms})
    pairs, conflicts = agreed(_of_run(answers, predicted, forms), forms)
    rejected = (*answers.rejected, *conflicts)

    # Everything is known before the first file is written
    given = _pair_table(results)
    folder.mkdir(parents=True, exist_ok=True)
    risk = predicted.merge(pairs, on="pair_id")
    files = write_evaluation(risk, folder, is_simulated(results))
    write_pairs(_with_observations(given, pairs), folder / "pairs.parquet")
    write_rejected(rejected, folder / "rejected.csv")
    written = (folder / "pairs.parquet", folder / "rejected.csv", *files)
    return Observed(pairs, rejected, answers.empty, _statements(risk), written)


def _of_run(answers: Answers, predicted: pd.DataFrame, file: Path) -> list[Form]:
    """Return the forms of pairs that the results have; the others are rejected."""
    names = set(predicted["pair_id"])
    for form in answers.forms:
        if form.pair_id not in names:
            reason = f"pair_id: {shortened(form.pair_id, 80)!r} is not in the results"
            rejection = Rejection("inspection", form.pair_id, str(file), form.number, (reason,))
            answers.rejected.append(rejection)
    return [form for form in answers.forms if form.pair_id in names]


def _predicted(results: Path, table: list[Path], names: set[str]) -> pd.DataFrame:
    """Return pair_id, state and probability of the pairs that were seen."""
    with bounded_database(results) as database:
        database.register("risk", parquet_rows(table))
        database.register("seen", pd.DataFrame({"name": sorted(names)}, dtype=str))
        query = (
            "SELECT pair_id, state, probability FROM risk WHERE pair_id IN (SELECT name FROM seen)"
        )
        return database.execute(query).df()


def _statements(risk: pd.DataFrame) -> tuple[str, ...]:
    """Return hit rate, false alarms and Brier score with their 95 % ranges."""
    rows = risk[risk["observed"].notna()]
    if rows.empty:
        return ()
    # Warned of are the states yes and likely, as in evaluation.json
    contact = rows["observed"].to_numpy() == 1.0
    warned = rows["state"].isin(["yes", "likely"]).to_numpy()
    found = evaluation(rows)
    statements = [
        f"of the pairs that hit each other, {_share(warned[contact])} were yes or likely",
        f"of those that did not, {_share(warned[~contact])} were yes or likely",
    ]
    # The mean of n squared errors has their deviation over the root of n
    errors = (rows["probability"].to_numpy(float) - contact) ** 2
    if len(errors) > 1 and np.isfinite(errors).all():
        reach = 1.96 * errors.std(ddof=1) / np.sqrt(len(errors))
        statements.append(
            f"Brier score {found.brier_score:.2f} +- {reach:.2f}; "
            f"{found.brier_score_of_the_share:.2f} if every pair had the observed share"
        )
    statements.append(
        "the rates hold for the pairs that were chosen for a visit, not for the region"
    )
    return tuple(statements)


def _share(hits: NDArray[np.bool_]) -> str:
    """Return a share of yes with its 95 % range by Wilson's score."""
    if not hits.size:
        return "0 of 0"
    low, high = binomtest(int(hits.sum()), hits.size).proportion_ci(method="wilson")
    return f"{hits.sum()} of {hits.size} ({100 * low:.0f} to {100 * high:.0f} %)"


def _pair_table(results: Path) -> pd.DataFrame:
    """Return the pairs of the run as they were given."""
    # The copy of the configuration that every run writes beside its tables
    settings = load(results / "configuration.toml", Run)
    pairs = settings.pairs
    if pairs and pairs.names and pairs.catalog:
        tables = [read_pairs(file) for file in named_files(pairs.names, pairs.catalog)]
        return pd.concat(tables, ignore_index=True)
    if pairs and pairs.catalog:
        reason = "pairs: the run took stored inventories by region; name them ([pairs] names)"
        raise CatalogError(str(results / "configuration.toml"), reason)
    file = pair_table(settings, results) or results / "pairs.csv"
    return read_pairs(file, pairs.form if pairs and pairs.file else None)


def _with_observations(given: pd.DataFrame, pairs: pd.DataFrame) -> pd.DataFrame:
    """Return the pair table with what was observed and measured."""
    seen = pairs.set_index("pair_id").reindex(given["pair_id"])
    empty = pd.Series(np.nan, index=given.index)
    contact, gap = seen["observed"].to_numpy(float), seen["gap"].to_numpy(float)
    measured = np.isfinite(gap)
    table = given.copy()
    # An earlier observation stays where nobody went
    earlier = table.get("observed", empty).to_numpy(float)
    table["observed"] = np.where(np.isfinite(contact), contact, earlier)
    table["gap"] = np.where(measured, gap, table["gap"].to_numpy(float))
    # A measured gap has the deviation of its tape
    deviation = table.get("gap_std", empty).to_numpy(float)
    table["gap_std"] = np.where(measured, TAPE, deviation)
    if "gap_std_source" in table:
        table["gap_std_source"] = np.where(measured, "given", table["gap_std_source"])
    return table
