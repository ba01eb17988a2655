"""Compiled motion of the grips: bounded velocities, jerk-limited tracking of them, and stops.

Rows are vectors of three; those of one moment are translation and rotation of each grip in turn.
The formulas of a stop are explained in `lariat.trajectory.stop`.
"""

from lariat.kernel_cache.language import ti

rows_f64 = ti.types.ndarray(dtype=ti.f64, ndim=2)
vector_f64 = ti.types.ndarray(dtype=ti.f64, ndim=1)

TINY = 1e-300
"""Norm of a vector without a direction."""
MIN_NORM = 1e-12
"""Norm below which a motion has no direction in a stop, or an error in tracking [SI]."""
REST_TOLERANCE = 1e-12
"""Rounding error of the summed durations of a stop's phases [s]."""
GRID_TOLERANCE = 1e-9
"""Fraction of a grid step by which a stop may outlast its last time [-]."""


@ti.func
def vector(rows: ti.template(), k: ti.i32):
    return ti.Vector([rows[k, 0], rows[k, 1], rows[k, 2]], dt=ti.f64)


@ti.func
def write(rows: ti.template(), k: ti.i32, value):
    for i in ti.static(range(3)):
        rows[k, i] = value[i]


@ti.func
def clipped(v, bound: ti.f64):
    return v * ti.min(1.0, bound / ti.max(v.norm(), TINY))


@ti.kernel
def bound_velocities(
    initial: rows_f64, velocities: rows_f64, bounds: rows_f64, bounded: rows_f64, dt: ti.f64
):
    """Write velocities within bounds on speed and acceleration, one step after the other.

    Args:
        initial: Velocities before the first step.
        velocities: Velocities at the ends of the steps, all of one moment after the other.
        bounds: Speed, acceleration and jerk of translation and rotation.
        bounded: Receives the velocities.
        dt: Duration of a step [s].
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        count = initial.shape[0]
        for row in range(count):
            last = vector(initial, row)
            for k in range(velocities.shape[0] // count):
                target = clipped(vector(velocities, k * count + row), bounds[row % 2, 0])
                last += clipped(target - last, bounds[row % 2, 1] * dt)
                write(bounded, k * count + row, last)


@ti.kernel
def track_velocities(
    displacement: rows_f64,
    velocity: rows_f64,
    acceleration: rows_f64,
    targets: rows_f64,
    bounds: rows_f64,
    motion: rows_f64,
    gain: ti.f64,
    dt: ti.f64,
):
    """Write the motion that follows wanted velocities, at the ends of equal periods.

    Args:
        displacement: Present displacements.
        velocity: Present velocities.
        acceleration: Present accelerations.
        wanted: Wanted velocities, at present and at the end of each period.
        bounds: Speed, acceleration and jerk of translation and rotation.
        motion: Receives the displacements of all periods, then velocities, then accelerations.
        gain: Share of a small velocity error that is corrected in one period [-].
        dt: Duration of a period [s].
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        count = velocity.shape[0]
        size = targets.shape[0] - count
        for row in range(count):
            speed, most, jerk = bounds[row % 2, 0], bounds[row % 2, 1], bounds[row % 2, 2]
            p, v, a = vector(displacement, row), vector(velocity, row), vector(acceleration, row)
            aim = vector(targets, row)
            for k in range(size // count):
                at = k * count + row
                then = vector(targets, at + count)
                error = clipped(aim, speed) - v
                rate = ti.min(gain / dt, ti.sqrt(jerk / ti.max(error.norm(), MIN_NORM)))
                target = clipped((then - aim) / dt + rate * error, most)
                j = clipped((target - a) / dt, jerk)
                p += dt * (v + dt * (a / 2.0 + dt * j / 6.0))
                v += dt * (a + dt * j / 2.0)
                a += dt * j
                aim = then
                write(motion, at, p)
                write(motion, size + at, v)
                write(motion, 2 * size + at, a)


@ti.func
def stop_durations(v, a, most: ti.f64, jerk: ti.f64):
    """Return the durations of a stop's phases."""
    ease = a.norm() / jerk
    top = (v + a * ease / 2.0).norm()
    ramp = ti.min(most / jerk, ti.sqrt(top / jerk))
    hold = ti.max(top / ti.max(jerk * ramp, MIN_NORM) - ramp, 0.0)
    return ti.Vector([ease, ramp, hold, ramp], dt=ti.f64)


@ti.kernel
def stop_grips(
    twists: rows_f64,
    accelerations: rows_f64,
    bounds: rows_f64,
    motion: rows_f64,
    results: vector_f64,
    dt: ti.f64,
):
    """Write a stop on a time grid, exactly at rest at its end.

    Args:
        twists: Twists at the beginning.
        accelerations: Accelerations at the beginning.
        bounds: Speed, acceleration and jerk of translation and rotation.
        motion: Receives the displacements of all times that fit, then twists, then accelerations.
        results: Receives the number of times.
        dt: Time between them, the first one after the beginning [s].
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        count = twists.shape[0]
        size = motion.shape[0] // 3
        duration = 0.0
        for row in range(count):
            most, jerk = bounds[row % 2, 1], bounds[row % 2, 2]
            phases = stop_durations(vector(twists, row), vector(accelerations, row), most, jerk)
            duration = ti.max(duration, phases.sum())
        times = ti.cast(ti.ceil(duration / dt - GRID_TOLERANCE), ti.i32)
        results[0] = ti.cast(times, ti.f64)
        for row in range(count):
            most, jerk = bounds[row % 2, 1], bounds[row % 2, 2]
            begun, eased = vector(twists, row), vector(accelerations, row)
            phases = stop_durations(begun, eased, most, jerk)
            peak = begun + eased * phases[0] / 2.0
            back = -peak / ti.max(peak.norm(), MIN_NORM) * jerk
            ease = -eased / ti.max(eased.norm(), MIN_NORM) * jerk
            for k in range(ti.min(times, size // count)):
                x, v, a = 0.0 * begun, begun, eased
                left = dt * (k + 1)
                for phase in ti.static(range(4)):
                    tau = ti.min(ti.max(left, 0.0), phases[phase])
                    left -= phases[phase]
                    j = 0.0 * begun
                    if ti.static(phase == 0):
                        j = ease
                    elif ti.static(phase == 1):
                        j = back
                    elif ti.static(phase == 3):
                        j = -back
                    x += tau * (v + tau * (a / 2.0 + tau * j / 6.0))
                    v += tau * (a + tau * j / 2.0)
                    a += tau * j
                if left >= -REST_TOLERANCE or k == times - 1:
                    v, a = 0.0 * begun, 0.0 * begun
                at = k * count + row
                write(motion, at, x)
                write(motion, size + at, v)
                write(motion, 2 * size + at, a)
