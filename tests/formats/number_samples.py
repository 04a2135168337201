"""Made-up files with headers of integers and reals: GeoNet, SMC, BHRC and COSMOS."""

from sample_file import GRAVITY, Sample, Samples, block


def geonet_v1a(motion: Samples) -> Sample:
    text = []
    for direction in ("N10E", "N80W", "Up"):
        text += geonet_text("Uncorrected", direction, len(motion))
        text += [geonet_numbers([len(motion), 0, 0]), block(motion, "%8.3f", 10)]
    return geonet("raw", text, motion)


def geonet_v2a(motion: Samples) -> Sample:
    """Acceleration, velocity and displacement."""
    text = []
    for direction in ("N10E", "N80W", "Up"):
        text += geonet_text("Corrected", direction, len(motion))
        text += [geonet_numbers([len(motion)] * 3), *[block(motion, "%8.3f", 10)] * 3]
    return geonet("processed", text, motion)


def geonet(level: str, text: list[str], motion: Samples) -> Sample:
    """Return three components, mm/s2."""
    return Sample(
        "GEONET",
        "\n".join(text),
        ("NZ.HSES.20.HN1", "NZ.HSES.20.HN2", "NZ.HSES.20.HNZ"),
        (0.001 * motion,) * 3,
        0.005,
        (10, 280, None),
        (0, 0, -90),
        level,
        start="2016-11-13T11:02:20.5",
        coordinates=(-42.52, 172.83),
    )


#: state -> unit and filter
GEONET_STATES = {
    "Uncorrected": (
        "Raw readings in units of 1.00 mm/s/s  at intervals of 0.005 s",
        "Data is unfiltered",
    ),
    "Corrected": (
        "Instrument corrected data at 0.005 sec intervals",
        "Band-pass filter transition bands are .10-.25 Hz and 24.50-25.50 Hz",
    ),
}


def geonet_text(state: str, direction: str, samples: int) -> list[str]:
    """Return the sixteen lines of text."""
    unit, bands = GEONET_STATES[state]
    return [
        f"{state} accelerogram 20161113_110256_HSES_20 GNS Science",
        "Site HSES      42 31 12S  172 49 48E     Basalt file:  20161113_110300_HSES",
        "Some Emergency Centre",
        "Instrument Basalt_2430",
        "Resolution: 24-bit   Instr Period: 0.0050 s   Damping: 0.700",
        "Accelerogram 20161113_110256_HSES_20                 Processed 2016 December 09",
        "5 km south-west of somewhere",
        "2016 November 13         11:02:56 UT",
        "Epicentre  42 41 33S 173 01 19E  Bearing S40E  Dist   25km  Depth   15km Mw 7.82",
        f"Number of points  {samples}    Duration 0.06 s",
        unit,
        bands,
        f"Component {direction}",
        "Acceleration:  Peak      4.0 mm/s/s at  48.13 s     RMS   209.89 mm/s/s",
        "Velocity",
        "Displacement",
    ]


def geonet_numbers(sizes: list[int]) -> str:
    """Return the integers (start, sizes of three blocks) and reals (intervals) of the header."""
    # Parts of the start, the sizes, and the intervals
    integers = [0] * 40
    integers[8:10], integers[18:20], integers[38:40] = [2016, 11], [13, 11], [2, 20500]
    integers[30], integers[33:36] = sizes[0], sizes
    reals = [0.0] * 60
    reals[24], reals[25] = 0.005, 0.005
    return block(integers, "%8d", 10) + "\n" + block(reals, "%8.4f", 10)


def smc(motion: Samples) -> Sample:
    """Numbers of ten columns whose exponent has one digit, which touch each other."""
    words = [f"{value:11.4E}" for value in motion]
    short = "".join(word[:9] + word[-1] for word in words)
    rows = [short[first : first + 80] for first in range(0, len(short), 80)]
    # Eleven lines of text, numbers, a comment, samples
    lines = [
        "2 CORRECTED ACCELEROGRAM",
        "*",
        "SAF0A",
        "     1989  10  18    0004 Some Event",
        "Moment Mag=      7.1",
        "station = San Francisco, Some Street component=    360",
        "epicentral dist =     89.0",
        "inst type=SMA-1      data source = USGS",
        *["*"] * 3,
        smc_numbers(len(motion)),
        "|comment",
        *rows,
    ]
    return Sample(
        "SMC",
        "\n".join(lines),
        ("NP.1675..HNN",),
        (0.01 * motion,),
        0.005,
        (0,),
        (0,),
        "processed",
        start="1989-10-18T00:04:30",
        coordinates=(37.728, -122.385),
    )


def smc_numbers(samples: int) -> str:
    """Return the integers and reals of SMC's header; most are marks for unknown."""
    integers = [-32768] * 48
    integers[1:6], integers[12:14] = [1989, 291, 0, 4, 30], [90, 360]
    integers[15], integers[16], integers[29] = 1, samples, 1675
    reals = [0.17e39] * 50
    # Sampling rate, coordinates, extremes and the lower corner
    reals[1], reals[10:12] = 200.0, [37.728, -122.385]
    reals[29], reals[31], reals[32] = 4.0, -3.75, 0.1
    return block(integers, "%10d", 8) + "\n" + block(reals, "%15.7E", 5)


def bhrc(motion: Samples) -> Sample:
    lines = []
    for component in ("L1", "V2", "T3"):
        lines += bhrc_lines(component, motion)
    return Sample(
        "BHRC",
        "\n".join(lines),
        (".SOMETOWN..HN1", ".SOMETOWN..HNZ", ".SOMETOWN..HN2"),
        (GRAVITY / 10 * motion,) * 3,
        0.005,
        (352, None, 82),
        (0, -90, 0),
        "raw",
        coordinates=(38.474, 47.059),
    )


