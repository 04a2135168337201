"""K-NET and KiK-net: ObsPy reads them; their header is put into the words of the vocabulary."""

from obspy import Trace

from per_obspy.constants import GAL
from per_obspy.errors import RecordRejected
from per_obspy.formats.text.vocabulary import Words, coordinates, orientation

#: KiK-net numbers its sensors: 1 in the borehole, 2 at the surface
_SENSORS = "12"

#: characters of a column of samples
_WIDTH = 9


def with_knet_words(record: Trace) -> Trace:
    """
    Return a copy of a K-NET trace with the words of the vocabulary.

    Samples stay counts, with the gain in ``calib`` (m/s2 per count). A file that is shorter than
    its header promises is refused: ObsPy reads a cut file as a shorter record.
    """
    header = record.stats.knet
    seconds = record.stats.npts * record.stats.delta
    # Half a sample is rounding
    if seconds < header.duration - record.stats.delta / 2:
        problem = f"the header promises {header.duration:g} s, the file holds {seconds:g} s"
        raise RecordRejected(record.id, problem)
    trace = record.copy()
    stats = trace.stats
    stats.update({"units": "counts", "quantity": "acceleration", "processing_level": "raw"})
    stats.update(orientation(record.stats.channel.rstrip(_SENSORS)))
    stats.coordinates = coordinates(header.stla, header.stlo, header.stel)
    # The header's peak is in gal, the samples are counts
    stats.header_peak = header.accmax * GAL / record.stats.calib
    stats.event = knet_event(record)
    return trace


def knet_event(record: Trace) -> Words:
    """
    Return the event of a K-NET header, in the words of the vocabulary.

    The origin time is often rounded to the minute.
    """
    header = record.stats.knet
    return {
        "time": header.evot,
        "latitude": header.evla,
        "longitude": header.evlo,
        "depth": 1000 * header.evdp,
        "magnitude": header.mag,
    }


def require_whole_numbers(content: bytes, name: str) -> None:
    """
    Refuse a file that ends inside its last number, which ObsPy would read as a smaller one.

    The last line then stops inside a column, whether it has an end or not.
    """
    *_, line_before, last = [b"", b"", *content.rstrip(b"\x00\r\n ").splitlines()]
    is_sample_line = not line_before.strip(b"0123456789- ")
    if is_sample_line and (len(line_before.rstrip()) - len(last)) % _WIDTH:
        problem = f"last number: the file ends inside a column after {last[-_WIDTH:]!r}"
        raise RecordRejected(name, problem)
