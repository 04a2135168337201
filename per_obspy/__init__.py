"""
Find which neighbouring buildings hit each other in an earthquake, and how to prevent it.

Everything is SI: m, s, m/s², kg; damping as a fraction of critical; angles in degrees clockwise
from north. Each public name is imported when it is first used; ``__init__.pyi`` names its module.

Public names
------------
**Spectra**

azimuthal_per_spectrum
    Compute the pseudo energy radius spectrum along each of many horizontal azimuths.
bilinear_response
    Compute the response of a bilinear oscillator, exact between samples and at its events.
constant_yield_spectra
    Compute inelastic spectra of oscillators of given strength.
per_spectrum
    Compute the pseudo energy radius spectrum of one component of ground acceleration.
response_spectra
    Compute PER, SD, SV, SA, PSV and PSA spectra of one component of ground acceleration.
rotd
    Compute a percentile over azimuths, the last axis (RotD50: median, RotD100: largest).
station_spectra
    Compute the spectra of a station, with the processed motion they come from.
stream_spectra
    Compute the spectra of every station of a Stream.

**Gaps, impacts and correlation**

Structure
    Single-degree-of-freedom structure at its contact level, linear or bilinear.
absolute_gap
    Compute the gap by the absolute sum, an upper bound: both peaks at once, towards each other.
combined_dispersion
    Combine the dispersions of a radius from independent sources.
combined_dispersion_correlation
    Compute the correlation of the logarithms of two radii from independent sources.
critical_gap
    Compute the critical gap by double difference combination of two radii.
lognormal_dispersion
    Compute the dispersion of a lognormal length from its mean and standard deviation.
period_dispersion
    Compute the dispersion of a radius that an uncertain period causes.
post_impact_velocities
    Compute the velocities after a stereomechanical impact.
pounding_probability
    Compute the probability that the critical gap of equation (15) exceeds the gap.
single_hit
    Estimate the amplification of both structures of a pair by one impact at full energy.
srss_gap
    Compute the gap by the square root of the sum of squares: uncorrelated responses.
transfer_energies
    Compute the energy that leaves each structure in one impact.

**Correlation of two responses**

CloughPenzien
    Kanai-Tajimi ground motion whose low frequencies are filtered out.
KanaiTajimi
    White noise in the bedrock, felt on a soil layer that is one oscillator.
WhiteNoise
    Ground acceleration with the same power at all frequencies.
ddc_correlation
    Compute the correlation of two oscillators under white noise, exact for any damping.
ground_correlation
    Compute the correlation of two linear displacements under stationary ground motion.
psd_correlation
    Compute the correlation of two displacements under a tabulated ground motion spectrum.
record_correlation
    Compute the correlation of two displacements under a record and the free vibration after it.

**Exact histories**

hertz_damp_history
    Compute the history of two linear structures with a Hertz-damp contact.
kelvin_voigt_history
    Compute the history of two structures that hit each other through a spring and a dashpot.
linked_history
    Compute the history of two structures joined by an elastic, viscous or bilinear link.
pounding_histories
    Compute the maxima of the exact pounding histories of many pairs.
pounding_history
    Compute the exact history of structures that hit each other, with impacts (7), (8).
relative_displacement
    Compute the largest relative displacement of pairs in one component of ground motion.

**Prevention**

bumper_restitution
    Compute the restitution of a linear bumper, and check that its contact is short enough.
jankowski_damping
    Compute the damping of a Hertz contact that is damped while approaching only.
kelvin_voigt_damping
    Compute the damping of a Kelvin-Voigt contact (with tension) that has a restitution.
kelvin_voigt_restitution
    Compute the restitution of a contact by a spring and a parallel dashpot.
mahmoud_jankowski_damping
    Compute the damping of a linear viscoelastic contact that is damped while approaching only.
required_gap
    Find the least gap from which on the single hit amplifies no structure beyond a target.
required_restitution
    Compute the largest restitution for which no structure is amplified beyond a target.
supplemental_damping
    Find the least damping to add to a pair so that its critical gap fits into the gap.

**Yielding buildings**

davenport_peak_factor
    Compute the mean peak of a stationary Gaussian response over its standard deviation.
ductility_correlation
    Compute the correlation of two bilinear displacements at given ductilities.
equivalent_linear
    Compute period and damping of the linear structure equivalent to a bilinear one.
linearized_correlation
    Compute the correlation of two bilinear displacements under stationary ground motion.

**Processing of records**

process
    Process the records of a stream so that spectra can be computed from them.

**Records**

read_records
    Read strong-motion records of files and folders, ready for :func:`per_obspy.process`.

**Buildings and pairs**

asce7_period
    Compute the median period ``ratio * C h**x`` with the coefficients of ASCE 7.
ec8_period
    Compute the period ``C_t h**0.75`` of Eurocode 8; above 40 m that of :func:`asce7_period`.
equivalent_sdof
    Compute period, participation and generalised mass of the first mode at one floor.
pairs_from_footprints
    Find pairs of neighbouring buildings in footprints, with their gaps and axes.
read_pairs
    Read and check a table of building pairs.
shear_building
    Compute the natural periods and mode shapes of a shear building.

**Screening**

risk_table
    Compute ground motion, demand, state and severity of pairs: one row per pair, worst first.

**Whole runs**

run
    Do a whole run: records to spectra to risk table to figures.
screen
    Screen pairs by records: process, compute spectra, and return the risk table.

**Figures**

plot_pair
    Plot the largest energy circles of both buildings of a pair, as far apart as the buildings are.
plot_risk
    Plot the pairs of a risk table on a map, in the colours of their risk classes.
plot_spectra
    Plot the pseudo energy radius against the natural period.
"""

import lazy_loader

_public_name, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    """Return a public name, imported when it is first used, or the version."""
    if name == "__version__":
        from importlib.metadata import version

        return version("per_obspy")
    return _public_name(name)