def bhrc_lines(component: str, motion: Samples) -> list[str]:
    """Return one component."""
    station = "Some Town                 Station   38.474 N 47.059 E   Altitude 1360m"
    magnitudes = "mb      Ms      Mw6.1   M        ML   (BHRC   )"
    duration = 0.005 * len(motion)
    # Thirteen lines of text, fourteen of numbers (the rate leads the second row of reals), samples
    return [
        "* VOL1DS FILE:  5520/01",
        "Inst Type = SSA-2",
        "Origin Time : 2012/08/11   12:23:16",
        "",
        component[0],
        "",
        f"COMP {component}",
        f"{station}   Azimuth L 352   T 82",
        f"Epicenter 38.520 N 46.860 E   FD 12 Km {magnitudes}",
        "INSTR PERIOD =  .019 SEC   DAMPING =  .640",
        f"NO. OF POINTS =  {len(motion)}      DURATION =   {duration:.3f}",
        "UNITS ARE SECONDS AND G/10",
        "",
        *["    0" * 14] * 7,
        "  .188324E-01  .640000E+00  .780800E+02  .000000E+00  .100000E+00  .00",
        "  .200000E+03  .000000E+00  .000000E+00  .000000E+00  .000000E+00  .00",
        *["  .000000E+00" * 5] * 5,
        block(motion, "%13.6E", 10),
        "/&",
    ]


def cosmos_v0c(motion: Samples) -> Sample:
    """Counts with their gain."""
    seconds = round(0.005 * len(motion))
    text = []
    # Two channels per file
    for direction, code in (("90 Deg", "HNE"), ("Up", "HNZ")):
        text += cosmos_text("Raw acceleration counts  ", "", "No filtering!", direction)
        text += cosmos_numbers(code, -3750.0)
        points = f"   {len(motion)} raw accel.   pts, approx  {seconds} secs"
        text += [f"{points}, units=counts (50),Format=(10I8)", block(1000 * motion, "%8d", 10)]
        text += [f"End-of-data for C031.{code}.NC.01 acceleration"]
    return cosmos("raw", "counts", text, 1000 * motion)


def cosmos_v2c(motion: Samples) -> Sample:
    seconds = round(0.005 * len(motion))
    band = "Record filtered below  0.03 Hz (periods over 33 secs), and above 20.0 Hz"
    text = []
    # Two channels per file
    for direction, code in (("90 Deg", "HNE"), ("Up", "HNZ")):
        text += cosmos_text("Corrected acceleration   ", " Src: some.txt", band, direction)
        text += cosmos_numbers(code, -3.75)
        points = f"   {len(motion)} acceleration pts, approx   {seconds} secs"
        text += [f"{points}, units=cm/sec2(04),Format=(8F10.5)", block(motion, "%10.5f", 8)]
        text += [f"End-of-data for C031.{code}.NC.01 acceleration"]
    return cosmos("processed", "m/s2", text, 0.01 * motion)


def cosmos(level: str, units: str, text: list[str], values: Samples) -> Sample:
    """Return two channels, named as SEED names them in a comment."""
    return Sample(
        "COSMOS",
        "\n".join(text),
        ("NC.C031.01.HNE", "NC.C031.01.HNZ"),
        (values,) * 2,
        0.005,
        (90, None),
        (0, -90),
        level,
        units,
        start="2014-08-24T10:20:21.5",
        coordinates=(37.86322, -122.276932),
    )


def cosmos_text(title: str, source: str, band: str, direction: str) -> list[str]:
    """Return the thirteen lines of text."""
    return [
        f"{title} (Format v01.20 with 13 text lines){source}",
        "Record of Some Earthquake of Sun Aug 24, 2014 10:20 UTC",
        "Hypocenter: 38.21550 -122.31167 H= 11km Mw=6.0, Md=5.9(NC), Ml=5.6(NC)",
        "Origin: 2014/08/24 10:20:44 UTC (NCSN)",
        "Statn No: 08-060667 Code:NC-C031   NCSN  Some Street",
        "Coords: 37.8632 -122.2769  Site Geology:",
        "Recorder: GSR-IA18  s/n ? ( ? Chns of   ? at Sta) Sensor: GeoSIG-AC63",
        "Rcrd start time: 2014/08/24 10:20:21.500 UTC (Q=5) RcrdId: (see comment)",
        f"Sta Chan   ?: {direction} (Rcrdr Chan  ?) Location:Ground",
        "Raw record length =  0.065 sec, Uncor max =     4000 counts, at  42.340 sec.",
        "Processed: 2015/04/01 16:46:25 UTC (NCSN)",
        band,
        "Values used when parameter of data value is unknown/unspecified:  -999, -999.000",
    ]


def cosmos_numbers(code: str, peak: float) -> list[str]:
    """Return integers, reals and comments of a header; most numbers are marks for unknown."""
    integers = [-999] * 100
    integers[39:46] = [2014, 236, 8, 24, 10, 20, 5]
    reals = [-999.0] * 100
    reals[0:3], reals[29], reals[33] = [37.86322, -122.276932, 29.0], 21.5, 0.02
    # Interval in ms, peak, microvolts per count, constants of the sensor, gain
    reals[61], reals[63] = 5.0, peak
    reals[21], reals[39:42], reals[46] = 2.0, [100.0, 0.7, 4.0], 1.0
    return [
        " 100 Integer-header values follow on  10 lines, Format = (10I8)",
        block(integers, "%8d", 10),
        " 100 Real-header values follow on  20 lines, Format =(5F15.6)",
        block(reals, "%15.6f", 5),
        "   1 Comment line(s) follow, each starting with a |",
        f"|<SCNL>C031.{code}.NC.01    <AUTH> 2015/03/01 16:46:25.000",
    ]
