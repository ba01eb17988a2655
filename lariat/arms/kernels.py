"""Compiled inverse and forward kinematics of a serial arm along a path of its grip.

Rows of `chain`, each a rotation by rows, a translation [m] and an axis: the placement of every
joint at angle zero in the one before it, with its axis; then flange in last joint, world in base,
flange in grip, and base in world.
"""

from lariat.kernel_cache.language import ti

rows_f64 = ti.types.ndarray(dtype=ti.f64, ndim=2)
vector_f64 = ti.types.ndarray(dtype=ti.f64, ndim=1)

PLACEMENTS = 0
"""Offset of the placements of the joints in the root, in the scratch memory."""
JACOBIAN = 144
"""Offset of the Jacobian's columns: six numbers a joint."""
NORMAL = 216
"""Offset of the normal equations, and of their right side behind them; or of the rotations by
which the Jacobian's columns have become orthogonal."""


@ti.func
def rotation_of(rows: ti.template(), k: ti.i32):
    return ti.Matrix(
        [[rows[k, 3 * i + j] for j in ti.static(range(3))] for i in ti.static(range(3))],
        dt=ti.f64,
    )


@ti.func
def vector_of(rows: ti.template(), k: ti.i32, first: ti.i32):
    return ti.Vector([rows[k, first], rows[k, first + 1], rows[k, first + 2]], dt=ti.f64)


@ti.func
def placed_rotation(scratch: ti.template(), k: ti.i32):
    at = PLACEMENTS + 12 * k
    return ti.Matrix(
        [[scratch[at + 3 * i + j] for j in ti.static(range(3))] for i in ti.static(range(3))],
        dt=ti.f64,
    )


@ti.func
def placed_origin(scratch: ti.template(), k: ti.i32):
    at = PLACEMENTS + 12 * k + 9
    return ti.Vector([scratch[at], scratch[at + 1], scratch[at + 2]], dt=ti.f64)


@ti.func
def place(chain: ti.template(), path: ti.template(), row: ti.i32, scratch: ti.template()):
    """Write the placements of all joints in the root."""
    R = ti.Matrix([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], dt=ti.f64)
    t = ti.Vector([0.0, 0.0, 0.0], dt=ti.f64)
    for k in range(path.shape[1]):
        x, y, z = chain[k, 12], chain[k, 13], chain[k, 14]
        K = ti.Matrix([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]], dt=ti.f64)
        angle = path[row, k]
        one = ti.Matrix([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], dt=ti.f64)
        turned = one + ti.sin(angle) * K + (1.0 - ti.cos(angle)) * (K @ K)
        t = R @ vector_of(chain, k, 9) + t
        R = R @ (rotation_of(chain, k) @ turned)
        for i in ti.static(range(3)):
            scratch[PLACEMENTS + 12 * k + 9 + i] = t[i]
            for j in ti.static(range(3)):
                scratch[PLACEMENTS + 12 * k + 3 * i + j] = R[i, j]


@ti.func
def flange_origin(chain: ti.template(), joints: ti.i32, scratch: ti.template()):
    R = placed_rotation(scratch, joints - 1)
    return R @ vector_of(chain, joints, 9) + placed_origin(scratch, joints - 1)


@ti.func
def write_jacobian(chain: ti.template(), joints: ti.i32, R, t, scratch: ti.template()):
    """Write the twist of a point at t, along the axes R, for each joint's unit speed."""
    for k in range(joints):
        axis = placed_rotation(scratch, k) @ vector_of(chain, k, 12)
        linear = R.transpose() @ axis.cross(t - placed_origin(scratch, k))
        angular = R.transpose() @ axis
        for i in ti.static(range(3)):
            scratch[JACOBIAN + 6 * k + i] = linear[i]
            scratch[JACOBIAN + 6 * k + 3 + i] = angular[i]


@ti.func
def rotation_vector(R):
    """Return the logarithm of a rotation."""
    axis = 0.5 * ti.Vector([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]], dt=ti.f64)
    sine, cosine = axis.norm(), 0.5 * (R[0, 0] + R[1, 1] + R[2, 2] - 1.0)
    scale = 1.0
    if sine > 1e-9 or cosine < 0.0:
        scale = ti.atan2(sine, cosine) / ti.max(sine, 1e-12)
    return scale * axis


