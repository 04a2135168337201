"""Several exact steps of the linear oscillator at once, under linear ground acceleration."""

from per_obspy.kernels._jit import kernel


@kernel
def fill_stride_weights(coefficients, stride, displaced, moved):
    """
    Fill the weights of a stride's samples in the displacement and in the velocity at its end.

    The state after the stride is the matrix of a step of that length times the state before it,
    plus the weighted samples.

    Parameters
    ----------
    coefficients : tuple of 8 float
        Of one step, from `exact_step.step_coefficients`.
    stride : int
        Number of steps.
    displaced, moved : (stride + 1,) ndarray
        Receive the weights of all samples of the stride, those at both ends included.
    """
    a11, a12, a21, a22, b11, b12, b21, b22 = coefficients
    displaced[:] = 0.0
    moved[:] = 0.0
    for sample in range(stride):
        # Weights of a step, moved on by the steps after it
        for earlier in range(sample + 1):
            u, z = displaced[earlier], moved[earlier]
            displaced[earlier], moved[earlier] = a11 * u + a12 * z, a21 * u + a22 * z
        # The step itself: its first sample was the last one of the step before
        displaced[sample] += b11
        moved[sample] += b21
        displaced[sample + 1], moved[sample + 1] = b12, b22
