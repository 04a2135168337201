"""K-NET and KiK-net: ObsPy reads them; here their header is said in the words of the vocabulary."""

from obspy import Trace

from per_obspy.errors import RecordRejected
from per_obspy.formats.text.vocabulary import coordinates, orientation

#: KiK-net numbers its sensors: 1 in the borehole, 2 at the surface
_SENSORS = "12"


def with_knet_words(record: Trace) -> Trace:
    """
    Return a copy of a K-NET trace with the vocabulary's words; counts stay, with the gain in ``calib`` (m/s2).

    ObsPy reads a cut file as a shorter record; here it is refused.
    """
    header = record.stats.knet
    seconds = record.stats.npts * record.stats.delta
    if seconds < header.duration - record.stats.delta:
        raise RecordRejected(
            record.id, f"the header promises {header.duration:g} s, the file holds {seconds:g} s"
        )
    result = record.copy()
    result.stats.update({"units": "counts", "quantity": "acceleration", "processing_level": "raw"})
    result.stats.update(orientation(record.stats.channel.rstrip(_SENSORS)))
    result.stats.coordinates = coordinates(header.stla, header.stlo, header.stel)
    result.stats.header_peak = header.accmax * 0.01 / record.stats.calib
    result.stats.event = {
        "time": header.evot,
        "latitude": header.evla,
        "longitude": header.evlo,
        "depth": 1000 * header.evdp,
        "magnitude": header.mag,
    }
    return result