@ti.func
def pose_error(R, p):
    """Return the logarithm of a pose in SE(3), linear over angular (Lynch & Park, 2017, 3.25)."""
    w = rotation_vector(R)
    square = w.dot(w)
    alpha, beta = 1.0 - square / 12.0 - square**2 / 720.0, 1.0 / 12.0 + square / 720.0
    if square > 1e-6:
        angle = ti.sqrt(square)
        alpha = angle * ti.sin(angle) / (2.0 * (1.0 - ti.cos(angle)))
        beta = (1.0 - alpha) / square
    v = alpha * p - 0.5 * w.cross(p) + beta * w.dot(p) * w
    return ti.Vector([v[0], v[1], v[2], w[0], w[1], w[2]], dt=ti.f64)


@ti.func
def newton_step(joints: ti.i32, error, damping: ti.f64, scratch: ti.template()):
    """Replace the right side by the damped Newton step, by Cholesky's decomposition."""
    right = NORMAL + joints * joints
    for a in range(joints):
        total = 0.0
        for i in ti.static(range(6)):
            total += scratch[JACOBIAN + 6 * a + i] * error[i]
        scratch[right + a] = total
        for b in range(a + 1):
            entry = damping if a == b else 0.0
            for i in ti.static(range(6)):
                entry += scratch[JACOBIAN + 6 * a + i] * scratch[JACOBIAN + 6 * b + i]
            for c in range(b):
                entry -= scratch[NORMAL + joints * a + c] * scratch[NORMAL + joints * b + c]
            if a == b:
                entry = ti.sqrt(ti.max(entry, 1e-300))
            else:
                entry /= scratch[NORMAL + joints * b + b]
            scratch[NORMAL + joints * a + b] = entry
    for a in range(joints):
        for c in range(a):
            scratch[right + a] -= scratch[NORMAL + joints * a + c] * scratch[right + c]
        scratch[right + a] /= scratch[NORMAL + joints * a + a]
    for back in range(joints):
        a = joints - 1 - back
        for c in range(a + 1, joints):
            scratch[right + a] -= scratch[NORMAL + joints * c + a] * scratch[right + c]
        scratch[right + a] /= scratch[NORMAL + joints * a + a]


@ti.func
def orthogonalize(joints: ti.i32, scratch: ti.template(), keeps: ti.template()):
    """Make the Jacobian's columns orthogonal, so that their norms are its singular values.

    One-sided Jacobi rotations (Hestenes, 1958), whose product is kept on demand.
    """
    if ti.static(keeps):
        for k in range(joints * joints):
            scratch[NORMAL + k] = 1.0 if k // joints == k % joints else 0.0
    rotated = 1
    sweep = 0
    while rotated == 1 and sweep < 40:
        rotated = 0
        sweep += 1
        for b in range(1, joints):
            for a in range(b):
                p, q = JACOBIAN + 6 * a, JACOBIAN + 6 * b
                pp, qq, pq = 0.0, 0.0, 0.0
                for i in ti.static(range(6)):
                    pp += scratch[p + i] * scratch[p + i]
                    qq += scratch[q + i] * scratch[q + i]
                    pq += scratch[p + i] * scratch[q + i]
                if pq * pq > 1e-31 * pp * qq:
                    rotated = 1
                    zeta = (qq - pp) / (2.0 * pq)
                    tangent = 1.0 / (ti.abs(zeta) + ti.sqrt(1.0 + zeta * zeta))
                    tangent = tangent if zeta >= 0.0 else -tangent
                    cosine = 1.0 / ti.sqrt(1.0 + tangent * tangent)
                    sine = cosine * tangent
                    for i in ti.static(range(6)):
                        x, y = scratch[p + i], scratch[q + i]
                        scratch[p + i] = cosine * x - sine * y
                        scratch[q + i] = sine * x + cosine * y
                    if ti.static(keeps):
                        for k in range(joints):
                            x = scratch[NORMAL + joints * a + k]
                            y = scratch[NORMAL + joints * b + k]
                            scratch[NORMAL + joints * a + k] = cosine * x - sine * y
                            scratch[NORMAL + joints * b + k] = sine * x + cosine * y


