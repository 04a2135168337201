"""The raw record in m/s2 over the time of its processed one, for comparison in figures."""

from obspy import Stream, Trace

from per_obspy.config import Processing
from per_obspy.processing.filter.polynomial import mean_removed
from per_obspy.processing.instrument_response import in_acceleration
from per_obspy.processing.notes import is_processed
from per_obspy.processing.station.merging import merged


def before_processing(stream: Stream, processed: Trace, settings: Processing) -> Trace | None:
    """
    Return the raw record of a processed trace in m/s2 over the processed time.

    Only the mean of its noise is removed.

    Parameters
    ----------
    stream : obspy Stream
        All channels of the station as read.
    processed : obspy Trace
        From `process_station`.
    settings : Processing
        Settings of that processing.

    Returns
    -------
    obspy Trace or None
        None if the record came processed by others.
    """
    pieces = [trace for trace in stream if trace.id == processed.id and not is_processed(trace)]
    raw, _ = merged(Stream(pieces))
    if not raw:
        return None
    physical = in_acceleration(raw, settings.gain_tolerance)[0]
    # Start of the processed record without its pads, s and samples after that of the raw one
    chosen, dt = processed.stats.per_obspy, processed.stats.delta
    before = round(float(chosen.get("pad_before", 0.0)) / dt)
    after = round(float(chosen.get("pad_after", 0.0)) / dt)
    start = processed.stats.starttime + before * dt - physical.stats.starttime
    first = max(round(start / physical.stats.delta), 0)
    # The samples between the pads
    count = processed.stats.npts - (before + after)
    physical.data = physical.data[first : first + count]
    physical.stats.starttime += first * physical.stats.delta
    return mean_removed(Stream([physical]), float(chosen.noise))[0]
