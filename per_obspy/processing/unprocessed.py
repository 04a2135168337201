"""The record as it was before its baseline, taper and filter, to be shown beside what became of it."""

from obspy import Stream, Trace

from per_obspy.config import Processing
from per_obspy.processing.filter.polynomial import mean_removed
from per_obspy.processing.instrument_response import in_acceleration
from per_obspy.processing.notes import is_processed
from per_obspy.processing.station.merging import merged


def before_processing(stream: Stream, processed: Trace, settings: Processing) -> Trace | None:
    """
    Return the raw record of a processed trace in m/s2, without the mean of its noise, over the time that was processed.

    Parameters
    ----------
    stream : obspy Stream
        All channels of the station, as they were read.
    processed : obspy Trace
        From `process_station`.
    settings : Processing
        Those that it was processed with.

    Returns
    -------
    obspy Trace or None
        None where others had processed it.
    """
    raw, _ = merged(
        Stream([one for one in stream if one.id == processed.id and not is_processed(one)])
    )
    if not raw:
        return None
    chosen = processed.stats.per_obspy
    physical = in_acceleration(raw, gain_tolerance=settings.gain_tolerance)[0]
    pads = [
        round(float(chosen.get(name, 0.0)) / processed.stats.delta)
        for name in ("pad_before", "pad_after")
    ]
    start = processed.stats.starttime + pads[0] * processed.stats.delta - physical.stats.starttime
    first = max(round(start / physical.stats.delta), 0)
    physical.data = physical.data[first : first + processed.stats.npts - sum(pads)]
    physical.stats.starttime += first * physical.stats.delta
    return mean_removed(Stream([physical]), float(chosen.noise))[0]
