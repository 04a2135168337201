"""
One small file of every format, written from the layout of the format with invented stations and values.

``MOTIONS`` are in the unit of the file, so that a reader's factor shows.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

MOTION = np.array([0.5, -1.25, 2.0, -3.75, 4.0, 0.0, 1.5, -0.25, 0.75, -2.5, 3.25, -1.0, 0.125])
MOTION = np.concatenate((MOTION, MOTION[:10] / 2))
GRAVITY = 9.80665  # m/s2, by definition


class Sample(NamedTuple):
    """A file and what it says."""

    name: str
    text: str
    ids: tuple[str, ...]
    values: tuple[NDArray[np.float64], ...]  # in SI or counts
    dt: float
    azimuths: tuple[float | None, ...]
    dips: tuple[float | None, ...]
    level: str
    units: str = "m/s2"
    start: str | None = None
    coordinates: tuple[float, float] | None = None


def block(values: NDArray[np.float64] | list[float], layout: str, per_line: int) -> str:
    """Write numbers as FORTRAN does."""
    fields = [layout % value for value in values]
    return "\n".join(
        "".join(fields[first : first + per_line]) for first in range(0, len(fields), per_line)
    )


def pairs(values: NDArray[np.float64], dt: float, indent: str = "") -> str:
    times = np.arange(len(values)) * dt
    lines = block(np.column_stack((times, values)).ravel(), "%7.3f", 10).split("\n")
    return "\n".join(indent + line for line in lines)


def csmip_header(
    channel: int, direction: str, dt: float, unit: str, agency: str = "CGS"
) -> list[str]:
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
        f"No. of Points =  {len(MOTION)}  Record Length = 1.0 sec   at {1 / dt:.0f} Samples/sec",
        f"Units of uncor data are sec and {unit} .        Max  =   .4 g , at  30.590 sec.",
        "RMS calc for complete record =        .   Chn. metadata effective date: 08/10/05",
    ]


def numbers(reals: int, **given: float) -> list[str]:
    values = [0.0] * reals
    for name, value in given.items():
        values[int(name[1:])] = value
    return [block([0] * 100, "%5d", 16), block(values, "%10.4f", 8)]


def csmip_v1() -> Sample:
    channels = []
    for channel, direction in enumerate(("360 Deg", "Up", "90 Deg"), start=1):
        title = f" {len(MOTION)} Accelerogram points at 200 pts/sec in units of g .      Format: (8f9.6)"
        channels += csmip_header(channel, direction, 0.005, "g") + numbers(50, r6=4.0 / channel)
        channels += [
            title,
            block(MOTION / channel, "%9.6f", 8),
            f"/&  -----  End of Data for Channel {channel}",
        ]
    values = tuple(GRAVITY * np.round(MOTION / channel, 6) for channel in (1, 2, 3))
    ids = ("CE.89146..HNN", "CE.89146..HNZ", "CE.89146..HNE")
    return Sample("CSMIP_V1", "\n".join(channels) + "\n", ids, values, 0.005, (0, None, 90), (0, -90, 0), "raw",
                  start="2012-02-13T21:06:45", coordinates=(40.941, -123.633))  # fmt: skip


def csmip_raw() -> Sample:
    """Digitised film: times and values in turn."""
    channel = (
        csmip_header(1, "S 16 E", 0.01, "G/10") + numbers(50) + [pairs(MOTION, 0.01), "/&  end"]
    )
    return Sample("CSMIP_V1", "\n".join(channel), ("CE.89146..HN1",), (GRAVITY / 10 * np.round(MOTION, 3),), 0.01,
                  (164,), (0,), "raw", start="2012-02-13T21:06:45", coordinates=(40.941, -123.633))  # fmt: skip


def csmip_v2() -> Sample:
    lines = ["Corrected accelerogram   89146-L2500-12044.02       Chan  1: 118 Deg     from"]
    lines += csmip_header(1, "118 Deg", 0.01, "g")
    lines += ["Accelerogram bandpass filtered with 3 dB pts at   .30 and 40.00 cyc/sec"] + [
        "free text"
    ] * 10
    lines += numbers(100, r60=0.01, r61=0.3, r65=-4.0, r72=40.0)
    for kind, unit in (("accel", "cm/sec2"), ("veloc", "cm/sec"), ("displ", "cm")):
        lines += [
            f" {len(MOTION)} points of {kind} data equally spaced at  .010 sec, in {unit}. (8f10.6)"
        ]
        lines += [block(MOTION, "%10.6f", 8)]
    text = "\n".join([*lines, "/&  ----------  End of data for channel  1  ----------"])
    return Sample("CSMIP_V2", text, ("CE.89146..HN2",), (0.01 * MOTION,), 0.01, (118,), (0,), "processed",
                  start="2012-02-13T21:06:45", coordinates=(40.941, -123.633))  # fmt: skip


def renadic() -> Sample:
    lines = csmip_header(1, "V        (STA CHN:  1)", 0.01, "G/10", agency="X")
    lines[3] = "                                   TRIGGER TIME: 1/1/1980 0:00:00.000 GMT"
    lines[4] = "STATION NO.          0.000N    0.000E  QDR       S/N  760 (3  CHNS OF 3  AT STA)"
    lines[5] = "ANGOL S/N 760"
    lines[6] = "CHAN  1: V        (STA CHN:  1)"
    lines[7] = "UNIVERSIDAD DE CHILE - RENADIC"
    text = "\n".join([*lines, *numbers(50), pairs(MOTION, 0.01), "/&  END OF DATA"])
    return Sample(
        "RENADIC",
        text,
        (".ANGOL..HNZ",),
        (GRAVITY / 10 * np.round(MOTION, 3),),
        0.01,
        (None,),
        (-90,),
        "raw",
    )


def usc(volume: int) -> Sample:
    lines = [
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
        f"NO. OF POINTS = {len(MOTION):6d}      DURATION =   0.120 SEC                      50",
        "UNITS ARE SEC AND G/10                                                  22",
        "RMS ACCLN. OF COMPLETE RECORD =     .211 G/10                           45",
    ]
    place = (34.11, -118.38)
    if volume == 1:
        text = "\n".join(lines + numbers(50) + [pairs(MOTION, 0.01, " ")])
        values = GRAVITY / 10 * np.round(MOTION, 3)
        return Sample(
            "USC", text, (".0017..HN1",), (values,), 0.01, (185,), (0,), "raw", coordinates=place
        )
    lines = [
        "CORRECTED ACCELEROGRAM  IIBB127  94.610.0 COMP S05W   FILE   0  CORRESPONDING T",
        *lines,
    ]
    lines += ["ACCELEROGRAM IS BAND-PASS FILTERED BETWEEN  .225- .325 AND 25.00-27.00 HZ.", "", ""]
    lines += ["PEAK ACCELERATION =     4.00000  CMS/SEC/SEC AT    4.580   SEC."] + ["free text"] * 7
    lines += numbers(100)
    for kind, unit in (("ACC", "CM/SEC/SEC"), ("VEL", "CM/SEC"), ("DIS", "CM")):
        lines += [
            f"  {len(MOTION)} POINTS OF {kind} DATA EQUALLY SPACED AT   .020 SEC.  IN UNITS {unit}"
        ]
        lines += [block(MOTION, "%10.3f", 8)]
    values = 0.01 * MOTION
    return Sample(
        "USC",
        "\n".join(lines),
        (".0017..BN1",),
        (values,),
        0.02,
        (185,),
        (0,),
        "processed",
        coordinates=place,
    )


def geonet(corrected: bool) -> Sample:
    text = []
    size = len(MOTION)
    for direction in ("N10E", "N80W", "Up"):
        integers = [0] * 40
        integers[8:10], integers[18:20], integers[38:40] = [2016, 11], [13, 11], [2, 20500]
        integers[30], integers[33] = size, size
        reals = [0.0] * 60
        reals[24], reals[25] = 0.005, 0.005
        if corrected:
            integers[34], integers[35] = size, size
        unit = "Instrument corrected data at 0.005 sec intervals"
        text += [
            f"{'Corrected' if corrected else 'Uncorrected'} accelerogram 20161113_110256_HSES_20 GNS Science",
            "Site HSES      42 31 12S  172 49 48E     Basalt file:  20161113_110300_HSES",
            "Some Emergency Centre",
            "Instrument Basalt_2430",
            "Resolution: 24-bit   Instr Period: 0.0050 s   Damping: 0.700",
            "Accelerogram 20161113_110256_HSES_20                 Processed 2016 December 09",
            "5 km south-west of somewhere",
            "2016 November 13         11:02:56 UT",
            "Epicentre  42 41 33S 173 01 19E  Bearing S40E  Dist   25km  Depth   15km Mw 7.82",
            f"Number of points  {size}    Duration 0.06 s",
            unit if corrected else "Raw readings in units of 1.00 mm/s/s  at intervals of 0.005 s",
            "Band-pass filter transition bands are .10-.25 Hz and 24.50-25.50 Hz"
            if corrected
            else "Data is unfiltered",
            f"Component {direction}",
            "Acceleration:  Peak      4.0 mm/s/s at  48.13 s     RMS   209.89 mm/s/s",
            "Velocity",
            "Displacement",
            block(integers, "%8d", 10),
            block(reals, "%8.4f", 10),
            *([block(MOTION, "%8.3f", 10)] * (3 if corrected else 1)),
        ]
    ids = ("NZ.HSES.20.HN1", "NZ.HSES.20.HN2", "NZ.HSES.20.HNZ")
    level = "processed" if corrected else "raw"
    return Sample("GEONET", "\n".join(text), ids, (0.001 * MOTION,) * 3, 0.005, (10, 280, None), (0, 0, -90), level,
                  start="2016-11-13T11:02:20.5", coordinates=(-42.52, 172.83))  # fmt: skip


def itaca() -> Sample:
    lines = [
        "Event Date & Time             : 2009-04-06 01:32:39",
        "Station Code / Name           : 2987 / L Aquila",
        "Network                       : DPC (Italian Civil Protection Authority)",
        "Orientation                   : WE",
        "Processing Info               : Acausal Butterworth bandpass filtering",
        "Filter Cut-off Frequency (Hz) : 0.100 - 50.000",
        "Time Increment (s)            : 0.005",
        f"Number of Data                : {len(MOTION)}",
        "PGA (m/s/s)                   : 4.0000000E+00",
        "Accelaration time series in m/s/s",
        block(MOTION, "%14.7E", 5),
    ]
    return Sample(
        "ITACA", "\n".join(lines), ("IT.2987..HNE",), (MOTION,), 0.005, (90,), (0,), "processed"
    )


def dyna_lines(first: str, time: str) -> list[str]:
    return [
        f"EVENT_NAME: {first}",
        "EVENT_ID: X-1",
        "EVENT_DATE_YYYYMMDD: 20190728",
        "EVENT_TIME_HHMMSS: 160908",
        "EVENT_LATITUDE_DEGREE: 38.1000",
        "EVENT_LONGITUDE_DEGREE: 23.5400",
        "EVENT_DEPTH_KM: 9.0",
        "MAGNITUDE_W: ",
        "MAGNITUDE_L: 4.6",
        "NETWORK: HI",
        "STATION_CODE: ARS1",
        "STATION_NAME: Town Hall",
        "STATION_LATITUDE_DEGREE: 37.6349",
        "STATION_LONGITUDE_DEGREE: 22.7293",
        "STATION_ELEVATION_M: 34",
        "LOCATION: ",
        f"DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS: {time}",
        "SAMPLING_INTERVAL_S: 0.005000",
        f"NDATA: {len(MOTION)}",
        "STREAM: HNE",
        "UNITS: cm/s^2",
        "INSTRUMENT: sensor = CMG_5TD [Unknown] | digitizer = Unknown [Unknown]",
        "PGA_CM/S^2: -4.0",
        "LOW_CUT_FREQUENCY_HZ: 0.100",
        "HIGH_CUT_FREQUENCY_HZ: 30.000",
        "HEADER_FORMAT: DYNA 1.2",
        "DATA_TYPE: ACCELERATION",
        "USER5: ",
        *(f"{value:.6f}" for value in MOTION),
    ]


def dyna() -> Sample:
    text = "\n".join(dyna_lines("GREECE", "20190728_160919.870"))
    return Sample("DYNA", text, ("HI.ARS1..HNE",), (0.01 * MOTION,), 0.005, (90,), (0,), "processed",
                  start="2019-07-28T16:09:19.87", coordinates=(37.6349, 22.7293))  # fmt: skip


def afad() -> Sample:
    lines = [
        "AAD_Filtered_TADAS_FILE",
        "AAD_LOW_CUT_FREQUENCY_HZ: 0.025",
        "AAD_HIGH_CUT_FREQUENCY_HZ: 40.0",
    ]
    text = "\n".join(lines + dyna_lines("202302060117", "2023/02/06 01:17:36.5357130"))
    return Sample("AFAD", text, ("HI.ARS1..HNE",), (0.01 * MOTION,), 0.005, (90,), (0,), "processed",
                  start="2023-02-06T01:17:36.535713", coordinates=(37.6349, 22.7293))  # fmt: skip


def nsmn() -> Sample:
    rows = np.column_stack((MOTION, -MOTION, MOTION / 2))
    lines = [
        "STRONG GROUND MOTION RECORDS OF TURKIYE",
        "PLACE                   : SOME HOSPITAL",
        "EARTHQUAKE DATE         : 2017/07/20 22:31:09 (GMT)",
        "EPICENTER COORDINATES   : 36.91980N-27.44350E",
        "EARTHQUAKE DEPTH (km)   : 19.44",
        "EARTHQUAKE MAGNITUDE    : 6.5 Mw",
        "STATION ID              : 0921",
        "STATION COORDINATES     : 37.87470N-27.59223E",
        "STATION ALTITUDE (m)    : 66",
        "RECORDER TYPE           : Sara acebox",
        "RECORDER SERIAL NO      : 1856",
        "RECORD TIME             : 20/07/2017 22:30:58.000000 (GMT)",
        f"NUMBER OF DATA          : {len(MOTION)}",
        "SAMPLING INTERVAL (sec) : 0.01",
        "RAW PGA VALUES (gal)    : (N-S) 4.0 (E-W) 4.0 (U-D) 2.0",
        "Copyright EARTHQUAKE DEPARTMENT",
        "DISASTER AND EMERGENCY MANAGEMENT PRESIDENCY",
        "       N-S          E-W          U-D",
        *("".join(f"{value:13.6f}" for value in row) for row in rows),
    ]
    ids = ("TK.0921..HNN", "TK.0921..HNE", "TK.0921..HNZ")
    return Sample("NSMN", "\n".join(lines), ids, tuple(0.01 * rows.T), 0.01, (0, 90, None), (0, 0, -90), "raw",
                  start="2017-07-20T22:30:58", coordinates=(37.8747, 27.59223))  # fmt: skip


def unam() -> Sample:
    rows = np.column_stack((MOTION, -MOTION, MOTION / 2))
    size = len(MOTION)
    fields = [
        ("VERSION DEL FORMATO", "2.0"),
        ("NOMBRE DE LA ESTACION", "SOME TOWN"),
        ("CLAVE DE LA ESTACION", "ACAC"),
        ("COORDENADAS DE LA ESTACION", "16.84851 LAT. N"),
        ("", "99.85157 LONG. O"),
        ("ALTITUD (msnm)", "13"),
        ("MODELO DEL ACELEROGRAFO", "130-SMA"),
        ("NUMERO DE CANALES", "3"),
        ("ORIENTACION C1-C6 (rumbo;orientacion)", "/V;+/N00E/N90E"),
        ("INTERVALO DE MUESTREO, C1-C6, (s)", "/0.004/0.004/0.004"),
        ("FECHA DEL SISMO [GMT]", "2003/12/31"),
        ("HORA EPICENTRO (GMT)", "23:58:02.7"),
        ("MAGNITUD(ES)", "/Mb=5.3/Mw=5.8"),
        ("COORDENADAS DEL EPICENTRO", "18.3353 LAT. N"),
        ("", "98.6763 LONG. W"),
        ("PROFUNDIDAD FOCAL (Km)", "38.5"),
        ("HORA DE LA PRIMERA MUESTRA (GMT)", "00:00:01.5"),
        ("NUM. TOTAL DE MUESTRAS, C1-C6", f"/{size}/{size}/{size}"),
        ("ACEL. MAX. (Gal), C1-C6", "/4.0/-4.0/2.0"),
        ("UNIDADES DE LOS DATOS", "Gal (cm/s/s)"),
    ]
    lines = ["*" * 80, "             INSTITUTO DE INGENIERIA", "ARCHIVO ESTANDAR DE ACELERACION:"]
    lines += [f"{name:39}: {value}" for name, value in fields]
    lines += [
        "DATOS DE ACELERACION:",
        "---------+" * 8,
        "   CANAL-1   CANAL-2   CANAL-3",
        "---------+" * 8,
    ]
    lines += ["".join(f"{value:10.4f}" for value in row) for row in rows]
    ids = (".ACAC..CNZ", ".ACAC..CNN", ".ACAC..CNE")
    return Sample("UNAM", "\n".join(lines), ids, tuple(0.01 * rows.T), 0.004, (None, 0, 90), (-90, 0, 0), "raw",
                  start="2004-01-01T00:00:01.5", coordinates=(16.84851, -99.85157))  # fmt: skip


def cwb() -> Sample:
    rows = np.column_stack((0.01 * np.arange(len(MOTION)), MOTION, -MOTION, MOTION / 2))
    lines = [
        "#Earthquake Information",
        "#Origin Time(GMT+08): 2021/04/18-22:11:39",
        "#EpicenterLongitude(E): 121.49",
        "#EpicenterLatitude(N): 23.87",
        "#Depth(km): 15.0",
        "#Magnitude(Ml): 5.8",
        "",
        "#Station Information",
        "#StationCode: TTN",
        "#StationName: Some City",
        "#StationLongitude(E): 121.155",
        "#StationLatitude(N): 22.752",
        "#InstrumentKind: FBA",
        "#StartTime(GMT+08): 2021/04/18-07:11:30.000",
        f"#RecordLength(sec): {0.01 * len(MOTION):.2f}",
        "#SampleRate(Hz): 100",
        "#AmplitudeUnit:  gal. DCoffset(corr)",
        "#AmplitudeMAX. U:    4.000~   -3.750",
        "#DataSequence: Time U(+); N(+); E(+)",
        "#Data: 4F10.3",
        *("".join(f"{value:10.4f}" for value in row) for row in rows),
    ]
    ids = ("TW.TTN..HNZ", "TW.TTN..HNN", "TW.TTN..HNE")
    return Sample("CWB", "\n".join(lines), ids, tuple(0.01 * rows.T[1:]), 0.01, (None, 0, 90), (-90, 0, 0), "raw",
                  start="2021-04-17T23:11:30", coordinates=(22.752, 121.155))  # fmt: skip


def smc() -> Sample:
    integers = [-32768] * 48
    integers[1:6], integers[12:14] = [1989, 291, 0, 4, 30], [90, 360]
    integers[15], integers[16], integers[29] = 1, len(MOTION), 1675
    reals = [0.17e39] * 50
    reals[1], reals[10:12], reals[29], reals[31], reals[32] = (
        200.0,
        [37.728, -122.385],
        4.0,
        -3.75,
        0.1,
    )
    motion = "".join(
        f"{value:11.4E}"[:8] + f"{value:11.4E}"[8] + f"{value:11.4E}"[-1] for value in MOTION
    )
    lines = [
        "2 CORRECTED ACCELEROGRAM",
        "*",
        "SAF0A",
        "     1989  10  18    0004 Some Event",
        "Moment Mag=      7.1",
    ]
    lines += [
        "station = San Francisco, Some Street component=    360",
        "epicentral dist =     89.0",
    ]
    lines += ["inst type=SMA-1      data source = USGS", "*", "*", "*"]
    lines += [block(integers, "%10d", 8), block(reals, "%15.7E", 5), "|comment"]
    lines += ["\n".join(motion[first : first + 80] for first in range(0, len(motion), 80))]
    return Sample("SMC", "\n".join(lines), ("NP.1675..HNN",), (0.01 * MOTION,), 0.005, (0,), (0,), "processed",
                  start="1989-10-18T00:04:30", coordinates=(37.728, -122.385))  # fmt: skip


def bhrc() -> Sample:
    lines = []
    for component in ("L1", "V2", "T3"):
        lines += [
            "* VOL1DS FILE:  5520/01",
            "Inst Type = SSA-2",
            "Origin Time : 2012/08/11   12:23:16",
            "",
            component[0],
            "",
            f"COMP {component}",
            "Some Town                 Station   38.474 N 47.059 E   Altitude 1360m   Azimuth L 352   T 82",
            "Epicenter 38.520 N 46.860 E   FD 12 Km mb      Ms      Mw6.1   M        ML   (BHRC   )",
            "INSTR PERIOD =  .019 SEC   DAMPING =  .640",
            f"NO. OF POINTS =  {len(MOTION)}      DURATION =   {0.005 * len(MOTION):.3f}",
            "UNITS ARE SECONDS AND G/10",
            "",
            *["    0" * 14] * 7,
            "  .188324E-01  .640000E+00  .780800E+02  .000000E+00  .100000E+00  .00",
            "  .200000E+03  .000000E+00  .000000E+00  .000000E+00  .000000E+00  .00",
            *["  .000000E+00" * 5] * 5,
            block(MOTION, "%13.6E", 10),
            "/&",
        ]
    ids = (".SOMETOWN..HN1", ".SOMETOWN..HNZ", ".SOMETOWN..HN2")
    values = (GRAVITY / 10 * MOTION,) * 3
    return Sample("BHRC", "\n".join(lines), ids, values, 0.005, (352, None, 82), (0, -90, 0), "raw",
                  coordinates=(38.474, 47.059))  # fmt: skip


def cosmos(counts: bool) -> Sample:
    integers = [-999] * 100
    integers[39:46] = [2014, 236, 8, 24, 10, 20, 5]
    reals = [-999.0] * 100
    reals[0:3], reals[29], reals[33] = [37.86322, -122.276932, 29.0], 21.5, 0.02
    reals[61], reals[63] = 5.0, -3750.0 if counts else -3.75
    reals[21], reals[39:42], reals[46] = 2.0, [100.0, 0.7, 4.0], 1.0
    text = []
    for direction, code in (("90 Deg", "HNE"), ("Up", "HNZ")):
        size = len(MOTION)
        text += [
            "Raw acceleration counts   (Format v01.20 with 13 text lines)" if counts else
            "Corrected acceleration    (Format v01.20 with 13 text lines) Src: some.txt",
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
            "No filtering!" if counts else "Record filtered below  0.03 Hz (periods over 33 secs), and above 20.0 Hz",
            "Values used when parameter of data value is unknown/unspecified:  -999, -999.000",
            " 100 Integer-header values follow on  10 lines, Format = (10I8)",
            block(integers, "%8d", 10),
            " 100 Real-header values follow on  20 lines, Format =(5F15.6)",
            block(reals, "%15.6f", 5),
            "   1 Comment line(s) follow, each starting with a |",
            f"|<SCNL>C031.{code}.NC.01    <AUTH> 2015/03/01 16:46:25.000",
        ]  # fmt: skip
        if counts:
            text += [f"   {size} raw accel.   pts, approx  0 secs, units=counts (50),Format=(10I8)"]
            text += [block(1000 * MOTION, "%8d", 10)]
        else:
            text += [
                f"   {size} acceleration pts, approx   0 secs, units=cm/sec2(04),Format=(8F10.5)"
            ]
            text += [block(MOTION, "%10.5f", 8)]
        text += [f"End-of-data for C031.{code}.NC.01 acceleration"]
    values = (1000 * MOTION if counts else 0.01 * MOTION,) * 2
    return Sample("COSMOS", "\n".join(text), ("NC.C031.01.HNE", "NC.C031.01.HNZ"), values, 0.005, (90, None), (0, -90),
                  "raw" if counts else "processed", "counts" if counts else "m/s2",
                  start="2014-08-24T10:20:21.5", coordinates=(37.86322, -122.276932))  # fmt: skip


def peer_at2() -> Sample:
    lines = [
        "PEER NGA STRONG MOTION DATABASE RECORD",
        "Kern County, 7/21/1952, Some School, 21",
        "ACCELERATION TIME SERIES IN UNITS OF G",
        f"NPTS= {len(MOTION):6d}, DT=   .0100 SEC,",
        block(MOTION, "%15.7E", 5),
    ]
    values = (GRAVITY * MOTION,)
    return Sample("PEER_AT2", "\n".join(lines), (".SOMESCHOOL..HN1",), values, 0.01, (21,), (0,), "processed",
                  start="1952-07-21")  # fmt: skip


SAMPLES = {
    "peer_at2": peer_at2(),
    "csmip_v1": csmip_v1(),
    "csmip_raw": csmip_raw(),
    "csmip_v2": csmip_v2(),
    "renadic": renadic(),
    "usc_v1": usc(1),
    "usc_v2": usc(2),
    "geonet_v1a": geonet(corrected=False),
    "geonet_v2a": geonet(corrected=True),
    "itaca": itaca(),
    "dyna": dyna(),
    "afad": afad(),
    "nsmn": nsmn(),
    "unam": unam(),
    "cwb": cwb(),
    "smc": smc(),
    "bhrc": bhrc(),
    "cosmos_v0c": cosmos(counts=True),
    "cosmos_v2c": cosmos(counts=False),
}
