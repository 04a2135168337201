"""
Exponential, logarithm and normal tail of rows of numbers, in place.

They have no branches, so that the compiler turns them into vectors; one library call per number
takes several times as long. Relative errors stay below 1e-15, of a normal tail below 1e-14.
"""

import math

import numpy as np
from scipy.special import erfcx

from per_obspy.kernels._jit import vectorised

#: Added to and taken from a number below 2**51 this leaves the nearest integer.
TO_INTEGER = 1.5 * 2.0**52
#: ln 2 in two parts; an exponent times the first is exact.
LN_2 = math.log(2.0)
LN_2_HIGH = math.floor(math.log(2.0) * 2.0**32) / 2.0**32
LN_2_LOW = 1.9082149292705877e-10
PER_LN_2 = 1.0 / LN_2
#: Taylor series, highest power first: of exp up to ln 2 / 2, of (exp - 1) / x, of artanh(s) / s in
#: s² to s = 0.172.
EXPONENTIAL = tuple(1.0 / math.factorial(n) for n in range(13, -1, -1))
LESS_ONE = EXPONENTIAL[:-1]
ARTANH = tuple(1.0 / (2 * n + 1) for n in range(10, -1, -1))
#: Exponents between which an exponential is a normal number.
LEAST_EXPONENT, GREATEST_EXPONENT = -708.0, 709.0
#: Bits of the square root of one half, where the mantissa is made to begin.
FIRST_MANTISSA = int(np.array(math.sqrt(0.5)).view(np.int64))
MANTISSA_BITS, EXPONENT_BIAS = 52, 1023
#: ``(1 + 2 z) exp(z²) erfc(z)`` is a polynomial in ``t = (z - CENTRE) / (z + CENTRE)`` to 4e-15,
#: highest first.
CENTRE = 3.75
_T = np.polynomial.chebyshev.chebpts1(21)
_Z = CENTRE * (1.0 + _T) / (1.0 - _T)
_SERIES = np.polynomial.chebyshev.chebfit(_T, (1.0 + 2.0 * _Z) * erfcx(_Z), 20)
TAIL = np.polynomial.chebyshev.cheb2poly(_SERIES)[::-1]
#: Even and odd powers in two sums: a longer loop would not be unrolled.
EVEN = tuple(TAIL[::2].tolist())
ODD = tuple(TAIL[1::2].tolist())
#: Standard deviations beyond which a normal variable is not found: a probability of 1e-299.
FARTHEST_NORMAL = 37.0


@vectorised
def exponentials(x, integers):
    """Replace each number by its exponential; ``integers`` is scratch of the same size."""
    # x = exponent ln 2 + rest; the bits of 2**exponent, and the series of exp(rest)
    for i in range(x.size):
        value = min(max(x[i], LEAST_EXPONENT), GREATEST_EXPONENT)
        exponent = (value * PER_LN_2 + TO_INTEGER) - TO_INTEGER
        rest = (value - exponent * LN_2_HIGH) - exponent * LN_2_LOW
        integers[i] = (np.int64(exponent) + EXPONENT_BIAS) << MANTISSA_BITS
        total = 0.0
        for coefficient in EXPONENTIAL:
            total = total * rest + coefficient
        x[i] = total
    powers = integers.view(np.float64)
    for i in range(x.size):
        x[i] *= powers[i]


@vectorised
def exponentials_less_one(x, integers):
    """
    Replace each number by its exponential less one, without cancellation.

    ``integers`` is scratch of the same size.
    """
    # x = exponent ln 2 + rest; the bits of 2**exponent, and the series of exp(rest) - 1
    for i in range(x.size):
        value = min(max(x[i], LEAST_EXPONENT), GREATEST_EXPONENT)
        exponent = (value * PER_LN_2 + TO_INTEGER) - TO_INTEGER
        rest = (value - exponent * LN_2_HIGH) - exponent * LN_2_LOW
        integers[i] = (np.int64(exponent) + EXPONENT_BIAS) << MANTISSA_BITS
        total = 0.0
        for coefficient in LESS_ONE:
            total = total * rest + coefficient
        x[i] = total * rest
    powers = integers.view(np.float64)
    for i in range(x.size):
        # 2**n exp(rest) - 1 = 2**n (exp(rest) - 1) + (2**n - 1)
        x[i] = powers[i] * x[i] + (powers[i] - 1.0)


@vectorised
def logarithms(x, integers):
    """
    Replace each positive normal number by its logarithm.

    ``integers`` is scratch of the same size.
    """
    # Take the exponent off, so that the mantissa lies about 1
    bits = x.view(np.int64)
    for i in range(x.size):
        integers[i] = (bits[i] - FIRST_MANTISSA) >> MANTISSA_BITS
        bits[i] -= integers[i] << MANTISSA_BITS
    # ln m = 2 artanh((m - 1) / (m + 1))
    for i in range(x.size):
        part = (x[i] - 1.0) / (x[i] + 1.0)
        square = part * part
        total = 0.0
        for coefficient in ARTANH:
            total = total * square + coefficient
        x[i] = integers[i] * LN_2 + 2.0 * part * total


@vectorised
def normal_tails(x, numbers, integers):
    """Replace each number by the probability that a standard normal variable exceeds it."""
    # exp(-x² / 2)
    for i in range(x.size):
        numbers[i] = -0.5 * x[i] * x[i]
    exponentials(numbers, integers)
    # Tail at |x| by the polynomial in t, then the side
    for i in range(x.size):
        z = math.sqrt(0.5) * abs(x[i])
        t = (z - CENTRE) / (z + CENTRE)
        square = t * t
        even = odd = 0.0
        for coefficient in EVEN:
            even = even * square + coefficient
        for coefficient in ODD:
            odd = odd * square + coefficient
        tail = 0.5 * numbers[i] * (even + t * odd) / (1.0 + 2.0 * z)
        x[i] = tail if x[i] > 0.0 else 1.0 - tail
