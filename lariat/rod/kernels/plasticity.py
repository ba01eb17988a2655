"""Set of bends: parallel elastic-perfectly plastic layers, each with a return of its own.

A bend u of rest r, over the length L, has the stiffnesses K = (k1, k1, k3) [N m], and layers that
bear shares s_l of them up to limits y_l of curvature [1/m] (Iwan, J. Appl. Mech. 1967). With what a
layer keeps from the solve before, p_l [1/m],

    e = u - r - L p_l,                  |e|^2 = e1^2 + e2^2 + (k3 / k1) e3^2,
    m_l = s_l K e                       where |e| <= L y_l: it stays elastic,
    m_l = s_l K e L y_l / |e|           else: it yields, and p_l grows by (1 / L - y_l / |e|) e.

The rest of the stiffness is elastic. The energy of a layer grows with |e|^2 up to the limit and
linearly beyond it: it is convex, and its Hessian symmetric. All layers together are a bend whose
rest is r + L sum_l s_l p_l, less the share s_l k1 (|e| - L y_l)^2 / 2 of each layer that yields,
which is what the functions here add. In such a layer, by the matrix

    D = (1 - L y / |e|) I + L y / |e|^3 e (e1, e2, e3 k3 / k1)^T,

p_l grows with u by D / L, and m_l by s_l K (I - D).
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import (
    hessian_at,
    parameter_code_at,
    scalar,
    sensitivity_columns_at,
    steady_groups,
    time_at,
)
from lariat.rod.kernels.memory import (
    add,
    add33,
    bounded,
    load3,
    load_column,
    load_lane3,
    store,
    store_column,
)
from lariat.rod.kernels.step_terms import (
    add_parameter_derivative,
    bend_rotation,
    bend_share,
    moment_curvature,
)
from lariat.rod.kernels.types import Doubles, Integers
from lariat.rod.launch.codes import Derivatives, HessianPart
from lariat.rod.launch.layout import (
    BEND_LANE_ROTATION,
    COLUMNS_STRIDE,
    COLUMNS_WIDTH,
    GROUP_COLUMNS,
    HISTORY_SLOTS,
    LAYER_WIDTH,
    Header,
    LayerRow,
    ParameterCode,
    Scalar,
    Section,
    TimeRow,
)


@ti.func
def set_at(ni: ti.template(), rod, slot, j):
    """Offset of the set of the layers of bend j before solve `slot`; after it, at slot + 1."""
    kept = ti.select(ni[Header.DERIVATIVES] >= Derivatives.ADJOINT, slot, slot & 1)
    bends = ni[Header.NODES] - 2
    return rod + ni[Section.SETS] + 3 * ni[Header.LAYERS] * (kept * bends + j)


@ti.func
def layer_at(ni: ti.template(), rod, k):
    """Offset of the `LayerRow` of layer k."""
    return rod + ni[Section.LAYERS] + LAYER_WIDTH * k


@ti.func
def bend_length(ni: ti.template(), w: ti.template(), rod, j):
    """Length over which bend j acts [m]."""
    left = ni[Header.FIRST_EDGE]
    right = ni[Header.NODES] - 1 - ni[Header.END_EDGE]
    share = bend_share(j, ni[Header.NODES] - 2, left, right)
    return share * scalar(ni, w, rod, Scalar.EDGE_LENGTH)


@ti.func
def kept_rest(ni: ti.template(), w: ti.template(), rod, step, j, k):
    """Shift of the rest of bend j by its layer k [rad]."""
    kept = load3(w, set_at(ni, rod, step, j) + 3 * k)
    return (w[layer_at(ni, rod, k) + LayerRow.SHARE] * bend_length(ni, w, rod, j)) * kept


@ti.func
def elastic_part(ni: ti.template(), w: ti.template(), rod, step, j, k, u):
    """Elastic part e of a bend u before the return, and a vector whose product with it is |e|^2."""
    bend = rod + ni[Section.BENDS] + 6 * j
    length = bend_length(ni, w, rod, j)
    e = u - load3(w, bend + 3) - length * load3(w, set_at(ni, rod, step, j) + 3 * k)
    return e, ti.Vector([e[0], e[1], w[bend + 2] / w[bend] * e[2]])


@ti.func
def layer_return(ni: ti.template(), w: ti.template(), rod, step, j, k, u):
    """Elastic part e of a bend u before the return, kept share L y / |e| of it, |e|, and D."""
    length = bend_length(ni, w, rod, j)
    e, scaled = elastic_part(ni, w, rod, step, j, k, u)
    size = ti.sqrt(e.dot(scaled)) + 1e-300
    kept = ti.min(1.0, length * w[layer_at(ni, rod, k) + LayerRow.LIMIT] / size)
    slope = (ti.select(kept < 1.0, kept, 0.0) / (size * size)) * e.outer_product(scaled)
    for a in ti.static(range(3)):
        slope[a, a] += 1.0 - kept
    return e, kept, size, slope


@ti.func
def layer_stiffness(ni: ti.template(), w: ti.template(), rod, j, k):
    """Stiffnesses s K of layer k of bend j [N m]."""
    share = w[layer_at(ni, rod, k) + LayerRow.SHARE]
    return share * load3(w, rod + ni[Section.BENDS] + 6 * j)


@ti.real_func
def plastic_energy(
    ni: Integers,
    w: Doubles,
    rod: ti.i32,
    step: ti.i32,
    part: ti.i32,
    secant: ti.f64,
    first: ti.i32,
    count: ti.i32,
) -> ti.f64:
    """Add energy, gradient and Hessian of what layers leave out as they yield.

    Their bends are those of a strip, whose rotations are in its lanes. The secant stiffness is
    above that of the Hessian: its steps never go too far.
    """
    energy = 0.0
    curved = ti.select(part == HessianPart.POSITIVE, 0.0, 1.0)
    for j in range(first, first + count):
        lane = rod + ni[Section.LANES] + j - first
        bent_by = load_lane3(w, bounded(lane), BEND_LANE_ROTATION)
        length = bend_length(ni, w, rod, j)
        moment = ti.Vector([0.0, 0.0, 0.0])
        tangent = ti.Matrix.zero(ti.f64, 3, 3)
        yields = False
        for k in range(ni[Header.LAYERS]):
            elastic, scaled = elastic_part(ni, w, rod, step, j, k, bent_by)
            limit = length * w[layer_at(ni, rod, k) + LayerRow.LIMIT]
            if elastic.dot(scaled) > limit * limit:
                yields = True
                e, kept, size, slope = layer_return(ni, w, rod, step, j, k, bent_by)
                stiffness = layer_stiffness(ni, w, rod, j, k)
                left_out = (1.0 - kept) * size
                energy -= 0.5 * stiffness[0] * left_out * left_out
                moment -= (1.0 - kept) * (stiffness * e)
                slope *= 1.0 - secant
                for a in ti.static(range(3)):
                    slope[a, a] += secant * (1.0 - kept)
                    for b in ti.static(range(3)):
                        tangent[a, b] -= stiffness[a] * slope[a, b]
        if yields:
            u, left_inverse, c, d = bend_rotation(ni, w, rod, step + HISTORY_SLOTS, j)
            right_inverse = left_inverse.transpose()
            g = rod + ni[Section.GRADIENT] + 6 * j
            add(w, g + 3, -(right_inverse @ moment))
            add(w, g + 9, left_inverse @ moment)
            if part != HessianPart.NONE:
                bent, cross = moment_curvature(u, moment, c, d, curved)
                rear = right_inverse @ tangent + bent - cross
                front = left_inverse @ tangent + bent + cross
                m = hessian_at(ni, rod, step, 2 * j + 1)
                here = rear @ left_inverse
                there = front @ right_inverse
                add33(w, m, 0.5 * (here + here.transpose()))
                add33(w, m + 54, 0.5 * (there + there.transpose()))
                add33(w, m + 18, -(front @ left_inverse))
    return energy


@ti.real_func
def update_sets(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32) -> ti.i32:
    """Set what the layers keep after a solve; without `TimeRow.YIELDS`, what they kept before."""
    yields = w[time_at(ni, rod, step) + TimeRow.YIELDS]
    for j in range(ni[Header.NODES] - 2):
        u, _inverse, _c, _d = bend_rotation(ni, w, rod, step + HISTORY_SLOTS, j)
        length = bend_length(ni, w, rod, j)
        for k in range(ni[Header.LAYERS]):
            e, scaled = elastic_part(ni, w, rod, step, j, k, u)
            limit = length * w[layer_at(ni, rod, k) + LayerRow.LIMIT]
            size2 = e.dot(scaled)
            kept = load3(w, set_at(ni, rod, step, j) + 3 * k)
            if size2 > limit * limit:
                kept += (yields * (1.0 - limit / ti.sqrt(size2)) / length) * e
            store(w, set_at(ni, rod, step + 1, j) + 3 * k, kept)
    return 0


@ti.func
def return_by_parameter(ni: ti.template(), w: ti.template(), rod, step, j, k, u, p):
    """Derivative of what layer k of bend j keeps in parameter p, at a given bend [1/m]."""
    code = ni[parameter_code_at(ni, p)]
    e, kept, size, slope = layer_return(ni, w, rod, step, j, k, u)
    bend = rod + ni[Section.BENDS] + 6 * j
    length = bend_length(ni, w, rod, j)
    edges = ni[Header.END_EDGE] - ni[Header.FIRST_EDGE]
    per_length = 1.0 / (edges * scalar(ni, w, rod, Scalar.EDGE_LENGTH))
    rest = load3(w, bend + 3) + length * load3(w, set_at(ni, rod, step, j) + 3 * k)
    by_rest = slope[:, 0]
    by_rest = ti.select(code == ParameterCode.REST_CURVATURE_1 + 1, slope[:, 1], by_rest)
    by_rest = ti.select(code == ParameterCode.REST_TWIST, slope[:, 2], by_rest)
    # The ratio of the stiffnesses weighs the twist in |e|.
    by_ratio = 0.5 * kept * (w[bend + 2] / w[bend]) * (e[2] / size) * (e[2] / size) / length
    bending = scalar(ni, w, rod, Scalar.BENDING_STIFFNESS)
    twisting = scalar(ni, w, rod, Scalar.TWISTING_STIFFNESS)
    derivative = -knot_share(ni, p, j) * by_rest
    curvature = code >= ParameterCode.REST_CURVATURE_1 and code <= ParameterCode.REST_TWIST
    derivative = ti.select(curvature, derivative, 0.0)
    limit = w[layer_at(ni, rod, k) + LayerRow.BY_YIELD] / size
    derivative = ti.select(code == ParameterCode.YIELD_CURVATURE, -limit * e, derivative)
    derivative = ti.select(
        code == ParameterCode.BENDING_STIFFNESS, -(by_ratio / bending) * e, derivative
    )
    derivative = ti.select(
        code == ParameterCode.TWISTING_STIFFNESS, (by_ratio / twisting) * e, derivative
    )
    derivative = ti.select(
        code == ParameterCode.LENGTH, -(per_length / length) * (e + slope @ rest), derivative
    )
    return ti.select(kept < 1.0, derivative, 0.0)


@ti.func
def knot_share(ni: ti.template(), p, j):
    """Share of the knot of parameter p in bend j."""
    knot = ni[parameter_code_at(ni, p) + 1]
    knots = ni[parameter_code_at(ni, p) + 2]
    first = ni[Header.FIRST_EDGE]
    edges = ni[Header.END_EDGE] - first
    coordinate = ti.cast((j + 1 - first) * (knots - 1), ti.f64) / edges
    return ti.select(knots > 1, ti.max(0.0, 1.0 - ti.abs(coordinate - knot)), 1.0)


@ti.real_func
def plastic_parameter_derivatives(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32) -> ti.i32:
    """Add what layers leave out to the derivatives in parameters: -s K L times the growth of p_l.

    K L, and what the layers keep before, do not depend on the length.
    """
    edges = ni[Header.END_EDGE] - ni[Header.FIRST_EDGE]
    per_length = 1.0 / (edges * scalar(ni, w, rod, Scalar.EDGE_LENGTH))
    for p in range(ni[Header.PARAMETERS]):
        code = ni[parameter_code_at(ni, p)]
        for j in range(ni[Header.NODES] - 2):
            u, inverse, _c, _d = bend_rotation(ni, w, rod, step + HISTORY_SLOTS, j)
            length = bend_length(ni, w, rod, j)
            # Relative derivatives of the stiffnesses.
            grows = ti.Vector([0.0, 0.0, 0.0])
            if code == ParameterCode.BENDING_STIFFNESS:
                grows[0] = 1.0 / scalar(ni, w, rod, Scalar.BENDING_STIFFNESS)
                grows[1] = grows[0]
            elif code == ParameterCode.TWISTING_STIFFNESS:
                grows[2] = 1.0 / scalar(ni, w, rod, Scalar.TWISTING_STIFFNESS)
            elif code == ParameterCode.STIFFNESS_PROFILE:
                whole = length * w[rod + ni[Section.BENDS] + 6 * j]
                share = knot_share(ni, p, j) * scalar(ni, w, rod, Scalar.BENDING_STIFFNESS) / whole
                grows = ti.Vector([share, share, share])
            moment = ti.Vector([0.0, 0.0, 0.0])
            for k in range(ni[Header.LAYERS]):
                e, kept, _size, _slope = layer_return(ni, w, rod, step, j, k, u)
                stiffness = layer_stiffness(ni, w, rod, j, k)
                by_return = return_by_parameter(ni, w, rod, step, j, k, u, p)
                moment -= stiffness * ((1.0 - kept) * (grows * e) + length * by_return)
                if code == ParameterCode.LENGTH:
                    before = load3(w, set_at(ni, rod, step, j) + 3 * k)
                    moment -= (per_length * length) * (stiffness * before)
            add_parameter_derivative(ni, w, rod, p, 2 * j + 1, -(inverse.transpose() @ moment))
            add_parameter_derivative(ni, w, rod, p, 2 * j + 3, inverse @ moment)
    return 0


@ti.func
def set_columns_at(ni: ti.template(), rod, group, j):
    """Offset of the columns of the sets of bend j, for a group."""
    place = (group * (ni[Header.NODES] - 2) + j) * ni[Header.LAYERS]
    return bounded(rod + ni[Section.SET_SENSITIVITIES] + COLUMNS_WIDTH * place)


@ti.real_func
def plastic_sensitivities(
    ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32, group: ti.i32
) -> ti.i32:
    """Subtract from a group of columns what the layers take over from before the solve."""
    first = ni[Header.FIRST_FREE]
    end = ni[Header.END_FREE]
    start = sensitivity_columns_at(ni, rod, group)[0]
    moments = bounded(rod + ni[Section.LANES])
    for j in range(ni[Header.NODES] - 2):
        u, inverse, _c, _d = bend_rotation(ni, w, rod, step + HISTORY_SLOTS, j)
        length = bend_length(ni, w, rod, j)
        at = bounded(start + COLUMNS_STRIDE * (2 * j + 1))
        for k in range(ni[Header.LAYERS]):
            _e, _kept, _size, slope = layer_return(ni, w, rod, step, j, k, u)
            stiffness = length * layer_stiffness(ni, w, rod, j, k)
            columns = set_columns_at(ni, rod, group, j) + COLUMNS_WIDTH * k
            for c in range(GROUP_COLUMNS):
                v = load_column(w, columns + c)
                moment = ti.select(k > 0, load_column(w, moments + c), 0.0)
                store_column(w, moments + c, moment + stiffness * (v - slope @ v))
        # Blocks that grips drive take no part.
        near = ti.select(2 * j + 1 >= first, 1.0, 0.0) * inverse.transpose()
        far = ti.select(2 * j + 3 < end, 1.0, 0.0) * inverse
        for c in range(GROUP_COLUMNS):
            moment = load_column(w, moments + c)
            store_column(w, at + c, load_column(w, at + c) - near @ moment)
            to = at + 2 * COLUMNS_STRIDE + c
            store_column(w, to, load_column(w, to) + far @ moment)
    return 0


@ti.real_func
def set_sensitivities(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32, group: ti.i32) -> ti.i32:
    """Carry the columns of the sets over a solve, after those of the unknowns."""
    driven = ni[Header.ACTION_GROUPS]
    start = sensitivity_columns_at(ni, rod, group)[0]
    for j in range(ni[Header.NODES] - 2):
        u, inverse, _c, _d = bend_rotation(ni, w, rod, step + HISTORY_SLOTS, j)
        length = bend_length(ni, w, rod, j)
        at = bounded(start + COLUMNS_STRIDE * (2 * j + 1))
        for k in range(ni[Header.LAYERS]):
            _e, kept, _size, slope = layer_return(ni, w, rod, step, j, k, u)
            if kept < 1.0:
                columns = set_columns_at(ni, rod, group, j) + COLUMNS_WIDTH * k
                for c in range(GROUP_COLUMNS):
                    turned = inverse.transpose() @ load_column(w, at + 2 * COLUMNS_STRIDE + c)
                    turned -= inverse @ load_column(w, at + c)
                    v = load_column(w, columns + c)
                    v += slope @ (turned / length - v)
                    p = (group - driven) * GROUP_COLUMNS + c
                    if group >= driven and group < steady_groups(ni) and p < ni[Header.PARAMETERS]:
                        v += return_by_parameter(ni, w, rod, step, j, k, u, p)
                    store_column(w, columns + c, v)
    return 0


@ti.real_func
def seed_sets(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32) -> ti.i32:
    """Carry the adjoint of the sets after a solve on to its unknowns."""
    new = rod + ni[Section.ADJOINT] + 3 * (2 * ni[Header.NODES] - 1) * (step + HISTORY_SLOTS)
    for j in range(ni[Header.NODES] - 2):
        u, inverse, _c, _d = bend_rotation(ni, w, rod, step + HISTORY_SLOTS, j)
        carried = ti.Vector([0.0, 0.0, 0.0])
        for k in range(ni[Header.LAYERS]):
            _e, _kept, _size, slope = layer_return(ni, w, rod, step, j, k, u)
            carried += slope.transpose() @ load3(w, set_adjoint_at(ni, rod, j) + 3 * k)
        carried /= bend_length(ni, w, rod, j)
        add(w, new + 6 * j + 3, -(inverse.transpose() @ carried))
        add(w, new + 6 * j + 9, inverse @ carried)
    return 0


@ti.func
def set_adjoint_at(ni: ti.template(), rod, j):
    """Offset of the adjoint of the sets of bend j."""
    return rod + ni[Section.SET_ADJOINT] + 3 * ni[Header.LAYERS] * j


@ti.real_func
def plastic_adjoint(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32) -> ti.i32:
    """Carry the adjoint of a solve over the layers to the sets before it."""
    first = ni[Header.FIRST_FREE]
    end = ni[Header.END_FREE]
    new = rod + ni[Section.ADJOINT] + 3 * (2 * ni[Header.NODES] - 1) * (step + HISTORY_SLOTS)
    for j in range(ni[Header.NODES] - 2):
        u, inverse, _c, _d = bend_rotation(ni, w, rod, step + HISTORY_SLOTS, j)
        bent = ti.Vector([0.0, 0.0, 0.0])
        if 2 * j + 1 >= first:
            bent -= inverse @ load3(w, new + 6 * j + 3)
        if 2 * j + 3 < end:
            bent += inverse.transpose() @ load3(w, new + 6 * j + 9)
        for k in range(ni[Header.LAYERS]):
            _e, _kept, _size, slope = layer_return(ni, w, rod, step, j, k, u)
            at = set_adjoint_at(ni, rod, j) + 3 * k
            carried = load3(w, at)
            for p in range(ni[Header.PARAMETERS]):
                to = rod + ni[Section.PARAMETERS_OUT] + p
                w[to] = w[to] + carried.dot(return_by_parameter(ni, w, rod, step, j, k, u, p))
            carried += bend_length(ni, w, rod, j) * (layer_stiffness(ni, w, rod, j, k) * bent)
            store(w, at, carried - slope.transpose() @ carried)
    return 0
