"""
Cycles per step of the PER kernel on Intel server cores: static analysis, not a measurement.

    python tests/benchmarks/kernel_cycles.py
    python tests/benchmarks/kernel_cycles.py skylake-avx512

Compiles the inner loops for a processor with full-width vectors and asks ``llvm-mca`` (Debian:
``llvm-19``) for their cycles when all data are in the first cache. Step by step, eight
multiply-adds at two per cycle are four cycles per step and vector of eight oscillators at best.
LLVM's models of Ice Lake and Sapphire Rapids know one of the two ports for multiply-adds of 512
bits only, so that the model of Skylake servers, which have the same two, is used.
"""

import os
import re
import shutil
import subprocess
import sys

#: Kernels of `per_obspy.kernels.spectra.radius`, their signatures, and the steps of a pass of their
#: loops.
KERNELS = {
    "run_strides": ("(double[::1], double[:, ::1], double[:, :, ::1])", 8),
    "_run_steps": ("(double[::1], int64, double[::1])", 4),
}
PROCESSORS = ("skylake-avx512",)

#: Program that prints the assembly of a kernel, compiled for the processor of its environment.
COMPILED = """
import numba, sys
from numba.core.sigutils import normalize_signature
from per_obspy.kernels._jit import OPTIONS
from per_obspy.kernels.spectra import radius
name, signature = sys.argv[1:]
function = getattr(radius, name).py_func
kernel = numba.njit(**(OPTIONS | {"cache": False}))(function)
types = {"double": numba.float64, "int64": numba.int64}
kernel.compile(eval(signature, types))
print(kernel.inspect_asm(kernel.signatures[0]))
"""


def assembly(kernel: str, processor: str) -> str:
    """Return the assembly of a kernel for a processor."""
    features = "+avx2,+fma,+avx512f,+avx512vl,+avx512dq,+avx512bw,-prefer-256-bit"
    variables = {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": features}
    command = [sys.executable, "-c", COMPILED, kernel, KERNELS[kernel][0]]
    environment = os.environ | variables
    return subprocess.run(
        command, env=environment, capture_output=True, text=True, check=True
    ).stdout


def hottest_loop(text: str) -> list[str]:
    """Return the lines of the loop with the most multiply-adds of vectors."""
    loops = []
    lines = text.splitlines()
    begins = {line[:-1]: i for i, line in enumerate(lines) if re.fullmatch(r"\.LBB\w+:", line)}
    for i, line in enumerate(lines):
        jump = re.fullmatch(r"\s+j\w+\s+(\.LBB\w+)", line)
        if jump and begins.get(jump[1], i) < i:
            loops.append([part for part in lines[begins[jump[1]] : i + 1] if "\t." not in part])
    # Innermost loops only: none that contains the beginning of another
    inner = [loop for loop in loops if sum(part.endswith(":") for part in loop) == 1]
    return max(inner, key=lambda loop: sum("vfm" in part and "zmm" in part for part in loop))


def cycles(loop: list[str], processor: str, analyser: str) -> float:
    """Return the cycles of one pass of a loop."""
    command = [analyser, f"-mcpu={processor}", "-iterations=200"]
    done = subprocess.run(
        command, input="\n".join(loop), capture_output=True, text=True, check=True
    )
    return float(re.search(r"Total Cycles:\s+(\d+)", done.stdout)[1]) / 200


def main() -> None:
    """Print operations and cycles per step of every kernel and processor."""
    names = ["llvm-mca", *(f"llvm-mca-{version}" for version in range(30, 16, -1))]
    analyser = next(filter(None, map(shutil.which, reversed(names))), None)
    if analyser is None:
        sys.exit("llvm-mca is not installed (Debian: apt install llvm-19)")
    for processor in sys.argv[1:] or PROCESSORS:
        for kernel, (_, steps) in KERNELS.items():
            loop = hottest_loop(assembly(kernel, processor))
            text = "\n".join(loop)
            operations = len(re.findall(r"\tv(?:fm|mul|add|max|cmp)\w*pd", text))
            # How many vectors of eight oscillators a pass holds
            passes = max(1, round(len(re.findall(r"\tvmaxpd|\tvcmp\w*pd", text)) / LOOKS[kernel]))
            per_step = cycles(loop, processor, analyser) / steps / passes
            row = f"{processor:16}{kernel:14}{operations / steps / passes:6.2f} vector operations"
            print(f"{row} and {per_step:5.2f} cycles per step and vector")


#: Comparisons of one vector in a pass: after a stride, and after every step.
LOOKS = {"run_strides": 1, "_run_steps": 4}

if __name__ == "__main__":
    main()
