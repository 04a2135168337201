"""
Accept ObsPy Traces where a function takes samples of acceleration and their interval.

A Trace contains its interval, so that all other arguments are given by keyword. It is recognised
by its samples and header: ObsPy is not imported.
"""

import re
from collections.abc import Callable
from functools import wraps
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import ArrayLike
from per_obspy.units import unit_of_si

#: Unit of ``stats.units`` of the package's readers and of processed records.
ACCELERATION = "m/s2"

#: Units of ground motion by the times of differentiation from displacement, with the outputs of
#: ``remove_response`` that are in them.
_UNITS = ("m", "m/s", ACCELERATION)
_OUTPUTS = {"DISP": 0, "VEL": 1, "ACC": 2}
_ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}

#: Steps in ``stats.processing``, of any version of ObsPy, that change the unit of the samples, with
#: the output of ``remove_response``.
_STEP = re.compile(
    r"\b(remove_response|remove_sensitivity|simulate|differentiate|integrate|normalize|trigger)\("
)

_OUTPUT = re.compile(r"\boutput\s*=\s*[\"']?(\w+)")

#: Component -> last letters of channels that are another one.
OTHERS = {"north": "EZ", "east": "NZ"}

P = ParamSpec("P")
Result = TypeVar("Result", covariant=True)


class AccelerationTrace(Protocol):
    """Trace of ObsPy: samples ``data`` and header ``stats``."""

    data: NDArray[Any]
    stats: Any


class OfOneComponent(Protocol[P, Result]):
    """Function of one component: of samples and ``dt``, or of a Trace."""

    @overload
    def __call__(
        self, acceleration: ArrayLike, dt: float, *args: P.args, **kwargs: P.kwargs
    ) -> Result: ...
    @overload
    def __call__(
        self, acceleration: AccelerationTrace, *args: P.args, **kwargs: P.kwargs
    ) -> Result: ...


class OfTwoComponents(Protocol[P, Result]):
    """Function of both horizontals: of samples and ``dt``, or of two Traces."""

    @overload
    def __call__(
        self, north: ArrayLike, east: ArrayLike, dt: float, *args: P.args, **kwargs: P.kwargs
    ) -> Result: ...
    @overload
    def __call__(
        self,
        north: AccelerationTrace,
        east: AccelerationTrace,
        *args: P.args,
        **kwargs: P.kwargs,
    ) -> Result: ...


def takes_trace(
    function: Callable[Concatenate[ArrayLike, float, P], Result],
) -> OfOneComponent[P, Result]:
    """Let a function of ``acceleration, dt`` take one Trace instead of both."""
    return _taking(("acceleration",), function)


def takes_traces(
    function: Callable[Concatenate[ArrayLike, ArrayLike, float, P], Result],
) -> OfTwoComponents[P, Result]:
    """Let a function of ``north, east, dt`` take two Traces instead of these three."""
    return _taking(("north", "east"), function)


def _taking(names: tuple[str, ...], function: Callable[..., Result]) -> Callable[..., Result]:
    """Let a function of some components and ``dt`` take a Trace for each component."""

    @wraps(function)
    def with_traces(*args: Any, **kwargs: Any) -> Result:
        traces = _leading_traces(names, args, kwargs)
        if traces is None:
            return function(*args, **kwargs)
        if len(traces) > 1:
            _require_same_times(*traces)
        # In m/s², with the interval of the header
        samples = map(_samples, names, traces)
        others = _others(function.__name__, names, args, kwargs)
        return function(*samples, float(traces[0].stats.delta), **others)

    return with_traces


def _leading_traces(
    names: tuple[str, ...], args: tuple[Any, ...], kwargs: dict[str, Any]
) -> list[AccelerationTrace] | None:
    """Return the leading arguments if they are Traces, None if they are samples."""
    # By position or by keyword
    given = [*args[: len(names)], *(kwargs[name] for name in names if name in kwargs)]
    traces = [value for value in given if hasattr(value, "stats") and hasattr(value, "data")]
    if not traces:
        return None
    if len(traces) < len(names):
        raise ValueError(f"{' and '.join(names)} must both be Traces, or both arrays of samples")
    return traces


