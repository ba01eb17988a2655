"""Compiled distances of spheres, which cover grippers and links, from obstacles and each other.

Columns of `obstacles`: shape as in `lariat.geometry.obstacles.pack`; position; rotation, local to
world, by rows; sizes as packed; radius of the bounding sphere; sign of the distance. Half spaces
come last.
"""

import taichi as ti

rows_f64 = ti.types.ndarray(dtype=ti.f64, ndim=2)
vector_f64 = ti.types.ndarray(dtype=ti.f64, ndim=1)

FAR = 1e9
"""Slack where there is no obstacle [m]; the compiler knows no infinity."""
HALF_SPACE = 4
"""Code of a half space."""


@ti.func
def point(rows: ti.template(), k: ti.i32):
    return ti.Vector([rows[k, 0], rows[k, 1], rows[k, 2]], dt=ti.f64)


@ti.func
def signed_distance(obstacles: ti.template(), k: ti.i32, at):
    """Return the distance of a point from an obstacle, negative inside."""
    shape = ti.cast(obstacles[k, 0], ti.i32)
    offset = at - ti.Vector([obstacles[k, 1], obstacles[k, 2], obstacles[k, 3]], dt=ti.f64)
    local = ti.Vector([0.0, 0.0, 0.0], dt=ti.f64)
    for i in ti.static(range(3)):
        for j in ti.static(range(3)):
            local[i] += obstacles[k, 4 + 3 * j + i] * offset[j]
    a, b, c = obstacles[k, 13], obstacles[k, 14], obstacles[k, 15]
    distance = FAR
    if shape == 0:
        radial = ti.sqrt(local[0] * local[0] + local[1] * local[1]) - a
        axial = ti.abs(local[2]) - b
        beside, beyond = ti.max(radial, 0.0), ti.max(axial, 0.0)
        distance = ti.sqrt(beside * beside + beyond * beyond) + ti.min(ti.max(radial, axial), 0.0)
    elif shape == 1:
        excess = ti.abs(local) - ti.Vector([a, b, c], dt=ti.f64)
        distance = ti.max(excess, 0.0).norm() + ti.min(excess.max(), 0.0)
    elif shape == 2:
        distance = local.norm() - a
    elif shape == 3:
        local[2] -= ti.max(ti.min(local[2], b), -b)
        distance = local.norm() - a
    else:
        distance = local[0] * a + local[1] * b + local[2] * c
    return distance * obstacles[k, 17]


@ti.func
def write_slacks(
    centres: ti.template(),
    radii: ti.template(),
    obstacles: ti.template(),
    keep_out: ti.f64,
    exact_slack: ti.f64,
    slacks: ti.template(),
    first: ti.i32,
    poses: ti.i32,
):
    """Write the slack of solids and half spaces at each pose into two columns from `first` on."""
    count = radii.shape[0]
    for m in range(poses):
        slacks[m, first] = FAR
        slacks[m, first + 1] = FAR
    low = ti.Vector([FAR, FAR, FAR], dt=ti.f64)
    high = -low
    reach = 0.0
    for row in range(poses * count):
        low = ti.min(low, point(centres, row))
        high = ti.max(high, point(centres, row))
    for s in range(count):
        reach = ti.max(reach, radii[s])
    for k in range(obstacles.shape[0]):
        if ti.cast(obstacles[k, 0], ti.i32) == HALF_SPACE:
            for m in range(poses):
                for s in range(count):
                    at = point(centres, m * count + s)
                    gap = signed_distance(obstacles, k, at) - radii[s]
                    slacks[m, first + 1] = ti.min(slacks[m, first + 1], gap)
        else:
            centre = ti.Vector([obstacles[k, 1], obstacles[k, 2], obstacles[k, 3]], dt=ti.f64)
            outside = ti.max(ti.max(low - centre, centre - high), 0.0)
            bound = outside.norm() - obstacles[k, 16] - keep_out
            if bound - reach < exact_slack:
                for s in range(count):
                    for m in range(poses):
                        at = point(centres, m * count + s)
                        margin = radii[s] + keep_out
                        gap = (at - centre).norm() - obstacles[k, 16] - margin
                        if gap < exact_slack:
                            gap = signed_distance(obstacles, k, at) - margin
                        slacks[m, first] = ti.min(slacks[m, first], gap)


