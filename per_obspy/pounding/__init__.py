"""
Physics of a pair of buildings.

Correlation, critical gap, impact, single hit, exact histories, linearization, mitigation,
probability.
"""