def _others(
    function: str, names: tuple[str, ...], args: tuple[Any, ...], kwargs: dict[str, Any]
) -> dict[str, Any]:
    """Return the keywords that follow the Traces; refuse a second interval and bare values."""
    # A bare value could be meant as dt or as the argument after it
    if len(args) > len(names) or "dt" in kwargs:
        traces = "two Traces" if len(names) > 1 else "a Trace"
        raise ValueError(
            f"{function} takes dt from {traces}: leave dt out, and give all other arguments by "
            f"keyword"
        )
    return {name: value for name, value in kwargs.items() if name not in names}


def _samples(name: str, trace: AccelerationTrace) -> NDArray[Any]:
    """Return the samples of a Trace of acceleration in m/s²."""
    stats = trace.stats
    # The last letter of a channel is the direction of its sensor: none of another component
    component = str(stats.channel)[-1:]
    if component and component in OTHERS.get(name, ""):
        raise ValueError(f"{name} is the Trace {trace.stats.channel!r}: give north, then east")
    unit = unit_after_steps(stats)
    if unit == ACCELERATION:
        return trace.data
    known = "an unknown unit, maybe counts" if unit is None else repr(unit)
    raise ValueError(
        f"{name} is a Trace in {known}, not in m/s2: use per_obspy.process, or remove_response "
        f"with output='ACC'; of samples that are in m/s2 set stats.units = 'm/s2'"
    )


def unit_after_steps(stats: Any) -> str | None:
    """
    Return the unit of the samples of a Trace after the steps that ``stats.processing`` names.

    ObsPy changes neither ``units`` nor ``response`` and ``calib`` when it removes a response,
    differentiates or integrates. A unit without a ``quantity`` is the user's, and is right. It is
    ``stats.units`` where no step changes it, None where there is none, and ``unknown after STEP``
    where the unit is lost.

    Examples
    --------
    >>> steps = ["ObsPy 1.4.0: remove_response(output='VEL')", "ObsPy 1.4.0: differentiate()"]
    >>> unit_after_steps({"processing": steps}), unit_after_steps({"processing": steps[:1] * 2})
    ('m/s2', 'unknown after remove_response')
    """
    unit = stats.get("units")
    steps = _unit_steps(stats.get("processing", ()))
    is_physical, quantity = unit not in (None, "counts"), _ORDERS.get(stats.get("quantity"))
    if not steps or (is_physical and quantity is None):
        return None if unit is None else str(unit)
    # Times of differentiation from displacement; None for counts
    order, is_removed = quantity if is_physical else None, False
    for step, line in steps:
        if step in ("differentiate", "integrate") and order is not None:
            order += 1 if step == "differentiate" else -1
        elif step.startswith("remove") and not is_removed:
            order, is_removed = _removed_to(step, line, stats), True
        else:
            order = None
        # Beyond acceleration and displacement, or twice removed
        if order not in _ORDERS.values():
            return f"unknown after {step}"
    return None if order is None else _UNITS[order]


def _unit_steps(processing: ArrayLike) -> list[tuple[str, str]]:
    """Return the steps that change the unit, each with its line."""
    lines = map(str, np.atleast_1d(np.asarray(processing, dtype=object)).tolist())
    return [(found[1], line) for line in lines if (found := _STEP.search(line))]


def _removed_to(step: str, line: str, stats: Any) -> int | None:
    """Return the order of the samples after removal of response or sensitivity, None if unknown."""
    output = _OUTPUT.search(line)
    if step == "remove_response" and (output is None or output[1] != "DEF"):
        return _OUTPUTS.get(output[1]) if output else None
    # In the unit of the response, if it is still there
    sensitivity = getattr(stats.get("response"), "instrument_sensitivity", None)
    unit = unit_of_si(getattr(sensitivity, "input_units", ""))
    return _UNITS.index(unit.name) if unit else None


def _require_same_times(north: AccelerationTrace, east: AccelerationTrace) -> None:
    """Raise ``ValueError`` if two Traces differ in interval, length or start."""
    first, second = north.stats, east.stats
    # A shift by less than half an interval is that of the clock
    if (first.delta, first.npts) != (second.delta, second.npts):
        raise ValueError(
            f"north has {first.npts} samples of {first.delta:g} s, east {second.npts} of "
            f"{second.delta:g} s: trim both to the same times"
        )
    if abs(first.starttime - second.starttime) > first.delta / 2.0:
        raise ValueError(
            f"north starts at {first.starttime}, east at {second.starttime}: trim both to the same "
            f"times"
        )
