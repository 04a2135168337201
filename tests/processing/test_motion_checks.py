"""What no ground motion can be: peaks, contradicting components, motion without rest."""

import numpy as np
import pytest
from obspy import Stream, Trace, UTCDateTime

from per_obspy.config import Check, Checks, Processing
from per_obspy.processing.chain import process_station
from per_obspy.processing.motion_checks import (
    AT_REST,
    acceleration_findings,
    component_findings,
    final_findings,
)

RATE = 100.0


def trace(samples, letter="E", **stats):
    header = {"network": "XX", "station": "STA", "channel": f"HN{letter}", "sampling_rate": RATE}
    dip = -90.0 if letter == "Z" else 0.0
    azimuth = {} if letter == "Z" else {"sensor_azimuth": 90.0 if letter == "E" else 0.0}
    return Trace(
        np.asarray(samples, dtype=float),
        header
        | {"units": "m/s2", "sensor_dip": dip, "starttime": UTCDateTime(2020, 1, 1)}
        | azimuth
        | stats,
    )


def velocity_findings(velocity):
    # a triangle of 10 m/s2, which leaves its area
    record = trace([0.0, 10.0, 0.0])
    record.stats.delta = velocity / 10.0
    return [one for one in final_findings(record, Checks()) if one.check not in AT_REST]


def failed(findings):
    return {(finding.check, finding.level) for finding in findings}


@pytest.fixture
def components(earthquake):
    """Return E, N and Z of one earthquake: P waves, mostly vertical, 4 s before S waves."""

    def make(changed=lambda _, samples: samples, letters="ENZ", **stats):
        stream = Stream()
        for seed, letter in enumerate("ENZ", 1):
            early, strong = (1.0, 0.5) if letter == "Z" else (0.25, 1.0)
            samples = early * earthquake(seed + 10, 20.0, 3.0) + strong * earthquake(seed, 24.0)
            if letter in letters:
                stream += trace(changed(letter, samples), letter, **stats)
        return stream

    return make


@pytest.mark.parametrize(
    ("peak", "expected"),
    [
        # IWTH25 recorded 42.8 m/s2, and this limit is in m/s2: a quarter of the record passes
        (10.0, set()),
        (42.8, set()),
        (60.0, {("unusual_acceleration", "warn")}),
        (100.0, {("impossible_acceleration", "reject")}),
        (1e18, {("impossible_acceleration", "reject")}),
        # a thousandth of a gal, a hundredth of what people feel
        (1e-5, {("weak_motion", "warn")}),
    ],
)
def test_peaks_are_compared_with_the_largest_and_the_smallest(earthquake, peak, expected):
    motion = earthquake() - earthquake().mean()
    samples = peak * motion / np.abs(motion).max() + 5.0
    assert failed(acceleration_findings(trace(samples), Checks())) == expected


@pytest.mark.parametrize(
    ("velocity", "expected"),
    [
        (3.18, set()),  # Chi-Chi
        (4.0, {("unusual_velocity", "warn")}),
        (175.0, {("impossible_velocity", "reject"), ("velocity_time", "reject")}),
    ],
)
def test_velocities_are_compared_with_the_largest(velocity, expected):
    assert failed(velocity_findings(velocity)) == expected


@pytest.mark.parametrize("level", ["raw", "processed"])
@pytest.mark.parametrize(("factor", "is_used"), [(1.0, True), (100.0, False)])
def test_limits_hold_for_raw_and_processed_records(components, level, factor, is_used):
    stream = components(lambda _, samples: factor * samples, processing_level=level)
    accepted, rejected = process_station(stream, Processing())
    assert len(accepted) == (3 if is_used else 0)
    assert all("peak acceleration" in " ".join(row.reasons) for row in rejected)


def test_a_processed_record_that_is_read_back_is_judged_again(components):
    clean, _ = process_station(components(), Processing())
    again, rejected = process_station(clean.copy(), Processing())
    assert (len(again), rejected) == (3, ())
    for one in clean:
        one.data *= 1000
    assert not process_station(clean, Processing())[0]


@pytest.mark.parametrize("level", ["raw", "processed"])
def test_times_in_milliseconds_are_refused(components, level):
    # 0, 10, 20 ms read as seconds: 1000 times the velocity
    stream = components(processing_level=level)
    for one in stream:
        one.stats.delta *= 1000
    accepted, rejected = process_station(stream, Processing())
    assert not accepted
    assert "10, allowed 0.2" in " ".join(rejected[0].reasons)


def test_one_motion_has_no_finding(components):
    assert component_findings(components(), Checks()) == {}


def small(letter, samples):
    return samples / 10 if letter == "E" else samples


def tiny_vertical(letter, samples):
    return samples / 100 if letter == "Z" else samples


def large(letter, samples):
    return samples * 100 if letter == "E" else samples


def later(letter, samples):
    return np.roll(samples, 200) if letter == "E" else samples