@ti.func
def column_square(k: ti.i32, scratch: ti.template()):
    square = 0.0
    for i in ti.static(range(6)):
        square += scratch[JACOBIAN + 6 * k + i] * scratch[JACOBIAN + 6 * k + i]
    return square


@ti.func
def smallest_singular_value(joints: ti.i32, exact: ti.f64, scratch: ti.template()):
    """Return the smallest singular value of the Jacobian; a lower bound where that is large.

    It is at least the reciprocal of the inverse's Frobenius norm, which the Cholesky factor of the
    normal equations gives in a fraction of the time. Both overwrite scratch memory.
    """
    value = inverse_norm_bound(joints, scratch)
    if value < exact:
        orthogonalize(joints, scratch, False)
        least = 1e300
        for a in range(joints):
            least = ti.min(least, column_square(a, scratch))
        value = ti.sqrt(least)
    return value


@ti.func
def inverse_norm_bound(joints: ti.i32, scratch: ti.template()):
    """Return a lower bound on the smallest singular value; zero where there is no inverse."""
    total = 0.0
    valid = 1
    for a in range(joints):
        for b in range(a + 1):
            entry = 0.0
            for i in ti.static(range(6)):
                entry += scratch[JACOBIAN + 6 * a + i] * scratch[JACOBIAN + 6 * b + i]
            diagonal = entry
            for c in range(b):
                entry -= scratch[NORMAL + joints * a + c] * scratch[NORMAL + joints * b + c]
            if a == b:
                # Rounding must not count as a distance from a singularity.
                valid = valid if entry > 1e-9 * diagonal else 0
                entry = ti.sqrt(ti.max(entry, 1e-300))
            else:
                entry /= scratch[NORMAL + joints * b + b]
            scratch[NORMAL + joints * a + b] = entry
    # Columns of the factor's inverse, one after the other in place of the right side.
    column = NORMAL + joints * joints
    for b in range(joints):
        for a in range(b, joints):
            entry = 1.0 if a == b else 0.0
            for c in range(b, a):
                entry -= scratch[NORMAL + joints * a + c] * scratch[column + c]
            entry /= scratch[NORMAL + joints * a + a]
            scratch[column + a] = entry
            total += entry * entry
    return (1.0 - 1e-6) / ti.sqrt(total) if valid == 1 else 0.0


