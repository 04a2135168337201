"""Meanings of flags and of the rules of a demand; read by pages that wait for no library."""

from per_obspy.inventory.schema import ROW_SUSPICIONS

#: Flags that the processing raises for a record, which every pair of its station has.
RECORD_FLAGS = (
    "baseline_shift",
    "second_event",
    "clipped",
    "wrapped",
    "filled",
    "implausible_record",
    "assumed_corners",
    "digitised",
    "nominal_sensitivity",
    "undated",
    "contradicting_coordinates",
    "implausible_amplitude",
    "implausible_place",
    "repeated_record",
    "record_warning",
)

#: Rules of the demand by which ``demand_rule`` names them, in words.
DEMAND_RULES: dict[str, str] = {
    "exact": "exact for the record",
    "per_white_noise": "estimate from PER",
    "per_record": "estimate from PER and the record's correlation",
    "linearized": "estimate for yielding buildings",
    "srss": "SRSS, because a period is derived",
    "shakemap": "from a ShakeMap",
    "amplitudes": "from amplitudes of stations",
    "sd_white_noise": "estimate from the spectrum",
    "sd_srss": "SRSS of the spectrum, because a period is derived",
}

#: Flags of a pair and the meaning of each.
FLAGS: dict[str, str] = {
    "unknown_gap": (
        "the pair table gives no gap: the demand is the gap needed; probability, state and impacts "
        "are empty, or those of the gap that the configuration assumes"
    ),
    "missing_scenario": (
        "a scenario of the ensemble has no result for the pair: it has no probability, and "
        "is ranked by the other scenarios"
    ),
    "doubtful_cell": (
        "a cell of the pair table was not understood and is left empty, or a gap is a range, an "
        "estimate or a limit: see cell_notes"
    ),
    "touching": "gap 0: the single hit is outside its reliable range",
    "learned_outlines": (
        "an outline was learned from images, which show no gap to be wide enough: the state is not "
        "no"
    ),
    "raster_height": (
        "a height is the median of a raster inside the outline, with the deviation height_log_std"
    ),
    "residual_gap": (
        "the gap is what the history of an earlier earthquake left; gap_before is that of the pair "
        "table"
    ),
    "after_damage_unknown": (
        "an earlier earthquake may have damaged the pair in a way that no history followed: the "
        "state is not no, measure the gap"
    ),
    "single_hit_unreliable": (
        "gap below 0.6 of the demand: several impacts are likely, the single hit may be too low"
    ),
    "assumed_strength": (
        "a building yields by an assumed strength: that of HAZUS for its system, storeys and the "
        "assumed code level; no such strength alone makes a no"
    ),
    "beyond_elastic": (
        "a building would yield, which is not modelled: its elastic displacement is elastic_ratio "
        "times the yield displacement of HAZUS for its system, storeys and assumed code level"
    ),
    "unknown_strength": (
        "the system or height of a building is unknown, and no yield value is given: it is linear, "
        "so that the pair may rank above those whose buildings yield"
    ),
    "outside_usable_periods": (
        "a building's period is outside the usable periods of the station's record"
    ),
    "per_far_above_sd": "PER/SD above the configured limit: a gap from PER is far too large",
    "far_station": "the station is further away than the configured distance for this flag",
    "one_horizontal": "the station has one horizontal: its azimuth is used whatever the pair's",
    "unknown_azimuths": (
        "the azimuths of the station's horizontals are unknown: the demand is the largest of all, "
        "and its azimuth is from the first sensor"
    ),
    "derived_inputs": "the row has derived inputs, named in the column derived",
    "derived_period": (
        "a period was derived: the demand is at least SRSS; state and rank follow from resampling"
    ),
    "equal_by_formula": (
        "both periods are derived and equal, by which the buildings would move as one and not hit: "
        "state and rank follow from how much the periods of alike neighbours differ "
        "(period_correlation)"
    ),
    "soft_ground": (
        "the ground is soft: the soil lengthens periods, by which derived ones are less certain"
    ),
    "linearized_not_converged": (
        "no ductility up to 40 was found: the linearized demand is that of 40, often too large"
    ),
    "no_damping_suffices": (
        "it pounds, and no damping added up to 0.4 of critical keeps the buildings apart"
    ),
    "no_bumper_suffices": (
        "it pounds, and no restitution keeps the single hit within target_amplification"
    ),
    "no_demand": (
        "the demand is 0 (the oscillators move as one or not at all): there is no demand ratio"
    ),
    "floor_to_column": "floors do not meet floors: outside the method",
    "record_from_other_site_class": (
        "no station of the pair's site class is in reach: the nearest of another serves"
    ),
    "motion_from_other_site_class": (
        "no station of the site's class contributes to the motion at the site: others do"
    ),
    "amplitudes_only": (
        "the nearest stations have amplitudes but no record: demand from the SD between stations, "
        "without PER, record and exact history"
    ),
    "shakemap_demand": (
        "no station in reach: demand from the SD of a ShakeMap, "
        "without PER, record and exact history"
    ),
    "shakemap_assumed_deviation": (
        "the ShakeMap contains no deviation: the configured one is assumed"
    ),
    "baseline_shift": (
        "the baseline of the station's record shifted during the shaking: long periods are "
        "doubtful, and not usable where PER depends on when it shifted"
    ),
    "second_event": ("the station's record holds another event: its demand may be that of both"),
    "clipped": (
        "the station's record may have reached the limit of its sensor or recorder: the motion may "
        "have been stronger"
    ),
    "wrapped": ("the counter of the station's record overflowed: peaks continue at its other end"),
    "filled": (
        "a gap of the station's record was filled during the shaking: the motion there is unknown"
    ),
    "implausible_record": (
        "unit, sampling interval or components of the station's record contradict what the ground "
        "can do, or each other: see stations.csv"
    ),
    "assumed_corners": (
        "a filter corner of the station's record is assumed: neither noise nor header gives it"
    ),
    "digitised": (
        "the station's record was digitised from film: short and long periods are less certain"
    ),
    "nominal_sensitivity": (
        "the station's record was converted by an overall sensitivity alone, which may be that of "
        "the model: the metadata have no stages of the response"
    ),
    "undated": (
        "the start time of the station's record is unknown: it may be of another earthquake"
    ),
    "contradicting_coordinates": (
        "two sources place the station more than 1 km apart: see stations.csv"
    ),
    "implausible_amplitude": (
        "the station's peaks differ from its neighbours or from a ground-motion model by more than "
        "4 deviations: see stations.csv"
    ),
    "implausible_place": (
        "the station's coordinates are an empty field, exchanged, or lack a sign: see stations.csv"
    ),
    "repeated_record": (
        "the station's record is that of another station, perhaps times a factor: see stations.csv"
    ),
    "record_warning": (
        "the station's record failed another check that only warns: see stations.csv"
    ),
    "simulated": "the ground motion is simulated",
    **ROW_SUSPICIONS,
}
