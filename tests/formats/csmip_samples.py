"""Made-up files of CSMIP's family: CSMIP, RENADIC and USC."""

import numpy as np
from sample_file import GRAVITY, Sample, Samples, block, film, integers_and_reals

ETNA = {"start": "2012-02-13T21:06:45", "coordinates": (40.941, -123.633)}


def csmip_header(
    channel: int, direction: str, dt: float, unit: str, samples: int, agency: str = "CGS"
) -> list[str]:
    """Return the thirteen common lines."""
    return [
        f"Uncorrected Accelerogram Data             Processed: 02/13/12, {agency}  146be002",
        "Record of Mon Feb 13, 2012 13:06:45.0 PST             (Avol1 v9.2,12/11)",
        "Preliminary Processing            (Origin:  02/13/12, 21:06:30.5 UTC)",
        "89146-L2500-12044.02                 Start time:  2/13/12, 21:06:45.0 UTC (GPS)",
        "Station No. 89146   40.941N, 123.633W      Etna  s/n 2500  (3 Chns of  3 at Sta)",
        f"Willow Creek                              {agency}",
        f"Chan  {channel}: {direction:20}    Location: Free field",
        "Record of Mon Feb 13, 2012 13:06:45.0 PST    Mon Feb 13, 2012 13:06:45.0 PST",
        "Hypocenter: 40.201N,123.826W, H=7KM.     ML=6.6(NEIC), MW=6.4(CIT)",
        "Instr Period =  .0200 sec,  Damping =  .670,  Sensitivity =  .63  v/g",
        f"No. of Points =  {samples}  Record Length = 1.0 sec   at {1 / dt:.0f} Samples/sec",
        f"Units of uncor data are sec and {unit} .        Max  =   .4 g , at  30.590 sec.",
        "RMS calc for complete record =        .   Chn. metadata effective date: 08/10/05",
    ]


def csmip_v1(motion: Samples) -> Sample:
    size = len(motion)
    lines = []
    for channel, direction in enumerate(("360 Deg", "Up", "90 Deg"), start=1):
        lines += csmip_header(channel, direction, 0.005, "g", size)
        lines += integers_and_reals(50, {6: 4.0 / channel})
        # A title with the sampling rate, then the samples in g
        points = f" {size} Accelerogram points at 200 pts/sec in units of g ."
        lines += [f"{points}      Format: (8f9.6)", block(motion / channel, "%9.6f", 8)]
        lines += [f"/&  -----  End of Data for Channel {channel}"]
    return Sample(
        "CSMIP_V1",
        "\n".join(lines) + "\n",
        ("CE.89146..HNN", "CE.89146..HNZ", "CE.89146..HNE"),
        tuple(GRAVITY * np.round(motion / channel, 6) for channel in (1, 2, 3)),
        0.005,
        (0, None, 90),
        (0, -90, 0),
        "raw",
        **ETNA,
    )


def csmip_raw(motion: Samples) -> Sample:
    """Digitised film: times and values in turn."""
    lines = csmip_header(1, "S 16 E", 0.01, "G/10", len(motion)) + integers_and_reals(50)
    lines += [film(motion, 0.01), "/&  end"]
    return Sample(
        "CSMIP_V1",
        "\n".join(lines),
        ("CE.89146..HN1",),
        (GRAVITY / 10 * np.round(motion, 3),),
        0.01,
        (164,),
        (0,),
        "raw",
        **ETNA,
    )


def csmip_v2(motion: Samples) -> Sample:
    size = len(motion)
    lines = ["Corrected accelerogram   89146-L2500-12044.02       Chan  1: 118 Deg     from"]
    lines += csmip_header(1, "118 Deg", 0.01, "g", size)
    lines += ["Accelerogram bandpass filtered with 3 dB pts at   .30 and 40.00 cyc/sec"]
    lines += ["free text"] * 10
    # Interval, corners and peak among the real numbers
    lines += integers_and_reals(100, {60: 0.01, 61: 0.3, 65: -4.0, 72: 40.0})
    for kind, unit in (("accel", "cm/sec2"), ("veloc", "cm/sec"), ("displ", "cm")):
        points = f" {size} points of {kind} data equally spaced at  .010 sec"
        lines += [f"{points}, in {unit}. (8f10.6)", block(motion, "%10.6f", 8)]
    lines += ["/&  ----------  End of data for channel  1  ----------"]
    return Sample(
        "CSMIP_V2",
        "\n".join(lines),
        ("CE.89146..HN2",),
        (0.01 * motion,),
        0.01,
        (118,),
        (0,),
        "processed",
        **ETNA,
    )


