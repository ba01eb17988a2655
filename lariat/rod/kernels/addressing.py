"""Offsets of positions, orientations and other quantities in the array of doubles.

`ni` is the integer array, `rod` the offset of the current rod.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.launch.codes import Derivatives
from lariat.rod.launch.layout import (
    COLUMNS_STRIDE,
    COLUMNS_WIDTH,
    EFFECTIVE_BEND_WIDTH,
    GROUP_COLUMNS,
    HESSIAN_WIDTH,
    HISTORY_SLOTS,
    PARAMETER_WIDTH,
    STEP_BLOCKS,
    TIME_WIDTH,
    Header,
    Section,
)


@ti.func
def position_at(ni: ti.template(), rod, slot, i):
    """Offset of the position of node i in a slot of the history."""
    return rod + ni[Section.POSITIONS] + 3 * (slot * ni[Header.NODES] + i)


@ti.func
def orientation_at(ni: ti.template(), rod, slot, i):
    """Offset of the orientation of edge i in a slot of the history."""
    return rod + ni[Section.ORIENTATIONS] + 4 * (slot * (ni[Header.NODES] - 1) + i)


@ti.func
def kept_solve(ni: ti.template(), step):
    """Place of a solve in the sections that keep every solve for the adjoint, else one alone."""
    return ti.select(ni[Header.DERIVATIVES] >= Derivatives.ADJOINT, step, 0)


@ti.func
def target_position_at(ni: ti.template(), rod, step, i):
    """Offset of the inertial target of node i."""
    kept = kept_solve(ni, step)
    return rod + ni[Section.TARGET_POSITIONS] + 3 * (kept * ni[Header.NODES] + i)


@ti.func
def target_orientation_at(ni: ti.template(), rod, step, i):
    """Offset of the inertial target of edge i."""
    kept = kept_solve(ni, step)
    return rod + ni[Section.TARGET_ORIENTATIONS] + 4 * (kept * (ni[Header.NODES] - 1) + i)


@ti.func
def effective_bend_at(ni: ti.template(), rod, step, j):
    """Offset of the `EffectiveBend` of bend j."""
    place = kept_solve(ni, step) * (ni[Header.NODES] - 2) + j
    return rod + ni[Section.EFFECTIVE_BENDS] + EFFECTIVE_BEND_WIDTH * place


@ti.func
def hessian_at(ni: ti.template(), rod, step, block):
    """Offset of the Hessian's row of a block: its diagonal 3x3 matrix, then the two below."""
    place = kept_solve(ni, step) * (2 * ni[Header.NODES] - 1) + block
    return rod + ni[Section.HESSIAN] + HESSIAN_WIDTH * place


@ti.func
def hessian_index(ni: ti.template(), rod, step):
    """Place of the first diagonal matrix of the Hessian in `w33`; each block has three matrices."""
    return ti.raw_div(hessian_at(ni, rod, step, 0), 9)


@ti.func
def transposed_at(ni: ti.template(), rod, step, block):
    """Offset of a block's row of the transposed Hessian; without friction, of the Hessian."""
    place = kept_solve(ni, step) * (2 * ni[Header.NODES] - 1) + block
    return rod + ni[Section.TRANSPOSED_HESSIAN] + HESSIAN_WIDTH * place


@ti.func
def transposed_index(ni: ti.template(), rod, step):
    """Place of the first diagonal matrix of the transposed Hessian in `w33`."""
    return ti.raw_div(transposed_at(ni, rod, step, 0), 9)


@ti.func
def slip_at(ni: ti.template(), rod, slot, pair):
    """Offset of the slip of a pair before solve `slot`; after it, at slot + 1."""
    kept = ti.select(ni[Header.DERIVATIVES] >= Derivatives.ADJOINT, slot, slot & 1)
    return rod + ni[Section.SLIPS] + 3 * (kept * ni[Header.FRICTION_PAIRS] + pair)


@ti.func
def time_at(ni: ti.template(), rod, step):
    """Offset of the `TimeRow` of a solve."""
    return rod + ni[Section.TIMES] + TIME_WIDTH * step


@ti.func
def parameter_derivatives_at(ni: ti.template(), rod, group, j):
    """Offset of the rows of block j, for a group of parameters."""
    count = 2 * ni[Header.NODES] - 1
    return rod + ni[Section.PARAMETER_DERIVATIVES] + COLUMNS_WIDTH * (group * count + j)


@ti.func
def parameter_code_at(ni: ti.template(), p):
    """Place in the integer array of the `ParameterCode`, knot and knot count of parameter p."""
    return STEP_BLOCKS + ni[Header.HORIZON] + PARAMETER_WIDTH * p


@ti.func
def column_groups(columns):
    """Number of groups of a number of columns."""
    return (columns + (GROUP_COLUMNS - 1)) // GROUP_COLUMNS


@ti.func
def steady_groups(ni: ti.template()):
    """Number of groups of columns for actions and parameters, which come before all others."""
    return ni[Header.ACTION_GROUPS] + column_groups(ni[Header.PARAMETERS])


@ti.func
def sensitivity_columns_at(ni: ti.template(), rod, group):
    """Offset of a group of columns, and the number of groups."""
    groups = steady_groups(ni) + column_groups(ni[Header.STATE_DIRECTIONS])
    size = COLUMNS_STRIDE * (2 * ni[Header.NODES] - 1)
    return rod + ni[Section.SENSITIVITIES] + size * group, groups


@ti.func
def group_history(ni: ti.template(), step, group):
    """Number of solves before this one that columns of a group may depend on.

    Those of a block of actions begin with its first step, those of parameters with the first solve.
    """
    solves = ti.select(group < steady_groups(ni), 0, ni[Header.HISTORY])
    for back in ti.static(range(1, HISTORY_SLOTS + 1)):
        solve = ti.max(step - back, 0)
        block = ni[STEP_BLOCKS + solve // ni[Header.SUBSTEPS]]
        begun = ti.select(group < ni[Header.ACTION_GROUPS], block, group) >= group
        counts = ti.select(begun, back, 0)
        solves = ti.max(solves, ti.select(back <= ti.min(step, ni[Header.HISTORY]), counts, 0))
    return solves


@ti.func
def unknown_at(start, stride, k):
    """Offset of unknown k of a vector, which is one of the columns unless its stride is one."""
    return start + ti.select(stride == 1, k, COLUMNS_STRIDE * (k // 3) + stride * (k % 3))


@ti.func
def scalar(ni: ti.template(), w: ti.template(), rod, k):
    """Constant of a rod, named by `Scalar`."""
    return w[rod + ni[Section.SCALARS] + k]
