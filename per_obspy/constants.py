"""Physical constants, shared thresholds and defaults, each with its unit and source."""

from importlib.resources import files

#: Languages of the page, of summaries and of messages: one catalogue each.
LANGUAGES = tuple(
    sorted(
        file.name.removesuffix(".po")
        for file in (files("per_obspy") / "report" / "languages").iterdir()
        if file.name.endswith(".po")
    )
)

#: Standard acceleration of gravity, m/s2, by definition (CGPM 1901).
STANDARD_GRAVITY = 9.80665

#: Gal, m/s2, by definition.
GAL = 0.01

#: Mean radius of the Earth, m (IUGG, radius R1 of GRS 80).
EARTH_RADIUS = 6_371_008.8

#: Damping at which published spectra, and here the stations of a region, are compared, fraction of
#: critical.
REFERENCE_DAMPING = 0.05

#: Dates of clocks that were never set: ObsPy's default, and that of GPS receivers.
UNSET_DAYS = frozenset({(1970, 1, 1), (1980, 1, 1), (1980, 1, 6)})

#: Grid of stored spectra: dampings as fractions of critical; limits (s) and number of the periods,
#: which are logarithmically spaced; degrees between azimuths.
STORED_DAMPINGS = (0.02, 0.05, 0.10, 0.20)
SHORTEST_STORED_PERIOD, LONGEST_STORED_PERIOD, STORED_PERIODS = 0.05, 10.0, 100
STORED_AZIMUTH_STEP = 10

#: Arc of one degree on the mean Earth, m, to six digits.
METRES_PER_DEGREE = 111_195.0

#: Dip of the sensor axis, degrees from horizontal, from which a component is vertical.
VERTICAL_DIP = 45.0

#: Channel code of SEED: band, instrument of ground motion, direction.
SEED_CODE = r"[A-Z][GHLMN][A-Z0-9]"

#: Words of headers and channels for a vertical sensor -> its dip, degrees down from horizontal.
VERTICAL_DIPS = {
    **dict.fromkeys(
        ("UP", "UPDO", "U", "Z", "V", "VER", "VERT", "VERTICAL", "UD", "U-D", "VRT", "VRTC"), -90.0
    ),
    **dict.fromkeys(("DOWN", "DWN", "DN", "-UP", "D"), 90.0),
}

#: Words for the points of the compass -> degrees clockwise from north.
COMPASS_AZIMUTHS = {
    **dict.fromkeys(("N", "NS", "N-S", "SN", "NORTH"), 0.0),
    **dict.fromkeys(("E", "EW", "E-W", "WE", "EAST"), 90.0),
    **dict.fromkeys(("S", "SOUTH"), 180.0),
    **dict.fromkeys(("W", "WEST"), 270.0),
}

#: Words for horizontal sensors without an azimuth -> last letter of their channel code: along and
#: across a structure, from and around a source, normal and parallel to a fault (COSMOS, NGA).
HORIZONTAL_LETTERS = {
    **dict.fromkeys(("L", "LN", "LG", "LNG", "LON", "LONG", "LONGITUDINAL"), "L"),
    **dict.fromkeys(("T", "TR", "TRN", "TRA", "TRAN", "TRANS", "TRANSVERSE", "TRANSVERSAL"), "T"),
    **dict.fromkeys(("R", "RAD", "RADL", "RADIAL"), "R"),
    **dict.fromkeys(("H", "HOR", "HORIZ", "HORIZONTAL"), "H"),
    **dict.fromkeys(("1", "H1", "HOR1", "FN"), "1"),
    **dict.fromkeys(("2", "H2", "HOR2", "FP"), "2"),
    "X": "X",
    "Y": "Y",
}
