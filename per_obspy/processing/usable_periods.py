"""The periods at which a filtered record still tells about the ground."""

from obspy import Stream

from per_obspy.processing.notes import noted

SAMPLES_A_PERIOD = 5


def usable_periods_noted(stream: Stream, usable: float = 0.8) -> Stream:
    """
    Return a copy that knows its usable periods, from its corners.

    Longest: usable / highpass. Shortest: 1 / (usable lowpass) or 5 sampling intervals, the longer.

    Parameters
    ----------
    stream : obspy Stream
        ``stats.per_obspy`` has ``highpass`` and ``lowpass``, Hz.
    usable : float
        Fraction of a corner's period that is usable, dimensionless.

    Returns
    -------
    obspy Stream
        With ``longest_period`` and ``shortest_period``, s, in ``stats.per_obspy``.

    References
    ----------
    Boore 2004, J. Earthq. Eng. 8, 193-207; Akkar & Bommer 2006, Earthq. Eng. Struct. Dyn. 35,
    1275-1299.
    """
    out = stream.copy()
    for trace in out:
        corners = trace.stats.per_obspy
        longest = usable / corners.highpass
        shortest = max(1 / (usable * corners.lowpass), SAMPLES_A_PERIOD * trace.stats.delta)
        noted(
            trace,
            f"usable from {shortest:.3g} to {longest:.3g} s",
            shortest_period=shortest,
            longest_period=longest,
        )
    return out
