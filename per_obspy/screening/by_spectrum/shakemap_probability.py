"""
How likely a pair pounds under a ShakeMap, given what is not known of the motion, of its buildings and of the estimate.

As with records: a derived period is resampled and so is its damping, both buildings independently,
at the same quasi-random nodes; where both periods are given the exact integral is used. The motion
of the map is uncertain as well, once for both buildings, with the correlation of their periods.
"""

import numpy as np
import pandas as pd

from per_obspy.checks import FloatArray
from per_obspy.kernels.pairs.resampling import resampled_probabilities
from per_obspy.pounding.correlation.white_noise import ddc_correlation
from per_obspy.pounding.dispersion import combined_dispersion, combined_dispersion_correlation
from per_obspy.pounding.probability import pounding_probability
from per_obspy.screening.by_record.stored_spectra import log_place
from per_obspy.screening.by_spectrum.demand import Both, SpectralDemand
from per_obspy.screening.by_spectrum.design_probability import MODEL_DISPERSION, MODEL_MEDIAN
from per_obspy.screening.by_spectrum.shakemap_motion import MapMotion, at_period, damping_factor
from per_obspy.screening.uncertainty.pair_motion import pair_motion, period_correlation
from per_obspy.screening.uncertainty.probability import NODES, gap_dispersion, median_gap
from per_obspy.screening.values import both, values

#: Dampings between which the factor of EN 1998-1 is interpolated when dampings are resampled;
#: beyond it is kept.
DAMPINGS = np.geomspace(0.002, 0.4, 24)


def shakemap_probability(
    motion: MapMotion, pairs: pd.DataFrame, asked: SpectralDemand
) -> FloatArray:
    """
    Return the probability of pounding of every pair.

    Parameters
    ----------
    motion : MapMotion
        At the pairs. Beyond its periods, which only resampled ones reach, SD at the end is kept.
    pairs : DataFrame
        Completed pairs with their log-standard deviations, medians inside the map's periods.
    asked : SpectralDemand
        Radii at contact height and their correlation.

    Returns
    -------
    probability : (n_pairs,) ndarray
        From 0 to 1.
    """
    first, second = (radius / MODEL_MEDIAN for radius in asked.radii)
    periods = both(pairs, "period")
    unknown = tuple(at_period(motion.periods, motion.log_std, period) for period in periods)
    uncertain = (np.stack(both(pairs, "period_log_std")) > 0).any(axis=0)
    probability = np.empty(len(pairs))
    for rows, chance in ((~uncertain, _of_radii), (uncertain, _resampled)):
        some = MapMotion(motion.periods, motion.ln_sd[rows], motion.log_std[rows])
        doubt = unknown[0][rows], unknown[1][rows]
        if rows.any():
            probability[rows] = chance(
                some, pairs.iloc[np.flatnonzero(rows)], (first[rows], second[rows]), doubt
            )
    return probability


def _of_radii(motion: MapMotion, pairs: pd.DataFrame, radii: Both, unknown: Both) -> FloatArray:
    """Return the exact integral over both radii."""
    del motion
    period_1, period_2 = both(pairs, "period")
    source_1, source_2 = (
        np.stack([doubt, _damping_dispersion(pairs, i)], axis=-1)
        for i, doubt in enumerate(unknown, start=1)
    )
    shared = np.stack([period_correlation(period_1, period_2), np.zeros(len(pairs))], axis=-1)
    return pounding_probability(
        *radii,
        ddc_correlation(period_1, values(pairs, "damping_1"), period_2, values(pairs, "damping_2")),
        median_gap(pairs),
        combined_dispersion(source_1),
        combined_dispersion(source_2),
        dispersion_correlation=combined_dispersion_correlation(source_1, source_2, shared),
        model_dispersion=MODEL_DISPERSION,
        gap_dispersion=gap_dispersion(pairs),
    )


def _resampled(motion: MapMotion, pairs: pd.DataFrame, radii: Both, unknown: Both) -> FloatArray:
    """Return the mean over quasi-random periods and dampings of both buildings; each pair has its own spectrum."""
    nothing = np.zeros(len(pairs))
    _, doubt = pair_motion(radii, (nothing, nothing), unknown, both(pairs, "period"))
    columns: list[FloatArray] = [np.arange(len(pairs), dtype=np.float64)]
    for i, radius in enumerate(radii, start=1):
        columns += [
            *log_place(pairs, i),
            values(pairs, f"period_log_std_{i}"),
            values(pairs, f"damping_log_std_{i}"),
            np.log(radius),
        ]
    columns += [
        median_gap(pairs),
        np.hypot(np.hypot(MODEL_DISPERSION, gap_dispersion(pairs)), doubt),
    ]
    spectra = motion.ln_sd[:, None, :] + np.log(damping_factor(DAMPINGS))[None, :, None]
    grid = np.log(motion.periods), np.log(DAMPINGS), np.ascontiguousarray(spectra)
    probability = np.empty(len(pairs))
    resampled_probabilities(grid, np.stack(columns, axis=1), NODES, probability)
    return probability


def _damping_dispersion(pairs: pd.DataFrame, i: int) -> FloatArray:
    """Return the log-standard deviation of the radius that an uncertain damping causes."""
    damping, spread = values(pairs, f"damping_{i}"), values(pairs, f"damping_log_std_{i}")
    least = np.minimum(damping * np.exp(spread), 0.999)
    dispersion: FloatArray = (
        np.log(damping_factor(damping * np.exp(-spread)) / damping_factor(least)) / 2.0
    )
    return dispersion