def earlier(letter, samples):
    return np.roll(samples, -200) if letter == "E" else samples


@pytest.mark.parametrize(
    ("change", "check", "wrong"),
    [
        (small, "weak_component", "E"),
        (tiny_vertical, "weak_component", "Z"),
        (large, "outlier", "E"),
        (later, "late_component", "E"),
        (earlier, "late_component", "E"),
    ],
)
def test_the_component_that_contradicts_both_others_is_found(components, change, check, wrong):
    # would catch the finding given to another component
    findings = component_findings(components(change), Checks())
    assert set(findings) == {f"XX.STA..HN{wrong}"}
    assert failed(findings[f"XX.STA..HN{wrong}"]) == {(check, "reject")}


def test_the_time_of_a_late_component_is_its_figure(components):
    (finding,) = component_findings(components(later), Checks())["XX.STA..HNE"]
    # Steps of the envelope are 0.05 s
    figure = float(finding.reason.split(": ")[1].split(",")[0])
    assert figure == pytest.approx(2.0, abs=0.2)


def test_of_two_components_that_differ_too_much_neither_is_used(components):
    findings = component_findings(components(small, letters="EN"), Checks())
    assert set(findings) == {"XX.STA..HNE", "XX.STA..HNN"}
    assert component_findings(components(letters="EN"), Checks()) == {}


@pytest.mark.parametrize("factor", [1.0, -1.0, 0.3])
def test_copies_are_found_whatever_their_gain(components, factor):
    stream = components()
    stream[1].data = factor * stream[0].data
    findings = component_findings(stream, Checks())
    assert set(findings) == {"XX.STA..HNE", "XX.STA..HNN"}
    assert all(failed(each) == {("copied_component", "reject")} for each in findings.values())


def test_a_vertical_in_the_place_of_a_horizontal_is_found(components):
    stream = components()
    stream[1].data, stream[2].data = stream[2].data, stream[1].data
    findings = component_findings(stream, Checks())
    assert failed(findings["XX.STA..HNN"]) == {("exchanged_component", "warn")}
    assert set(findings) == {"XX.STA..HNN"}


def test_horizontals_of_a_pair_may_be_turned(components):
    # Whatever the directions of the sensors are, the pair is one motion
    stream = components()
    first, second = stream[0].data.copy(), stream[1].data.copy()
    angle = np.deg2rad(40.0)
    stream[0].data = np.cos(angle) * first + np.sin(angle) * second
    stream[1].data = np.cos(angle) * second - np.sin(angle) * first
    assert component_findings(stream, Checks()) == {}


def test_an_implausible_record_is_a_flag_where_the_check_only_warns(components):
    lenient = Checks(late_component=Check(threshold=1.0, level="warn"))
    accepted, rejected = process_station(components(later), Processing(checks=lenient))
    assert rejected == ()
    (late,) = (one for one in accepted if one.stats.channel == "HNE")
    assert late.stats.per_obspy.record_flags.split() == ["implausible_record"]
    assert "shifted in time" in late.stats.per_obspy.warnings


def test_the_whole_instrument_goes_with_a_clipped_component(components):
    def clipped(letter, samples):
        limit = 0.5 * np.abs(samples).max()
        return np.clip(samples, -limit, limit) if letter == "Z" else samples

    accepted, rejected = process_station(components(clipped), Processing())
    assert not accepted
    reasons = {row.name[-1]: row.reasons[0] for row in rejected}
    assert reasons["E"] == reasons["N"] == "clipped: XX.STA..HNZ of the same instrument"
    assert reasons["Z"].startswith("clipped: ")


@pytest.mark.parametrize(("rate", "is_flagged"), [(100.0, False), (99.9999, False), (200.0, True)])
def test_another_rate_than_that_of_the_metadata_is_a_warning(components, rate, is_flagged):
    accepted, _ = process_station(components(channel_rate=rate), Processing())
    flags = [one.stats.per_obspy.get("record_flags", "") for one in accepted]
    assert ("implausible_record" in flags[0]) is is_flagged


DT = 0.01


def acceleration(samples):
    return Trace(
        np.asarray(samples, dtype=float), {"delta": DT, "quantity": "acceleration", "units": "m/s2"}
    )


def test_a_motion_that_comes_to_rest_is_fine():
    time = np.arange(1001) * DT
    rest = np.gradient(np.gradient(np.exp(-((time - 5) ** 2)), DT), DT)
    assert final_findings(acceleration(rest), Checks()) == []


def test_a_motion_that_goes_on_is_found_with_its_figures():
    found = [
        finding
        for finding in final_findings(acceleration(np.ones(1000)), Checks())
        if finding.check in AT_REST
    ]
    assert [(finding.check, finding.level) for finding in found] == [
        ("final_velocity", "reject"),
        ("final_displacement", "reject"),
    ]
    assert "over its peak: 1, allowed 0.1" in found[0].reason
