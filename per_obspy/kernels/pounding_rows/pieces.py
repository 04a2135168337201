"""States of the buildings of a row at both ends of a step."""

from per_obspy.kernels._jit import inlined

# columns of the states of a row in a step: displacement, velocity over omega and acceleration over
# omega² (m), at its start and at its end
START, END = 0, 3
STATE_COLUMNS = 6


@inlined
def state(states, i, column):
    """Return the state of building i at the start or the end of a step."""
    return states[i, column], states[i, column + 1], states[i, column + 2]


@inlined
def set_state(states, i, column, value):
    """Set the state of building i at the start or the end of a step."""
    states[i, column] = value[0]
    states[i, column + 1] = value[1]
    states[i, column + 2] = value[2]
