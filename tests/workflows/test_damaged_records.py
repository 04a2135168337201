"""The damaged variants of a real record: each is named, or is one of those that nothing tells."""

import runpy
from pathlib import Path

import obspy
import pytest

from per_obspy.config import Processing
from per_obspy.errors import RecordRejected
from per_obspy.processing.chain import process_station
from per_obspy.records.metadata import with_metadata

pytestmark = pytest.mark.long

SCRIPT = runpy.run_path(str(Path(__file__).parents[2] / "workflows" / "damaged_records.py"))
FAULTS = SCRIPT["FAULTS"]

#: Only other stations, or nothing at all, tell these from a good record.
SILENT = {
    "velocity in place of acceleration",
    "9.81 times as small",
    "100 times as small",
    "981 times as small",
    "north and east exchanged",
    "east with the wrong sign",
    "clipped at 80 %, then 1 % of noise",
    "saturated softly at 50 %",
    "samples of another station",
    "station at 0, 0",
    "longitude without its sign",
}


@pytest.fixture(scope="module")
def record(real_data):
    folder = real_data / "records" / "ridgecrest2019_mseed"
    streams = [obspy.read(str(folder / f"CI.{code}*.mseed")) for code in ("CCC", "CLC")]
    return SCRIPT["Record"](streams[0], obspy.read_inventory(folder / "CI.CCC.xml"), streams[1])


def said(record):
    """Return reasons, flags and warnings of a station."""
    stream, texts = obspy.Stream(), []
    for trace in record.stream:
        try:
            stream += with_metadata(trace, record.inventory)
        except RecordRejected as fault:
            texts += fault.reasons
    accepted, rejected = process_station(stream, Processing())
    texts += [reason for row in rejected for reason in row.reasons]
    for trace in accepted:
        known = trace.stats.per_obspy
        texts += [known.get("record_flags", ""), known.get("warnings", "")]
    return [text for text in texts if text]


def test_there_are_48_variants_with_names_of_their_own():
    assert len({fault.name for fault in FAULTS}) == 48
    assert {fault.name for fault in FAULTS} > SILENT


def test_nothing_is_said_of_the_record_as_it_is(record):
    assert said(record) == []


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_is_named_or_is_known_to_be_silent(record, fault):
    damaged = record._replace(stream=record.stream.copy(), inventory=record.inventory.copy())
    fault.damage(damaged)
    is_named = any(word in text for text in said(damaged) for word in fault.words)
    assert is_named is (fault.name not in SILENT)
