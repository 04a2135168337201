"""Full-width vectors are used where they are faster, and only where the user did not choose."""

import json
import os
import subprocess
import sys

import pytest

from per_obspy import full_vectors

INTEL = """processor\t: 0
vendor_id\t: GenuineIntel
model name\t: Intel(R) Xeon(R) Platinum 8488C
flags\t\t: fpu fma avx2 avx512f avx512vl

processor\t: 1
vendor_id\t: GenuineIntel
"""
#: Compiles the loop of the measurement for another processor, and prints its widest registers.
WIDEST = """
import re
from numba import float64, int64
from per_obspy.kernels.vector_width import run_oscillators
run_oscillators.kernel.compile((int64, float64[:, ::1]))
text = next(iter(run_oscillators.kernel.inspect_asm().values()))
found = re.findall(r"(?:fmadd|max)\\w*pd.*%([yz])mm", text)
print(max(found, key=found.count))
"""
FEATURES = "+avx,+avx2,+fma,+bmi,+bmi2,+avx512f,+avx512dq,+avx512bw,+avx512vl,+avx512cd"


@pytest.fixture
def intel(tmp_path, monkeypatch):
    """Stand in for a machine with an Intel processor; return its folder of kernels."""
    path = tmp_path / "cpuinfo"
    path.write_text(INTEL)
    monkeypatch.setattr(full_vectors, "PROCESSORS", path)
    monkeypatch.setattr(full_vectors.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(full_vectors, "full_width_features", lambda: "+avx512f,-prefer-256-bit")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.delitem(sys.modules, "numba", raising=False)
    for name in full_vectors.CHOSEN:
        # set and deleted, so that it is gone after the test
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)
    return tmp_path


@pytest.mark.parametrize(("full", "chosen"), [(44.0, True), (28.5, False)])
def test_the_faster_width_is_measured_once_and_used(intel, monkeypatch, full, chosen):
    calls = []

    def speed(variables):
        calls.append(dict(variables))
        return full if variables else 28.0

    monkeypatch.setattr(full_vectors, "_speed", speed)
    for _ in range(2):
        full_vectors.use_full_vectors()
        assert ("NUMBA_CPU_FEATURES" in os.environ) == chosen
        os.environ.pop("NUMBA_CPU_FEATURES", None)
    assert len(calls) == 2  # one per width
    stored = json.loads((intel / "vector_speeds.json").read_text())
    assert stored == {"Intel(R) Xeon(R) Platinum 8488C": {"half": 28.0, "full": full}}


@pytest.mark.usefixtures("intel")
def test_other_processors_and_choices_of_the_user_are_left_alone(monkeypatch):
    monkeypatch.setattr(full_vectors, "_speed", lambda variables: 44.0 if variables else 28.0)
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    full_vectors.use_full_vectors()
    assert "NUMBA_CPU_FEATURES" not in os.environ
    monkeypatch.delenv("NUMBA_CPU_NAME")
    for other in (INTEL.replace("GenuineIntel", "AuthenticAMD"), INTEL.replace("avx512f", ""), ""):
        full_vectors.PROCESSORS.write_text(other)
        assert full_vectors.wide_processor() == ""
        full_vectors.use_full_vectors()
        assert "NUMBA_CPU_FEATURES" not in os.environ


def test_a_measurement_that_fails_or_a_spoilt_file_decides_for_the_default(intel, monkeypatch):
    monkeypatch.setattr(full_vectors, "_speed", lambda _: 0.0)
    (intel / "vector_speeds.json").write_text("[1")
    full_vectors.use_full_vectors()
    assert "NUMBA_CPU_FEATURES" not in os.environ


@pytest.mark.skipif(full_vectors.platform.machine() != "x86_64", reason="x86-64 only")
def test_the_compiler_uses_512_bits_only_if_it_is_not_left_its_preference(tmp_path):
    found = []
    for features in (FEATURES, f"{FEATURES},{full_vectors.FULL_WIDTH}"):
        variables = {
            "NUMBA_CPU_NAME": "sapphirerapids",
            "NUMBA_CPU_FEATURES": features,
            "NUMBA_CACHE_DIR": str(tmp_path),
            "NUMBA_DISABLE_JIT": "0",
        }
        done = subprocess.run(
            [sys.executable, "-c", WIDEST],
            env={**os.environ, **variables},
            capture_output=True,
            text=True,
            check=True,
        )
        found.append(done.stdout.strip())
    assert found == ["y", "z"]
