"""
Decisions of the processing of a station that depend on the earthquake.

The computed P wave chooses among the picks of an instrument, and the magnitude gives the corner of
a record without noise. A station keeps each decision with its causes. An earthquake of another
place, time or magnitude that leads to the same decisions leads to the same motion to the last bit,
so that the station is not processed again.
"""

from collections.abc import Iterable, Mapping
from typing import Any

from per_obspy.config import Processing
from per_obspy.processing.filter.corners import fallback_highpass
from per_obspy.processing.noise.windows import Source, same_onset


def same_decisions(
    decisions: Iterable[Mapping[str, Any]], source: Source, settings: Processing
) -> bool:
    """
    Return whether an earthquake leads to the decisions of an earlier processing.

    Parameters
    ----------
    decisions : iterable of mapping
        Collected by a :class:`.noise.windows.Source`, perhaps read from a file.
    source : Source
        The earthquake now.
    settings : Processing
        Those of the earlier processing.

    Returns
    -------
    bool
        False as well if a decision is damaged, or would depend on traces that were not picked.
    """
    try:
        return all(_is_same(decision, source, settings) for decision in decisions)
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError):
        return False


def _is_same(decision: Mapping[str, Any], source: Source, settings: Processing) -> bool:
    """Return whether an earthquake leads to one earlier decision."""
    if "onset" in decision:
        return same_onset(decision, source, settings.pick_tolerance)
    table, unknown = settings.fallback_highpass, settings.unknown_highpass
    corner = fallback_highpass(source.magnitude, table, unknown)
    return [corner.frequency, corner.reason] == list(decision["highpass"])
