"""Made-up files of ``name: value`` headers: ITACA, DYNA, AFAD, NSMN, UNAM, CWB and PEER AT2."""

import numpy as np
from sample_file import GRAVITY, Sample, Samples, block, columns, three_columns


def itaca(motion: Samples) -> Sample:
    lines = [
        "Event Date & Time             : 2009-04-06 01:32:39",
        "Station Code / Name           : 2987 / L Aquila",
        "Network                       : DPC (Italian Civil Protection Authority)",
        "Orientation                   : WE",
        "Processing Info               : Acausal Butterworth bandpass filtering",
        "Filter Cut-off Frequency (Hz) : 0.100 - 50.000",
        "Time Increment (s)            : 0.005",
        f"Number of Data                : {len(motion)}",
        "PGA (m/s/s)                   : 4.0000000E+00",
        "Accelaration time series in m/s/s",
        block(motion, "%14.7E", 5),
    ]
    return Sample(
        "ITACA", "\n".join(lines), ("IT.2987..HNE",), (motion,), 0.005, (90,), (0,), "processed"
    )


def dyna_lines(event: str, time: str, motion: Samples) -> list[str]:
    """Return header and samples of DYNA."""
    return [
        f"EVENT_NAME: {event}",
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
        f"NDATA: {len(motion)}",
        "STREAM: HNE",
        "UNITS: cm/s^2",
        "INSTRUMENT: sensor = CMG_5TD [Unknown] | digitizer = Unknown [Unknown]",
        "PGA_CM/S^2: -4.0",
        "LOW_CUT_FREQUENCY_HZ: 0.100",
        "HIGH_CUT_FREQUENCY_HZ: 30.000",
        "HEADER_FORMAT: DYNA 1.2",
        "DATA_TYPE: ACCELERATION",
        "USER5: ",
        *(f"{value:.6f}" for value in motion),
    ]


def dyna(motion: Samples) -> Sample:
    return Sample(
        "DYNA",
        "\n".join(dyna_lines("GREECE", "20190728_160919.870", motion)),
        ("HI.ARS1..HNE",),
        (0.01 * motion,),
        0.005,
        (90,),
        (0,),
        "processed",
        start="2019-07-28T16:09:19.87",
        coordinates=(37.6349, 22.7293),
    )


def afad(motion: Samples) -> Sample:
    lines = [
        "AAD_Filtered_TADAS_FILE",
        "AAD_LOW_CUT_FREQUENCY_HZ: 0.025",
        "AAD_HIGH_CUT_FREQUENCY_HZ: 40.0",
    ]
    lines += dyna_lines("202302060117", "2023/02/06 01:17:36.5357130", motion)
    return Sample(
        "AFAD",
        "\n".join(lines),
        ("HI.ARS1..HNE",),
        (0.01 * motion,),
        0.005,
        (90,),
        (0,),
        "processed",
        start="2023-02-06T01:17:36.535713",
        coordinates=(37.6349, 22.7293),
    )


def nsmn(motion: Samples) -> Sample:
    rows = three_columns(motion)
    # Seventeen fields, a title with the directions, one row per sample
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
        f"NUMBER OF DATA          : {len(motion)}",
        "SAMPLING INTERVAL (sec) : 0.01",
        "RAW PGA VALUES (gal)    : (N-S) 4.0 (E-W) 4.0 (U-D) 2.0",
        "Copyright EARTHQUAKE DEPARTMENT",
        "DISASTER AND EMERGENCY MANAGEMENT PRESIDENCY",
        "       N-S          E-W          U-D",
        *columns(rows, "%13.6f"),
    ]
    return Sample(
        "NSMN",
        "\n".join(lines),
        ("TK.0921..HNN", "TK.0921..HNE", "TK.0921..HNZ"),
        tuple(0.01 * rows.T),
        0.01,
        (0, 90, None),
        (0, 0, -90),
        "raw",
        start="2017-07-20T22:30:58",
        coordinates=(37.8747, 27.59223),
    )


def unam_fields(samples: int) -> list[tuple[str, str]]:
    """Return the fields of UNAM's header; the record begins after midnight of the event's day."""
    # A field without a name continues the one before it
    return [
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
        ("NUM. TOTAL DE MUESTRAS, C1-C6", f"/{samples}/{samples}/{samples}"),
        ("ACEL. MAX. (Gal), C1-C6", "/4.0/-4.0/2.0"),
        ("UNIDADES DE LOS DATOS", "Gal (cm/s/s)"),
    ]


def unam(motion: Samples) -> Sample:
    rows = three_columns(motion)
    lines = ["*" * 80, "             INSTITUTO DE INGENIERIA", "ARCHIVO ESTANDAR DE ACELERACION:"]
    lines += [f"{name:39}: {value}" for name, value in unam_fields(len(motion))]
    lines += ["DATOS DE ACELERACION:", "---------+" * 8]
    lines += ["   CANAL-1   CANAL-2   CANAL-3", "---------+" * 8]
    lines += columns(rows, "%10.4f")
    # The vertical comes first
    return Sample(
        "UNAM",
        "\n".join(lines),
        (".ACAC..CNZ", ".ACAC..CNN", ".ACAC..CNE"),
        tuple(0.01 * rows.T),
        0.004,
        (None, 0, 90),
        (-90, 0, 0),
        "raw",
        start="2004-01-01T00:00:01.5",
        coordinates=(16.84851, -99.85157),
    )


def cwb(motion: Samples) -> Sample:
    samples = three_columns(motion)
    times = 0.01 * np.arange(len(motion))
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
        f"#RecordLength(sec): {0.01 * len(motion):.2f}",
        "#SampleRate(Hz): 100",
        "#AmplitudeUnit:  gal. DCoffset(corr)",
        "#AmplitudeMAX. U:    4.000~   -3.750",
        "#DataSequence: Time U(+); N(+); E(+)",
        "#Data: 4F10.3",
        *columns(np.column_stack((times, samples)), "%10.4f"),
    ]
    # The clock of Taiwan is eight hours ahead of UTC
    return Sample(
        "CWB",
        "\n".join(lines),
        ("TW.TTN..HNZ", "TW.TTN..HNN", "TW.TTN..HNE"),
        tuple(0.01 * samples.T),
        0.01,
        (None, 0, 90),
        (-90, 0, 0),
        "raw",
        start="2021-04-17T23:11:30",
        coordinates=(22.752, 121.155),
    )


def peer_at2(motion: Samples) -> Sample:
    lines = [
        "PEER NGA STRONG MOTION DATABASE RECORD",
        "Kern County, 7/21/1952, Some School, 21",
        "ACCELERATION TIME SERIES IN UNITS OF G",
        f"NPTS= {len(motion):6d}, DT=   .0100 SEC,",
        block(motion, "%15.7E", 5),
    ]
    return Sample(
        "PEER_AT2",
        "\n".join(lines),
        (".SOMESCHOOL..HN1",),
        (GRAVITY * motion,),
        0.01,
        (21,),
        (0,),
        "processed",
        start="1952-07-21",
    )
