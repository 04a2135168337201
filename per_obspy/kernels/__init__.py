"""
Compiled kernels: numbers and arrays in, arrays out; no checks, no units, no objects.

Only this room imports Numba.
"""
