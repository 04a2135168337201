"""The physics of a pair of buildings: correlation, critical gap, impact, single hit, histories, mitigation, probability."""
