"""Baselines of constant and polynomial form: means and trends."""

from collections.abc import Callable

import numpy as np
from numpy.polynomial.legendre import legvander
from obspy import Stream

from per_obspy.checks import FloatArray
from per_obspy.processing.long_records import blocks
from per_obspy.processing.notes import copied, noted


def mean_removed(stream: Stream, pre_event: float = 0.0) -> Stream:
    """
    Return a copy without the mean of its quiet beginning, or else of the whole record.

    Parameters
    ----------
    stream : obspy Stream
    pre_event : float
        Length of the noise at the beginning, s; 0 or less: the mean of the whole record.

    Returns
    -------
    obspy Stream

    References
    ----------
    Boore & Bommer 2005, Soil Dyn. Earthq. Eng. 25, 93-115, section 3.
    """
    out = copied(stream)
    for trace in out:
        # Samples of the noise, if there are any
        quiet = trace.data[: max(round(pre_event / trace.stats.delta), 0)]
        samples = quiet if quiet.size else trace.data
        mean = float(samples.mean())
        trace.data = trace.data - mean
        source = f"the first {pre_event:g} s" if quiet.size else "the whole record"
        noted(trace, f"mean {mean:.4g} of {source} removed", mean=mean, mean_of=source)
    return out


def trend_removed(stream: Stream, order: int = 1) -> Stream:
    """
    Return a copy without its least-squares polynomial trend, fitted to the whole record.

    Parameters
    ----------
    stream : obspy Stream
    order : int
        Of the polynomial; 1 is a straight line.

    Returns
    -------
    obspy Stream
    """
    out = copied(stream)
    for trace in out:
        trace.data = without_trend(trace.data, order)
        noted(trace, f"polynomial trend of order {order} removed", trend_order=order)
    return out


def trend(data: FloatArray, order: int) -> FloatArray:
    """
    Return the least-squares polynomial of evenly spaced samples.

    Parameters
    ----------
    data : (n_samples,) ndarray
        Any unit.
    order : int
        Of the polynomial.

    Returns
    -------
    (n_samples,) ndarray
        In the unit of the data.

    Notes
    -----
    Legendre polynomials are nearly orthogonal there, so that the normal equations are as accurate
    as an orthogonal decomposition, which takes the memory of a dozen records.
    """
    places = np.linspace(-1, 1, data.size)
    # Sums of products over the blocks
    products, moments = np.zeros((order + 1, order + 1)), np.zeros(order + 1)
    for block in blocks(0, data.size):
        basis = legvander(places[block], order)
        products += basis.T @ basis
        moments += basis.T @ data[block]
    coefficients = np.linalg.solve(products, moments)
    # The places give way to the values of the polynomial there
    for block in blocks(0, data.size):
        places[block] = legvander(places[block], order) @ coefficients
    return places


def without_trend(data: FloatArray, order: int) -> FloatArray:
    """Return samples without their `trend`, in a new array."""
    out = trend(data, order)
    return np.subtract(data, out, out=out)


def detrended(stream: Stream, removed: Callable[..., FloatArray], **options: float) -> Stream:
    """
    Return a copy without the baseline that a function of `velocity` removes.

    Parameters
    ----------
    stream : obspy Stream
    removed : callable
        From samples, m/s2, sampling interval, s, and options to samples.
    **options : float
        Further arguments of the function, SI.

    Returns
    -------
    obspy Stream
    """
    out = copied(stream)
    numbers = ", ".join(f"{name} {value:g}" for name, value in options.items())
    for trace in out:
        trace.data = removed(trace.data, trace.stats.delta, **options)
        noted(trace, f"baseline by {removed.__name__} removed ({numbers})")
    return out
