"""Describe any input or result, for ``per-obspy info``."""

from pathlib import Path

from per_obspy.pipeline.inputs.facts import Facts
from per_obspy.pipeline.inputs.input_kinds import (
    PAIR_KINDS,
    Kind,
    files_in,
    kind_of,
    records_place,
)


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
    # A folder with one table or layer is described as that
    if path.is_dir() and kind in PAIR_KINDS:
        path = next(file for file, one in files_in(path).items() if one is kind)
    if kind is Kind.RECORDS:
        return _records(path, stationxml)
    return _tables(path, kind) or _motion(path, kind) or _runs(path, kind)


def _records(path: Path, stationxml: Path | None) -> Facts:
    """Return the facts of records."""
    from per_obspy.pipeline.inputs.described_motion import record_facts
    from per_obspy.records.summary import describe_records

    return record_facts(*describe_records(records_place(path)[0], stationxml))


def _tables(path: Path, kind: Kind) -> Facts | None:
    """Return the facts of a pair table or layer, None for other kinds."""
    from per_obspy.pipeline.inputs import described_tables

    if kind is Kind.PAIRS:
        return described_tables.pair_table_facts(path)
    if kind is Kind.FOOTPRINTS:
        return described_tables.footprint_facts(path)
    return described_tables.risk_table_facts(path) if kind is Kind.RISK else None


def _motion(path: Path, kind: Kind) -> Facts | None:
    """Return the facts of ground motion or its metadata, None for other kinds."""
    from per_obspy.pipeline.inputs import described_motion

    describe = {
        Kind.SHAKEMAP: described_motion.shakemap_facts,
        Kind.SPECTRUM: described_motion.spectrum_facts,
        Kind.SPECTRA: described_motion.spectra_facts,
        Kind.EVENT: described_motion.event_facts,
        Kind.STATIONS: described_motion.station_facts,
    }.get(kind)
    return describe(path) if describe else None


def _runs(path: Path, kind: Kind) -> Facts:
    """Return the facts of a configuration or of results."""
    from per_obspy.pipeline.inputs import described_runs

    describe = {
        Kind.DESIGN: described_runs.design_facts,
        Kind.ENSEMBLE: described_runs.ensemble_facts,
        Kind.CATALOG: described_runs.catalog_facts,
        Kind.SCENARIO: described_runs.scenario_facts,
        Kind.RESULT: described_runs.result_facts,
    }.get(kind, described_runs.configuration_facts)
    return describe(path)
