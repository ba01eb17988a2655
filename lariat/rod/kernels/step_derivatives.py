"""Derivative of a step's equation with respect to the solves before it.

At the minimizer the gradient g(x, x1, x0, ..., theta) is zero, so that, with the Hessian H,

    H dx = -dg/dx1 dx1 - dg/dx0 dx0 - ... - dg/dtheta dtheta.

For nodes, dg/dx_k = -m wt share_k. For edges, they are the 3x3 matrices computed here, since
targets are composed in the chart of the last orientation.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import time_at
from lariat.rod.kernels.grips import subtract_couplings
from lariat.rod.kernels.memory import store, store33
from lariat.rod.kernels.rotations import (
    exponential,
    left_jacobian,
    left_jacobian_inverse,
    log_coefficients,
    logarithm,
    rotation_matrix,
)
from lariat.rod.kernels.step_terms import (
    bend_rotation,
    inertia_coupling,
    internal_rate,
    past_rotation,
    step_times,
    target_share,
)
from lariat.rod.kernels.types import Doubles, Integers, Matrices33
from lariat.rod.launch.codes import Task
from lariat.rod.launch.layout import HISTORY_SLOTS, Header, Section, TimeRow


@ti.real_func
def inertia_derivatives(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Compute derivatives of the gradient with respect to the rotations in earlier solves.

    J_l^-1 of the bends after this solve and the two before it is stored as well, for internal
    damping, and the gradient is cleared, to which only contact adds from here on.
    """
    result = 0.0
    if task == Task.INERTIA_DERIVATIVES:
        n = ni[Header.NODES]
        history = ni[Header.HISTORY]
        _h, _weight, carry = step_times(ni, w, rod, step)
        for i in range(n - 1):
            # In the chart of the last orientation: theta = log(conj(q1) q), summed by shares.
            rotation = ti.Vector([0.0, 0.0, 0.0])
            shares_derivative = ti.Vector([0.0, 0.0, 0.0])
            for back in range(2, history + 1):
                theta = logarithm(past_rotation(ni, w, rod, step, i, back))
                rotation += target_share(ni, w, rod, step, back, carry) * theta
                shares_derivative += (
                    w[time_at(ni, rod, step) + TimeRow.MOMENTUM_SHARES + back - 1] * theta
                )
            coupling = inertia_coupling(ni, w, rod, step, i)
            through_rotation = coupling @ left_jacobian(rotation).transpose()
            store(
                w,
                rod + ni[Section.TARGET_DERIVATIVES] + 3 * i,
                through_rotation @ shares_derivative,
            )
            to = rod + ni[Section.INERTIA_COUPLINGS] + 9 * HISTORY_SLOTS * i
            latest = coupling @ rotation_matrix(exponential(rotation)).transpose()
            for back in range(2, history + 1):
                u = past_rotation(ni, w, rod, step, i, back)
                theta = logarithm(u)
                c, _d = log_coefficients(u)
                inverse = left_jacobian_inverse(theta, c)
                share = target_share(ni, w, rod, step, back, carry)
                store33(w, to + 9 * (back - 1), share * (through_rotation @ inverse.transpose()))
                latest -= share * (through_rotation @ inverse)
            store33(w, to, latest)
        if internal_rate(ni, w, rod, step) > 0.0:
            for k in range(3 * (n - 2)):
                _y, jacobian, _c, _d = bend_rotation(
                    ni, w, rod, step + HISTORY_SLOTS - k % 3, k // 3
                )
                store33(w, rod + ni[Section.BEND_JACOBIANS] + 9 * k, jacobian)
        # Only contact adds to the gradient from here on.
        for k in range(3 * (2 * n - 1)):
            w[rod + ni[Section.GRADIENT] + k] = 0.0
    else:
        result = subtract_couplings(ni, w, w33, task, rod, step, arg, real)
    return result
