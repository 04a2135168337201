"""Physical constants, shared thresholds and defaults, each with its unit and source."""

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
