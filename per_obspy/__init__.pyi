# One line a module; ``__init__.py`` reads this file to know where each public name lives.
from .pounding.correlation import ddc_correlation as ddc_correlation
from .pounding.gap import absolute_gap as absolute_gap, critical_gap as critical_gap, srss_gap as srss_gap
from .pounding.impact import post_impact_velocities as post_impact_velocities, transfer_energies as transfer_energies
from .pounding.structure import Structure as Structure
from .processing.chain import process as process
from .inventory.footprints import pairs_from_footprints as pairs_from_footprints
from .inventory.periods import asce7_period as asce7_period, ec8_period as ec8_period
from .inventory.reading import read_pairs as read_pairs
from .inventory.shear_building import equivalent_sdof as equivalent_sdof, shear_building as shear_building
from .pounding.single_hit import single_hit as single_hit
from .spectra.elastic import per_spectrum as per_spectrum, response_spectra as response_spectra
from .spectra.station import station_spectra as station_spectra
from .screening.risk import risk_table as risk_table
from .spectra.azimuthal import azimuthal_per_spectrum as azimuthal_per_spectrum, rotd as rotd
from .pounding.relative import relative_displacement as relative_displacement
from .pounding.equivalent_linear import equivalent_linear as equivalent_linear
from .pounding.ground import CloughPenzien as CloughPenzien, KanaiTajimi as KanaiTajimi, WhiteNoise as WhiteNoise
from .pounding.linearization import linearized_correlation as linearized_correlation
from .pounding.psd_correlation import psd_correlation as psd_correlation
from .pounding.record_correlation import record_correlation as record_correlation
from .spectra.bilinear import bilinear_response as bilinear_response
from .pounding.probability import pounding_probability as pounding_probability
from .pounding.restitution import bumper_restitution as bumper_restitution, kelvin_voigt_damping as kelvin_voigt_damping, kelvin_voigt_restitution as kelvin_voigt_restitution, required_restitution as required_restitution
from .pounding.supplemental_damping import supplemental_damping as supplemental_damping