@ti.kernel
def sphere_slacks(
    centres: rows_f64,
    radii: vector_f64,
    obstacles: rows_f64,
    slacks: rows_f64,
    keep_out: ti.f64,
    exact_slack: ti.f64,
    poses: ti.i32,
):
    """Write the slacks of spheres at m poses.

    Args:
        centres: Centres of the spheres, all of one pose after the other [m].
        radii: Their radii [m].
        obstacles: Obstacles, columns as above.
        slacks: Receives the slack of the solids, less than `exact_slack` or a lower bound, and that
            of the half spaces for each pose [m].
        keep_out: Least distance from a solid [m].
        exact_slack: Slack from which on a lower bound serves [m].
        poses: Number of poses.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        write_slacks(centres, radii, obstacles, keep_out, exact_slack, slacks, 0, poses)


@ti.func
def line_touches(start, end, obstacles: ti.template()):
    """Return one where the bounding sphere of a solid touches a straight line, else zero."""
    touched = 0.0
    for k in range(obstacles.shape[0]):
        if ti.cast(obstacles[k, 0], ti.i32) != HALF_SPACE:
            centre = ti.Vector([obstacles[k, 1], obstacles[k, 2], obstacles[k, 3]], dt=ti.f64)
            line = end - start
            share = (centre - start).dot(line) / ti.max(line.dot(line), 1e-12)
            nearest = start + ti.max(ti.min(share, 1.0), 0.0) * line
            if (centre - nearest).norm() < obstacles[k, 16]:
                touched = 1.0
    return touched


@ti.kernel
def gripper_slacks(
    grips: rows_f64,
    driven: vector_f64,
    spheres: rows_f64,
    radii: vector_f64,
    workspace: rows_f64,
    obstacles: rows_f64,
    centres: rows_f64,
    slacks: rows_f64,
    touched: vector_f64,
    ends: ti.i32,
    keep_out: ti.f64,
    exact_slack: ti.f64,
    spacing: ti.f64,
    longest: ti.f64,
    poses: ti.i32,
):
    """Write the slacks of the grips and of the spheres that cover the driven grippers.

    Args:
        grips: Position and quaternion wxyz of each grip, all of one pose after the other.
        driven: Indices of the driven grips.
        spheres: Index of each sphere's grip, and its centre there [m].
        radii: Radii of the spheres [m].
        workspace: Lowest and highest corner of the box for the driven grips [m].
        obstacles: Obstacles, columns as above.
        centres: Receives the centres of the spheres, all of one pose after the other [m].
        slacks: Receives the slacks of workspace, solids, half spaces, distance between two grips
            and its greatest value for each pose [m].
        touched: Receives one where the bounding sphere of a solid touches a line between two grips,
            else zero.
        ends: Number of grips.
        keep_out: Least distance from a solid [m].
        exact_slack: Slack from which on a lower bound serves [m].
        spacing: Least distance between two grips [m].
        longest: Greatest distance between two grips [m].
        poses: Number of poses.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        count = radii.shape[0]
        touched[0] = 0.0
        for m in range(poses):
            slacks[m, 0] = FAR
            for k in range(driven.shape[0]):
                for i in ti.static(range(3)):
                    at = grips[m * ends + ti.cast(driven[k], ti.i32), i]
                    gap = ti.min(at - workspace[0, i], workspace[1, i] - at)
                    slacks[m, 0] = ti.min(slacks[m, 0], gap)
            for s in range(count):
                row = m * ends + ti.cast(spheres[s, 0], ti.i32)
                v = ti.Vector([spheres[s, 1], spheres[s, 2], spheres[s, 3]], dt=ti.f64)
                axis = ti.Vector([grips[row, 4], grips[row, 5], grips[row, 6]], dt=ti.f64)
                t = 2.0 * axis.cross(v)
                v += point(grips, row) + grips[row, 3] * t + axis.cross(t)
                for i in ti.static(range(3)):
                    centres[m * count + s, i] = v[i]
            slacks[m, 3] = FAR
            slacks[m, 4] = FAR
            if ends == 2:
                start, end = point(grips, 2 * m), point(grips, 2 * m + 1)
                distance = (end - start).norm()
                slacks[m, 3] = distance - spacing
                slacks[m, 4] = longest - distance
                touched[0] = ti.max(touched[0], line_touches(start, end, obstacles))
        write_slacks(centres, radii, obstacles, keep_out, exact_slack, slacks, 1, poses)


@ti.kernel
def least_distances(
    left: rows_f64,
    left_radii: vector_f64,
    right: rows_f64,
    right_radii: vector_f64,
    distances: vector_f64,
    poses: ti.i32,
):
    """Write the least distance between the surfaces of two sets of spheres at each pose.

    Args:
        left: Centres of one set, all of one pose after the other [m].
        left_radii: Their radii [m].
        right: Centres of the other set [m].
        right_radii: Their radii [m].
        distances: Receives the distances [m].
        poses: Number of poses.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        for m in range(poses):
            least = FAR
            for a in range(left_radii.shape[0]):
                at = point(left, m * left_radii.shape[0] + a)
                for b in range(right_radii.shape[0]):
                    offset = at - point(right, m * right_radii.shape[0] + b)
                    reach = left_radii[a] + right_radii[b]
                    within = least + reach
                    square = offset.dot(offset)
                    if within > 0.0 and square < within * within:
                        least = ti.sqrt(square) - reach
            distances[m] = least
