"""Compiled motion of the command: its reference, a step of tracking, and the stop after it.

The numbers are those of `lariat.trajectory` and `reference_tracking`, where the formulas are
explained. Columns of a state: position, quaternion wxyz, twist and acceleration, each linear over
angular.
"""

from lariat.kernel_cache.language import ti

rows_f64 = ti.types.ndarray(dtype=ti.f64, ndim=2)
vector_f64 = ti.types.ndarray(dtype=ti.f64, ndim=1)

TWIST = 7
"""First column of the twist in a state."""
ACCELERATION = 13
"""First column of the acceleration in a state."""
TINY = 1e-300
"""Norm of a vector without a direction."""
MIN_NORM = 1e-12
"""Norm below which the motion has no direction in a stop [SI]."""


@ti.func
def vector(rows: ti.template(), k: ti.i32, first: ti.i32):
    return ti.Vector([rows[k, first], rows[k, first + 1], rows[k, first + 2]], dt=ti.f64)


@ti.func
def quaternion(rows: ti.template(), k: ti.i32, first: ti.i32):
    return ti.Vector(
        [rows[k, first], rows[k, first + 1], rows[k, first + 2], rows[k, first + 3]], dt=ti.f64
    )


@ti.func
def write(rows: ti.template(), k: ti.i32, first: ti.i32, value: ti.template()):
    for i in ti.static(range(value.n)):
        rows[k, first + i] = value[i]


@ti.func
def product(a, b):
    """Return the Hamilton product."""
    return ti.Vector(
        [
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        ],
        dt=ti.f64,
    )


@ti.func
def exponential(v):
    """Return the quaternion of a rotation vector."""
    angle = v.norm()
    scale = 0.5
    if angle > 1e-12:
        scale = ti.sin(0.5 * angle) / angle
    return ti.Vector([ti.cos(0.5 * angle), scale * v[0], scale * v[1], scale * v[2]], dt=ti.f64)


@ti.func
def rotation_between(a, b):
    """Return the rotation vector from orientation a to b."""
    q = product(b, ti.Vector([a[0], -a[1], -a[2], -a[3]], dt=ti.f64))
    if q[0] < 0.0:
        q = -q
    v = ti.Vector([q[1], q[2], q[3]], dt=ti.f64)
    sine = v.norm()
    scale = 2.0
    if sine > 1e-12:
        scale = 2.0 * ti.atan2(sine, q[0]) / sine
    return scale * v


@ti.func
def angular_rate(v, rate):
    """Return the angular velocity of exp(v) for the derivative of v."""
    angle = v.norm()
    first, second = 0.5, 1.0 / 6.0
    if angle >= 1e-4:
        first = (1.0 - ti.cos(angle)) / (angle * angle)
        second = (angle - ti.sin(angle)) / (angle * angle * angle)
    turned = v.cross(rate)
    return rate + first * turned + second * v.cross(turned)


@ti.func
def clipped(v, bound: ti.f64):
    return v * ti.min(1.0, bound / ti.max(v.norm(), TINY))


@ti.func
def eased(error, gain: ti.f64, rate: ti.f64):
    return error * ti.min(gain, ti.sqrt(rate / ti.max(error.norm(), TINY)))