@ti.kernel
def follow_path(
    chain: rows_f64,
    grips: rows_f64,
    path: rows_f64,
    spheres: rows_f64,
    centres: rows_f64,
    singular_values: vector_f64,
    scratch: vector_f64,
    damping: ti.f64,
    step_limit: ti.f64,
    tolerance: ti.f64,
    iterations: ti.i32,
    exact: ti.f64,
    poses: ti.i32,
    rows: ti.i32,
):
    """Solve joints along a path of the grip, each from those before; place links and Jacobian.

    Args:
        chain: The arm, rows as above.
        grips: Poses of the grip in the world, position and quaternion wxyz.
        path: Joints: the first row at the beginning, then one for each grip.
        spheres: Joint and centre of each sphere that covers a link [m].
        centres: Receives their centres in the world, for each row of the path in turn [m].
        singular_values: Receives the smallest singular value of the Jacobian for each row of the
            path, exact below a value, and from there on a lower bound of as much; of an arm with
            up to six joints.
        scratch: Memory; the first number becomes the count of grips that were solved.
        damping: Damping of the normal equations.
        step_limit: Largest change of a joint in one step [rad].
        tolerance: Error of a pose that is solved [m, rad].
        iterations: Most steps.
        exact: Singular value from which on a lower bound serves [m/rad].
        poses: Number of poses of the grip; none where the path is given.
        rows: Number of rows of the path whose links and Jacobian are wanted.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        joints = path.shape[1]
        Rg, tg = rotation_of(chain, joints + 2), vector_of(chain, joints + 2, 9)
        Rb, tb = rotation_of(chain, joints + 1), vector_of(chain, joints + 1, 9)
        solved = 0
        for m in range(poses):
            w, x, y, z = grips[m, 3], grips[m, 4], grips[m, 5], grips[m, 6]
            Rq = ti.Matrix(
                [
                    [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
                    [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
                    [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
                ],
                dt=ti.f64,
            )
            goal_R = Rb @ Rq @ Rg
            goal_t = Rb @ (Rq @ tg + vector_of(grips, m, 0)) + tb
            solved_here = 0
            if solved == m:
                for k in range(joints):
                    path[m + 1, k] = path[m, k]
                step = 0
                while solved_here == 0 and step < iterations:
                    step += 1
                    place(chain, path, m + 1, scratch)
                    R = placed_rotation(scratch, joints - 1) @ rotation_of(chain, joints)
                    t = flange_origin(chain, joints, scratch)
                    error = pose_error(R.transpose() @ goal_R, R.transpose() @ (goal_t - t))
                    if ti.abs(error).max() < tolerance:
                        solved_here = 1
                    else:
                        write_jacobian(chain, joints, R, t, scratch)
                        newton_step(joints, error, damping, scratch)
                        right = NORMAL + joints * joints
                        largest = 1e-12
                        for k in range(joints):
                            largest = ti.max(largest, ti.abs(scratch[right + k]))
                        share = ti.min(1.0, step_limit / largest)
                        for k in range(joints):
                            path[m + 1, k] += share * scratch[right + k]
            solved += solved_here
        if solved == poses:
            world, base = rotation_of(chain, joints + 3), vector_of(chain, joints + 3, 9)
            one = ti.Matrix([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], dt=ti.f64)
            for m in range(rows):
                place(chain, path, m, scratch)
                for s in range(spheres.shape[0]):
                    joint = ti.cast(spheres[s, 0], ti.i32)
                    at = placed_rotation(scratch, joint) @ vector_of(spheres, s, 1)
                    at = world @ (at + placed_origin(scratch, joint)) + base
                    for i in ti.static(range(3)):
                        centres[m * spheres.shape[0] + s, i] = at[i]
                write_jacobian(chain, joints, one, flange_origin(chain, joints, scratch), scratch)
                singular_values[m] = smallest_singular_value(joints, exact, scratch)
        scratch[0] = ti.cast(solved, ti.f64)


@ti.kernel
def joint_speeds(
    chain: rows_f64,
    path: rows_f64,
    velocity: rows_f64,
    speeds: vector_f64,
    scratch: vector_f64,
    cutoff: ti.f64,
):
    """Write the joint speeds of least norm for a twist of the grip.

    Args:
        chain: The arm, rows as above.
        path: Joints, in one row.
        velocity: Linear and angular velocity of the grip in the world, in a row each.
        speeds: Receives the speeds of up to six joints [rad/s].
        scratch: Memory.
        cutoff: Share of the largest singular value below which one counts as zero [-].
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        joints = path.shape[1]
        place(chain, path, 0, scratch)
        base = rotation_of(chain, joints + 1)
        flange = placed_rotation(scratch, joints - 1) @ rotation_of(chain, joints)
        # Of the grip's pose in the flange, the inverse stands in the chain.
        back = rotation_of(chain, joints + 2)
        lever = -(flange @ (back.transpose() @ vector_of(chain, joints + 2, 9)))
        angular = base @ vector_of(velocity, 1, 0)
        linear = base @ vector_of(velocity, 0, 0) - angular.cross(lever)
        one = ti.Matrix([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], dt=ti.f64)
        write_jacobian(chain, joints, one, flange_origin(chain, joints, scratch), scratch)
        orthogonalize(joints, scratch, True)
        largest = 0.0
        for k in range(joints):
            speeds[k] = 0.0
            largest = ti.max(largest, column_square(k, scratch))
        for a in range(joints):
            square = column_square(a, scratch)
            if square > cutoff * cutoff * largest:
                share = 0.0
                for i in ti.static(range(3)):
                    share += scratch[JACOBIAN + 6 * a + i] * linear[i]
                    share += scratch[JACOBIAN + 6 * a + 3 + i] * angular[i]
                for k in range(joints):
                    speeds[k] += scratch[NORMAL + joints * a + k] * share / square
