"""Describe any input or result, for ``per-obspy info``."""

from importlib import import_module
from pathlib import Path

from per_obspy.runs.inputs.facts import Facts
from per_obspy.runs.inputs.input_kinds import (
    PAIR_KINDS,
    Kind,
    files_in,
    kind_of,
    records_place,
)

#: Module and function that describe a kind; a module is imported when it is needed.
_DESCRIBED_BY = {
    Kind.PAIRS: "described_tables.pair_table_facts",
    Kind.FOOTPRINTS: "described_tables.footprint_facts",
    Kind.RISK: "described_tables.risk_table_facts",
    Kind.SHAKEMAP: "described_motion.shakemap_facts",
    Kind.SPECTRUM: "described_motion.spectrum_facts",
    Kind.SPECTRA: "described_motion.spectra_facts",
    Kind.EVENT: "described_motion.event_facts",
    Kind.STATIONS: "described_motion.station_facts",
    Kind.CONFIGURATION: "described_runs.configuration_facts",
    Kind.DESIGN: "described_runs.design_facts",
    Kind.ENSEMBLE: "described_runs.ensemble_facts",
    Kind.CATALOG: "described_runs.catalog_facts",
    Kind.SCENARIO: "described_runs.scenario_facts",
    Kind.RESULT: "described_runs.result_facts",
}


def described(argument: str, stationxml: Path | None = None) -> Facts:
    """
    Return the facts of an input or result.

    Parameters
    ----------
    argument : str
        Path, or identifier of an earthquake.
    stationxml : Path, optional
        Metadata of records, if not in their folder.

    Raises
    ------
    CatalogError
        If the input cannot be read as its recognised kind.
    """
    kind, path = kind_of(argument), Path(argument)
    if kind is Kind.EVENT_ID:
        use = [("use", f"per-obspy run {argument} PAIRS fetches its records")]
        return Facts(kind, "not looked up", use, {}, {"event": argument})
    if kind is Kind.RECORDS:
        from per_obspy.records.summary import describe_records
        from per_obspy.runs.inputs.described_motion import record_facts

        return record_facts(*describe_records(records_place(path)[0], stationxml))
    # A folder with one table or layer is described as that
    if path.is_dir() and kind in PAIR_KINDS:
        path = next(file for file, one in files_in(path).items() if one is kind)
    module, _, name = _DESCRIBED_BY[kind].partition(".")
    facts: Facts = getattr(import_module(f"per_obspy.runs.inputs.{module}"), name)(path)
    return facts