def renadic(motion: Samples) -> Sample:
    """Coordinates that are unknown, and a clock that was not set."""
    header = csmip_header(1, "V", 0.01, "G/10", len(motion), agency="X")
    header[3:8] = [
        "                                   TRIGGER TIME: 1/1/1980 0:00:00.000 GMT",
        "STATION NO.          0.000N    0.000E  QDR       S/N  760 (3  CHNS OF 3  AT STA)",
        "ANGOL S/N 760",
        "CHAN  1: V        (STA CHN:  1)",
        "UNIVERSIDAD DE CHILE - RENADIC",
    ]
    lines = [*header, *integers_and_reals(50), film(motion, 0.01), "/&  END OF DATA"]
    values = GRAVITY / 10 * np.round(motion, 3)
    # A vertical sensor in g/10
    return Sample(
        "RENADIC", "\n".join(lines), (".ANGOL..HNZ",), (values,), 0.01, (None,), (-90,), "raw"
    )


def usc_header(samples: int) -> list[str]:
    """Return the thirteen lines that both volumes share."""
    return [
        "FILE     0 OF UNCORRECTED ACCELEROGRAM DATA OF VOLUME I:",
        "SOME EARTHQUAKE                                                         21",
        "JAN 17, 1994 -1230 GMT                                                  22",
        "IBB102  94.170.0 N                                                      18",
        "STATION USC# 0017   34 06 36N, 118 22 48W                               39",
        "8510 SOME AVE., LOS ANGELES, CA                                         37",
        "COMP S05W                                                               9",
        "SOME EARTHQUAKE   JAN 17, 1994 -1230 GMT                                46",
        "EPICENTER -   34 12 48N, 118 32 13W                                     35",
        "INSTR PERIOD =  .040 SEC  DAMPING =   .568  SENSITIVITY =   1.69CM/G    69",
        f"NO. OF POINTS = {samples:6d}      DURATION =   0.120 SEC                      50",
        "UNITS ARE SEC AND G/10                                                  22",
        "RMS ACCLN. OF COMPLETE RECORD =     .211 G/10                           45",
    ]


def usc_v1(motion: Samples) -> Sample:
    """Digitised film behind FORTRAN's blank for the line printer."""
    lines = usc_header(len(motion)) + integers_and_reals(50) + [film(motion, 0.01, " ")]
    return Sample(
        "USC",
        "\n".join(lines),
        (".0017..HN1",),
        (GRAVITY / 10 * np.round(motion, 3),),
        0.01,
        (185,),
        (0,),
        "raw",
        coordinates=(34.11, -118.38),
    )


def usc_v2(motion: Samples) -> Sample:
    lines = ["CORRECTED ACCELEROGRAM  IIBB127  94.610.0 COMP S05W   FILE   0  CORRESPONDING T"]
    lines += usc_header(len(motion))
    lines += ["ACCELEROGRAM IS BAND-PASS FILTERED BETWEEN  .225- .325 AND 25.00-27.00 HZ.", "", ""]
    lines += ["PEAK ACCELERATION =     4.00000  CMS/SEC/SEC AT    4.580   SEC."]
    lines += ["free text"] * 7 + integers_and_reals(100)
    # Acceleration, velocity and displacement
    for kind, unit in (("ACC", "CM/SEC/SEC"), ("VEL", "CM/SEC"), ("DIS", "CM")):
        points = f"  {len(motion)} POINTS OF {kind} DATA EQUALLY SPACED AT   .020 SEC."
        lines += [f"{points}  IN UNITS {unit}", block(motion, "%10.3f", 8)]
    return Sample(
        "USC",
        "\n".join(lines),
        (".0017..BN1",),
        (0.01 * motion,),
        0.02,
        (185,),
        (0,),
        "processed",
        coordinates=(34.11, -118.38),
    )
