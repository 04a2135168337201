import numpy as np
import pytest
from obspy import Stream, Trace

from per_obspy.config import Check, Checks
from per_obspy.errors import RecordRejected
from per_obspy.processing.findings import Finding, above, below, judged
from per_obspy.processing.quality import later_event, longest_extreme_run, outlier_findings, raw_findings

RATE, GAIN = 100.0, 2e5


def recorded(samples, rate=RATE, **stats):
    """Return counts: whole numbers with the noise of a good recorder."""
    noise = 20 * np.random.default_rng(7).normal(size=samples.size)
    return Trace(np.round(GAIN * samples + noise + 1234), {"sampling_rate": rate, "channel": "HNE"} | stats)


def checks_that_fail(trace):
    return {finding.check for finding in raw_findings(trace, Checks())}


@pytest.mark.parametrize("seed", range(6))
def test_a_good_record_passes_every_check(earthquake, seed):
    assert checks_that_fail(recorded(earthquake(seed))) == set()


def clipped(x):
    return np.clip(x, -0.4 * x.max(), 0.4 * x.max())


def dropped_out(x):
    x = x.copy()
    x[2250:2320] = x[2250]
    return x


def spiked(x):
    x = x.copy()
    x[x.size // 4] += 8 * np.abs(x).max()
    return x


def late(x):
    return x[2200:]


def cut(x):
    return x[:2400]


def twice(x):
    return x + 0.5 * np.roll(x, 7000)


def wandering(x):
    return x * 0 + np.cumsum(np.random.default_rng(1).normal(size=x.size)).cumsum() * 1e-3


def brief(x):
    return x[2000:2400]


def noiseless(damage, x):
    """Return damaged counts whose damage no noise of the recorder covers."""
    return Trace(np.round(damage(recorded(x).data)), {"sampling_rate": RATE, "channel": "HNE"})


@pytest.mark.parametrize(
    ("damage", "check"),
    [
        (clipped, "clipped_run"),
        (lambda x: np.clip(x, None, 0.3 * x.max()), "clipped_run"),
        (dropped_out, "dropout"),
        (spiked, "spike"),
        (late, "late_trigger"),
        (cut, "cut_off"),
        (twice, "second_event"),
        (wandering, "zero_crossings"),
        (brief, "duration"),
        (lambda x: 0 * x + 5, "levels"),
    ],
)
def test_each_damage_is_found(earthquake, damage, check):
    assert check in checks_that_fail(noiseless(damage, earthquake()))


def test_a_slow_recorder_is_found(earthquake):
    assert checks_that_fail(recorded(earthquake()[::10], rate=10.0)) >= {"sampling_rate"}


def test_a_full_counter_is_a_warning_for_counts_only(earthquake):
    samples = earthquake() / np.abs(earthquake()).max() * 0.9 * 2**23 / GAIN
    assert checks_that_fail(recorded(samples)) == {"counter_use"}
    assert checks_that_fail(recorded(samples, units="m/s2")) == set()


def test_checks_do_not_stop_each_other(earthquake):
    found = checks_that_fail(noiseless(lambda x: dropped_out(spiked(x))[:3500], earthquake()))
    assert {"spike", "dropout"} <= found


def test_quiet_recorders_may_stand_still_before_the_shaking(earthquake):
    # mutation: looking for stillness in the whole record rejects every coarse recorder
    samples = np.round(earthquake() * 200)
    assert "dropout" not in checks_that_fail(Trace(samples, {"sampling_rate": RATE}))


@pytest.mark.parametrize(("order", "ratio"), [(1, 0.5), (-1, 0.5)])
def test_another_event_is_found_before_and_after(earthquake, order, ratio):
    both = (earthquake(3) + ratio * np.roll(earthquake(3), 6000))[::order]
    assert later_event(both, 1 / RATE) == pytest.approx(ratio, rel=0.05)


def test_the_run_at_an_extreme_does_not_count_equal_samples_elsewhere():
    assert longest_extreme_run(np.array([0, 0, 0, 0, 1, -1, -1, 0.5])) == 2


def instrument(*factors):
    rng = np.random.default_rng(11)
    return Stream(
        [
            Trace(factor * rng.normal(size=1000), {"channel": f"HN{letter}"})
            for letter, factor in zip("ENZ", factors, strict=False)
        ]
    )


def test_a_component_several_times_both_its_sisters_is_found():
    found = outlier_findings(instrument(1, 10, 1), Checks())
    assert list(found) == ["..HNN"] or list(found) == ["...HNN"]
    assert [finding.check for finding in next(iter(found.values()))] == ["outlier"]
    assert not any(outlier_findings(instrument(1, 3, 1), Checks()).values())


def test_between_two_components_nobody_can_tell():
    assert outlier_findings(instrument(1, 10), Checks()) == {}


def test_thresholds_belong_to_the_good_side():
    setting = Check(threshold=2.0, level="warn")
    assert (below("x", setting, 2.0, ""), above("x", setting, 2.0, "")) == ([], [])
    assert below("x", setting, 1.5, "figure")[0].reason == "figure 1.5, needs 2"
    assert above("x", setting, 2.5, "figure")[0].reason == "figure 2.5, allowed 2"


def test_levels_decide_what_a_finding_means():
    trace = Trace(np.zeros(3), {"channel": "HNE"})
    kept = judged(trace, [Finding("a", "warn", "one"), Finding("b", "note", "two"), Finding("c", "warn", "three")])[0]
    assert (kept.stats.per_obspy.warnings, kept.stats.per_obspy.notes) == ("one; three", "two")
    with pytest.raises(RecordRejected) as caught:
        judged(kept, [Finding("d", "reject", "four"), Finding("e", "reject", "five"), Finding("f", "warn", "six")])
    assert caught.value.reasons == ("four", "five", "one; three", "six")
    assert "per_obspy" not in trace.stats
