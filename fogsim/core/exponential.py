"""The exponential function without branches, so that loops over it run in vector registers."""

import numpy as np

from fogsim.core.jit import kernel

_PER_LN2, _LN2_HIGH, _LN2_LOW = 1.4426950408889634, 6.93145751953125e-1, 1.42860682030941723212e-6
_LEAST, _MOST = -708.0, 709.0
"""Below the one the result is 0; above the other it is that of the other."""

_ROUNDING, _BIAS, _MANTISSA = 6755399441055744.0, 1023, 52
"""A number whose last bit is 1, and what a double's exponent counts from and is shifted by."""

_C2, _C3, _C4, _C5, _C6, _C7 = 1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 720, 1 / 5040
_C8, _C9, _C10, _C11, _C12, _C13 = (
    1 / 40320, 1 / 362880, 1 / 3628800, 1 / 39916800, 1 / 479001600, 1 / 6227020800
)  # fmt: skip


@kernel
def exponential(x: float) -> float:
    """e^x, off by two units in the last place at most."""
    within = min(max(x, _LEAST), _MOST)
    shifted = within * _PER_LN2 + _ROUNDING
    whole = shifted - _ROUNDING
    r = within - whole * _LN2_HIGH - whole * _LN2_LOW
    # Two halves of Taylor's series, which depend on each other less than one chain would.
    r2 = r * r
    r4 = r2 * r2
    low = (1.0 + r) + r2 * (_C2 + r * _C3) + r4 * (_C4 + r * _C5 + r2 * (_C6 + r * _C7))
    high = (_C8 + r * _C9) + r2 * (_C10 + r * _C11) + r4 * (_C12 + r * _C13)
    power = np.int64((np.float64(shifted).view(np.int64) + _BIAS) << _MANTISSA).view(np.float64)
    return 0.0 if x < _LEAST else (low + r4 * r4 * high) * power