@ti.kernel
def evaluate_reference(
    points: rows_f64,
    first: rows_f64,
    mismatch: rows_f64,
    state: rows_f64,
    poses: ti.i32,
    dt: ti.f64,
    u: ti.f64,
    fade: ti.f64,
    duration: ti.f64,
):
    """Write the state of a spline to which a motion fades.

    Args:
        points: Control points, all grips of one after the other: position and rotation vector.
        first: Orientation of each grip from which its rotation vectors are counted.
        mismatch: Pose, twist and acceleration of each grip at the beginning, less the spline's.
        state: Receives the state of each grip.
        poses: Number of poses of the chunk.
        dt: Time between two of them [s].
        u: Time since the first one [dt].
        fade: Time since the fading began, as a fraction of its duration [-].
        duration: Duration of the fading [s].
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        count = state.shape[0]
        k = ti.min(ti.max(ti.cast(ti.floor(u), ti.i32), 0), poses - 1)
        s = ti.min(u - k, 1.0)
        at = ti.max(s, 0.0)
        r = 1.0 - at
        weights = ti.Matrix(
            [
                [
                    r**3 / 6.0,
                    (4.0 - 6.0 * at * at + 3.0 * at**3) / 6.0,
                    (1.0 + 3.0 * at + 3.0 * at * at - 3.0 * at**3) / 6.0,
                    at**3 / 6.0,
                ],
                [
                    -r * r / (2.0 * dt),
                    (3.0 * at * at - 4.0 * at) / (2.0 * dt),
                    (1.0 + 2.0 * at - 3.0 * at * at) / (2.0 * dt),
                    at * at / (2.0 * dt),
                ],
                [r / dt**2, (3.0 * at - 2.0) / dt**2, (1.0 - 3.0 * at) / dt**2, at / dt**2],
            ],
            dt=ti.f64,
        )
        f, T = fade, duration
        basis = ti.Matrix(
            [
                [
                    1.0 - f**3 * (10.0 - f * (15.0 - 6.0 * f)),
                    f - f**3 * (6.0 - f * (8.0 - 3.0 * f)),
                    f * f / 2.0 - f**3 * (1.5 - f * (1.5 - f / 2.0)),
                ],
                [
                    -30.0 * f * f * (1.0 - f) ** 2,
                    1.0 - f * f * (18.0 - f * (32.0 - 15.0 * f)),
                    f - f * f * (4.5 - f * (6.0 - 2.5 * f)),
                ],
                [
                    -60.0 * f * (1.0 - f) * (1.0 - 2.0 * f),
                    -f * (36.0 - f * (96.0 - 60.0 * f)),
                    1.0 - f * (9.0 - f * (18.0 - 10.0 * f)),
                ],
            ],
            dt=ti.f64,
        )
        zero = ti.Vector([0.0, 0.0, 0.0], dt=ti.f64)
        for g in range(count):
            for part in ti.static(range(2)):
                x, v, a = zero, zero, zero
                for i in ti.static(range(4)):
                    p = vector(points, (k + i) * count + g, 3 * part)
                    x += weights[0, i] * p
                    v += weights[1, i] * p
                    a += weights[2, i] * p
                if s < 0.0:
                    x += v * s * dt
                    a = zero
                dx, dv, da = zero, zero, zero
                if fade < 1.0:
                    d = vector(mismatch, g, 3 * part)
                    t = T * vector(mismatch, g, 6 + 3 * part)
                    c = T * T * vector(mismatch, g, 12 + 3 * part)
                    dx = basis[0, 0] * d + basis[0, 1] * t + basis[0, 2] * c
                    dv = (basis[1, 0] * d + basis[1, 1] * t + basis[1, 2] * c) / T
                    da = (basis[2, 0] * d + basis[2, 1] * t + basis[2, 2] * c) / (T * T)
                if ti.static(part == 0):
                    write(state, g, 0, x + dx)
                else:
                    v, a = angular_rate(x, v), angular_rate(x, a)
                    turned = product(exponential(x), quaternion(first, g, 0))
                    write(state, g, 3, product(exponential(dx), turned))
                write(state, g, TWIST + 3 * part, v + dv)
                write(state, g, ACCELERATION + 3 * part, a + da)


@ti.kernel
def advance_command(
    limits: rows_f64,
    state: rows_f64,
    now: rows_f64,
    then: rows_f64,
    target: rows_f64,
    jerks: rows_f64,
    durations: rows_f64,
    path: rows_f64,
    results: vector_f64,
    h: ti.f64,
    spacing: ti.f64,
    lever_arm: ti.f64,
    least: ti.i32,
):
    """Write the command a time later, the stop after it, and the poses at which that is checked.

    Args:
        limits: For translation and rotation: bounds on speed, acceleration and jerk; acceleration,
            position gain and velocity gain of tracking; speed that counts as too fast.
        state: Present command of each grip.
        now: Reference at present.
        then: Reference after the step.
        wanted: Receives the command after the step.
        jerks: Receives the jerks of the stop: phases, grips, translation and rotation in turn.
        durations: Receives the durations of its phases [s].
        path: Receives the present pose of each grip, then poses of the stop, in turn.
        results: Receives the number of poses of the stop, and one if the command is too fast.
        h: Duration of the step [s].
        spacing: Longest motion of a gripper between two poses of the stop [m].
        lever_arm: Farthest point of a gripper's body from its grip [m].
        least: Least number of poses.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        count = state.shape[0]
        too_fast = 0.0
        duration = 0.0
        fastest = 0.0
        for g in range(count):
            reach = 0.0
            for part in ti.static(range(2)):
                twist = vector(state, g, TWIST + 3 * part)
                old = vector(state, g, ACCELERATION + 3 * part)
                error = vector(now, g, 0) - vector(state, g, 0)
                if ti.static(part == 1):
                    error = rotation_between(quaternion(state, g, 3), quaternion(now, g, 3))
                speed, acceleration, jerk = limits[part, 0], limits[part, 1], limits[part, 2]
                goal = vector(now, g, TWIST + 3 * part)
                goal = clipped(goal + eased(error, limits[part, 4], acceleration / 2.0), speed)
                push = vector(then, g, ACCELERATION + 3 * part)
                push = clipped(push + eased(goal - twist, limits[part, 5], jerk), limits[part, 3])
                a = old + clipped(push - old, jerk * h)
                moved = twist * h + (old / 3.0 + a / 6.0) * h * h
                v = twist + (old + a) * (h / 2.0)
                if ti.static(part == 0):
                    write(target, g, 0, vector(state, g, 0) + moved)
                else:
                    q = product(exponential(moved), quaternion(state, g, 3))
                    write(target, g, 3, q / q.norm())
                write(target, g, TWIST + 3 * part, v)
                write(target, g, ACCELERATION + 3 * part, a)
                # The stop removes the acceleration, then the speed.
                size = a.norm()
                peak = v + a * (size / jerk) / 2.0
                top = peak.norm()
                ramp = ti.min(acceleration / jerk, ti.sqrt(top / jerk))
                hold = ti.max(top / ti.max(jerk * ramp, MIN_NORM) - ramp, 0.0)
                backwards = -peak / ti.max(top, MIN_NORM) * jerk
                row = 2 * g + part
                write(jerks, row, 0, -a / ti.max(size, MIN_NORM) * jerk)
                write(jerks, 2 * count + row, 0, backwards)
                write(jerks, 4 * count + row, 0, 0.0 * backwards)
                write(jerks, 6 * count + row, 0, -backwards)
                durations[row, 0] = size / jerk
                durations[2 * count + row, 0] = ramp
                durations[4 * count + row, 0] = hold
                durations[6 * count + row, 0] = ramp
                duration = ti.max(duration, size / jerk + ramp + hold + ramp)
                if top > limits[part, 6] or v.norm() > limits[part, 6]:
                    too_fast = 1.0
                arm = 1.0 if part == 0 else lever_arm
                reach += arm * ti.max(v.norm(), top)
            fastest = ti.max(fastest, reach)
        most = path.shape[0] // count - 1
        poses = ti.cast(ti.min(ti.ceil(fastest * duration / spacing) + 1.0, 1e6), ti.i32)
        poses = ti.min(ti.max(poses, least), most)
        for g in range(count):
            for i in ti.static(range(7)):
                path[g, i] = state[g, i]
            for m in range(poses):
                time = m * (duration / (poses - 1)) if m < poses - 1 else duration
                for part in ti.static(range(2)):
                    moved = ti.Vector([0.0, 0.0, 0.0], dt=ti.f64)
                    v = vector(target, g, TWIST + 3 * part)
                    a = vector(target, g, ACCELERATION + 3 * part)
                    left = time
                    for phase in range(4):
                        row = 2 * count * phase + 2 * g + part
                        tau = ti.min(ti.max(left, 0.0), durations[row, 0])
                        left -= durations[row, 0]
                        j = vector(jerks, row, 0)
                        moved += tau * (v + tau * (a / 2.0 + tau * j / 6.0))
                        v += tau * (a + tau * j / 2.0)
                        a += tau * j
                    row = (m + 1) * count + g
                    if ti.static(part == 0):
                        write(path, row, 0, vector(target, g, 0) + moved)
                    else:
                        write(path, row, 3, product(exponential(moved), quaternion(target, g, 3)))
        results[0] = ti.cast(poses, ti.f64)
        results[1] = too_fast
