"""Gauss-Newton iteration of the fit."""

from lariat.kernel_cache.language import ti
from lariat.perception.centerline.bandwidth import MARGIN
from lariat.perception.centerline.kernels.banded_cholesky import (
    factorize,
    substitute_back,
    write_variances,
)
from lariat.perception.centerline.kernels.normal_equations import (
    describe_smoothness,
    write_normal_equations,
)
from lariat.perception.centerline.kernels.samples import add_samples, describe_edges
from lariat.perception.centerline.kernels.types import (
    band_rows,
    edge_descriptions,
    edge_sums,
    matrix_f64,
    vector_f64,
    vector_i32,
)

EASED_ITERATIONS = 6.0
"""Number of iterations at the start in which lengths and outliers have less influence."""
EASED_SAMPLES, MAX_STRIDE = 8, 8
"""Number of samples for each node that are used in each of them, and number of samples of which at
least one is used."""
EASED_EDGE_SIGMA = 1e-3
"""Standard deviation that is added to the edges' lengths in the first iteration [m]."""
EASED_OUTLIER_FACTOR = 6.0
"""Amount that is added to the outlier scale of one in the first iteration."""
SEARCH_REACH = 3
"""Number of edges by which a sample may move along the chain in one iteration; in the last ones, it
is one."""
MAX_SECANT = 2.0
"""Length of an extrapolation, relative to the last move, up to which it is trusted [-]."""


@ti.func
def limit_steps(steps: ti.template(), longest: ti.f64):
    """Shorten the steps of nodes that are too long, and return the longest of all [m].

    Far from the solution the linearised lengths mislead.
    """
    largest = 0.0
    for i in range((steps.shape[0] - 2 * MARGIN) // 3):
        row = MARGIN + 3 * i
        step = ti.Vector([steps[row], steps[row + 1], steps[row + 2]], dt=ti.f64)
        step *= ti.min(1.0, longest / ti.max(step.norm(), 1e-12))
        largest = ti.max(largest, step.norm())
        for k in ti.static(range(3)):
            steps[row + k] = step[k]
    return largest


@ti.func
def move_nodes(nodes: ti.template(), steps: ti.template(), moves: ti.template(), settled: ti.i32):
    """Move the nodes by the steps; once the problem is settled, by a secant through the last ones.

    Robust weights make the steps fall by a constant factor, which the secant (Anderson 1965, of
    one step) extrapolates. Column 0 of `moves` keeps the last step, column 1 the last move.
    """
    product, square = 0.0, 0.0
    for c in range(moves.shape[0]):
        change = steps[MARGIN + c] - moves[c, 0]
        product += steps[MARGIN + c] * change
        square += change * change
    share = 0.0
    if settled and square > 0.0:
        share = ti.min(0.0, ti.max(-MAX_SECANT, product / square))
    for c in range(moves.shape[0]):
        step = steps[MARGIN + c]
        move = step - share * (moves[c, 1] + step - moves[c, 0])
        moves[c, 0] = step
        moves[c, 1] = move
        nodes[c // 3, c % 3] += move


@ti.kernel
def fit(
    nodes: matrix_f64,
    samples: matrix_f64,
    segments: vector_i32,
    eye: vector_f64,
    anchors: matrix_f64,
    band: band_rows,
    inverse: band_rows,
    smoothness: matrix_f64,
    edges: edge_descriptions,
    sums: edge_sums,
    moves: matrix_f64,
    rhs: vector_f64,
    support: vector_f64,
    variance: vector_f64,
    statistics: vector_f64,
    edge: ti.f64,
    sigma_edge: ti.f64,
    sigma_curve: ti.f64,
    weight_down: ti.f64,
    sigma_change: ti.f64,
    tolerance: ti.f64,
    iterations: ti.i32,
):
    """Minimise the residuals of samples, anchors and lengths plus the energy of bending and weight.

    With both energies, an unobserved part hangs as a rope at rest would.

    Args:
        nodes: (n, 3) initial positions, overwritten by the fit [m].
        samples: (m, 6): unit ray, range to the surface [m] (0: none), depth of the axis below the
            surface [m], standard deviation of the range [m] or, without one, of the ray [rad].
        segments: (m,) index of the segment on which every sample is assumed to lie, updated.
        eye: Centre of projection [m].
        anchors: (n, 4) expected position of each node and its standard deviation [m]; 0: none.
        band: Scratch (3n + 2 MARGIN, 1, BANDWIDTH), zero in the margins.
        inverse: Scratch of the same shape, zero in the margins.
        smoothness: Scratch (n + 3, 4).
        edges: Scratch (n - 1, 4, 3).
        sums: Scratch (n - 1, 4, 6).
        moves: Scratch (3n, 2).
        rhs: Scratch (3n + 2 MARGIN,).
        support: (n,) weighted number of ranges around every node, written.
        variance: (n,) trace of every node's covariance [m^2], written.
        statistics: Sum of squared normalised residuals, their count, outliers, iterations; written.
        edge: Length of every edge [m].
        sigma_edge: Standard deviation of the edges' lengths [m].
        sigma_curve: Standard deviation of second differences [m].
        weight_down: Cost of a node's height due to the rope's weight [1/m].
        sigma_change: Standard deviation of third differences [m].
        tolerance: Largest step of a node at which the iteration has converged [m].
        iterations: Largest number of iterations.
    """
    n = nodes.shape[0]
    center = ti.Vector([eye[0], eye[1], eye[2]], dt=ti.f64)
    ti.loop_config(serialize=True)
    for _ in range(1):
        describe_smoothness(
            anchors,
            smoothness,
            1.0 / (sigma_curve * sigma_curve),
            1.0 / (sigma_change * sigma_change),
        )
        done = False
        iteration = 0
        while not done:
            ease = ti.max(0.0, 1.0 - iteration / EASED_ITERATIONS)
            stiff = sigma_edge + ease * ease * EASED_EDGE_SIGMA
            scale = 1.0 + EASED_OUTLIER_FACTOR * ease
            for i in range(n):
                support[i] = 0.0
            for j in range(n - 1):
                sums[j] = ti.Matrix([[0.0] * 6] * 4, dt=ti.f64)
            describe_edges(nodes, center, edges)
            # While lengths and outliers are eased, a part of the samples leads far enough.
            stride, first, search = 1, 0, 1
            if iteration <= EASED_ITERATIONS:
                search = SEARCH_REACH
            if iteration < EASED_ITERATIONS:
                stride = ti.max(1, ti.min(MAX_STRIDE, samples.shape[0] // (EASED_SAMPLES * n)))
                first = iteration % stride
            add_samples(
                edges,
                samples,
                segments,
                sums,
                support,
                statistics,
                first,
                stride,
                search,
                scale,
            )
            write_normal_equations(
                nodes,
                anchors,
                smoothness,
                edges,
                sums,
                band,
                rhs,
                edge,
                1.0 / (stiff * stiff),
                weight_down,
            )
            factorize(band, rhs)
            substitute_back(band, rhs)
            largest = limit_steps(rhs, edge)
            move_nodes(nodes, rhs, moves, iteration > EASED_ITERATIONS)
            iteration += 1
            done = iteration == iterations or (iteration > 7 and largest < tolerance)
            if done:
                statistics[3] = iteration
                write_variances(band, inverse, variance)
