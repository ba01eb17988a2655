"""Roll-out: the kernel, and the order in which the parts of a step are called.

A launch costs as much as several steps, so that one launch computes a whole horizon and its
derivatives. The tasks of a solve, where brackets mark those of the first iteration alone:

    INERTIAL_TARGETS, PREDICT
    repeat  EDGE_ENERGY, BEND_ENERGY, OBSTACLE_CONTACT, SELF_CONTACT     energy, gradient, Hessian
            FACTORIZE, ACCEPT_ITERATE, [MOVE_GRIPS, SUBTRACT_COUPLINGS]  H = L D L^T, -g
            SOLVE, APPLY_STEP, [MOVE_GRIPS]                              H s = -g

An iteration that starts near the solution leaves out the Hessian and takes the last factors. An
indefinite Hessian is evaluated again without its negative parts, then with a growing shift.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import scalar, sensitivity_columns_at, time_at
from lariat.rod.kernels.adjoint import adjoint as run_task
from lariat.rod.kernels.history import start_history, write_final_velocities
from lariat.rod.kernels.memory import add, load3
from lariat.rod.kernels.types import Doubles, Integers, Matrices33
from lariat.rod.launch.codes import Derivatives, HessianPart, Phase, Task
from lariat.rod.launch.layout import (
    GROUP_COLUMNS,
    HISTORY_SLOTS,
    REPORT_WIDTH,
    Header,
    ReportRow,
    Scalar,
    Section,
    TimeRow,
)

MAX_CHORD_STEP = 0.003
"""Largest step of Newton's method, in edges, after which the next one takes its factors [-]. After
longer ones the edges have turned, and their stretch is too stiff for the old factors."""


@ti.kernel
def roll_out(ni: Integers, w: Doubles, w33: Matrices33, batch: ti.i32):
    """Roll out every rod of a batch, with the derivatives that the header names."""
    ti.loop_config(serialize=True)
    for b in range(batch):
        rod = b * ni[Header.STRIDE]
        start_history(ni, w, rod)
        advance(ni, w, w33, rod)
        write_final_velocities(ni, w, rod)


@ti.kernel
def roll_out_side_by_side(ni: Integers, w: Doubles, w33: Matrices33, batch: ti.i32):
    """Roll out every rod of a batch in a thread of its own, with the derivatives of the header."""
    for b in range(batch):
        rod = b * ni[Header.STRIDE]
        start_history(ni, w, rod)
        advance(ni, w, w33, rod)
        write_final_velocities(ni, w, rod)


@ti.func
def advance(ni: ti.template(), w: ti.template(), w33: ti.template(), rod):
    """Solve every step from the end of the last, then carry the adjoint back.

    Plain Newton steps come first: the fastest, and nearly always enough. Where they diverge, the
    solve starts again from the last one's end, with line search on the energy and positive definite
    Hessians.

    The loop decides after each task which one is next, and contains a single call for all of them:
    Taichi compiles every further call that names the parts through all of their statements.
    """
    n = ni[Header.NODES]
    first = ni[Header.FIRST_FREE]
    end = ni[Header.END_FREE]
    length = scalar(ni, w, rod, Scalar.EDGE_LENGTH)
    tolerance = scalar(ni, w, rod, Scalar.TOLERANCE)
    derivatives = ni[Header.DERIVATIVES] > 0
    with_sensitivities = ni[Header.DERIVATIVES] % Derivatives.ADJOINT
    friction = ni[Header.FRICTION_PAIRS] > 0
    # Slips and sets are states of the rod beside its shape.
    carries = friction or ni[Header.LAYERS] > 0
    contact_forces_wanted = ti.cast(
        (ni[Header.PARAMETERS] > 0 or friction) and ni[Header.OBSTACLES] > 0, ti.i32
    )
    updated = 0
    adjoint_step = rod + ni[Section.ADJOINT]
    step = 0
    backward = 0
    d = rod + ni[Section.NEWTON_STEP]
    # Longer steps could jump over an obstacle. The edge length sets no limit below the thickness:
    # the number of iterations does not grow with the number of nodes.
    max_stride = 2.0 * length
    if ni[Header.OBSTACLES] > 0:
        thickness = scalar(ni, w, rod, Scalar.CONTACT_REACH) - scalar(
            ni, w, rod, Scalar.CONTACT_MARGIN
        )
        max_stride = ti.max(ti.min(max_stride, 4.0 * thickness), thickness)
    self_contact = ni[Header.MAX_SELF_CONTACTS] > 0
    if self_contact:
        # Nor may they jump over another strand.
        max_stride = ti.min(max_stride, scalar(ni, w, rod, Scalar.CONTACT_REACH))
    # Those of layers that yield wander more, and a line search ends it.
    most = ti.select(ni[Header.LAYERS] > 0, 16, 100)
    column = 0
    iterations = 0
    full_steps = 0
    attempts = 0
    exact = 1
    shift = 0.0
    share = 1.0
    energy = 0.0
    lowest = 1e300
    line_search = 0
    phase = Phase.ITERATION
    converged = 0
    definite = 1
    largest = 0.0
    remaining = 0.0
    grips_moved = 0
    stepped = 0
    chord = 0
    ratio = 1.0
    task = Task.INERTIAL_TARGETS
    while task != Task.DONE:
        arg = exact
        real = shift
        if phase == Phase.DERIVATIVES or chord == 1 or task == Task.UPDATE_STATE:
            # Derivatives need the forces of contact, for the derivative with respect to length.
            arg = HessianPart.NONE
        if task == Task.EDGE_ENERGY and phase == Phase.FINAL_HESSIAN:
            arg = HessianPart.TRUE
        if task == Task.BEND_ENERGY:
            # Layers that yield leave little stiffness, and steps that go too far: those that leave
            # out negative parts, and the first one where no motion goes on, take what the layers
            # bear now.
            still = w[time_at(ni, rod, step) + TimeRow.KEEPS_VELOCITY] == 0.0
            wary = ((iterations == 0 and still) or exact == 0) and line_search + phase == 0
            real = ti.cast(wary, ti.f64)
        if task == Task.ACCEPT_ITERATE:
            arg = line_search
        elif task == Task.APPLY_STEP:
            arg = line_search
            real = share
        elif task == Task.MOVE_GRIPS:
            arg = grips_moved
        elif task == Task.PREDICT:
            arg = 1 - line_search
        elif task == Task.SUBTRACT_COUPLINGS or task == Task.SOLVE:
            arg = d
            real = 0.0
            if backward == 1:
                arg = adjoint_step
                real = 1.0
        elif task == Task.SUBTRACT_SELF_CONTACT_COUPLINGS or task == Task.SOLVE_AGAIN:
            arg = sensitivity_columns_at(ni, rod, column // GROUP_COLUMNS)[0]
            arg += column % GROUP_COLUMNS
            real = GROUP_COLUMNS
        elif task == Task.SOLVE_EXACTLY or task == Task.FOLD_SELF_CONTACTS:
            arg = adjoint_step
            real = 1.0
            if backward == 0:
                arg = sensitivity_columns_at(ni, rod, 0)[0]
                real = GROUP_COLUMNS
        value = run_task(ni, w, w33, task, rod, step, arg, real)
        check_progress = 0
        if phase == Phase.DERIVATIVES:
            if task == Task.INERTIA_DERIVATIVES:
                forces = ti.select(self_contact, Task.SELF_CONTACT, Task.PARAMETER_DERIVATIVES)
                task = ti.select(contact_forces_wanted, Task.OBSTACLE_CONTACT, forces)
            elif task == Task.OBSTACLE_CONTACT:
                task = ti.select(self_contact, Task.SELF_CONTACT, Task.PARAMETER_DERIVATIVES)
            elif task == Task.SELF_CONTACT:
                task = Task.PARAMETER_DERIVATIVES
            elif task == Task.PARAMETER_DERIVATIVES:
                solving = ti.select(self_contact, Task.SOLVE_EXACTLY, Task.SOLVE)
                solving = ti.select(carries, Task.SEED_STATE, solving)
                task = ti.select(backward, solving, Task.GRIP_SENSITIVITIES)
            elif task == Task.SEED_STATE:
                task = ti.select(self_contact, Task.SOLVE_EXACTLY, Task.SOLVE)
            elif task == Task.GRIP_SENSITIVITIES:
                task = Task.SENSITIVITIES
            elif task == Task.SENSITIVITIES:
                column = 0
                task = ti.select(
                    self_contact, Task.SUBTRACT_SELF_CONTACT_COUPLINGS, Task.WRITE_SENSITIVITIES
                )
            elif task == Task.SUBTRACT_SELF_CONTACT_COUPLINGS:
                # The first solve computes the columns of the contacts, which the others reuse.
                task = ti.select(column == 0, Task.SOLVE_EXACTLY, Task.SOLVE_AGAIN)
            elif task == Task.SOLVE_AGAIN or task == Task.SOLVE_EXACTLY:
                if value > 0.0:
                    w[rod + ni[Section.REPORTS] + REPORT_WIDTH * step + ReportRow.CONVERGED] = 0.0
                column += 1
                task = Task.SUBTRACT_SELF_CONTACT_COUPLINGS
                if backward == 1:
                    task = Task.FOLD_SELF_CONTACTS
                elif column == GROUP_COLUMNS * sensitivity_columns_at(ni, rod, 0)[1]:
                    task = Task.WRITE_SENSITIVITIES
            elif task == Task.SOLVE or task == Task.FOLD_SELF_CONTACTS:
                task = Task.ADJOINT
            elif task == Task.ADJOINT:
                task = Task.GRIP_ADJOINT
            elif task == Task.GRIP_ADJOINT:
                step -= 1
                task = Task.SOLVED
            else:
                phase = Phase.FINISHED
                task = Task.SOLVED
        elif task == Task.UPDATE_STATE:
            updated = 1
            task = Task.SOLVED
        elif task == Task.INERTIAL_TARGETS:
            task = Task.PREDICT
        elif task == Task.PREDICT:
            task = Task.EDGE_ENERGY
            if line_search == 1:
                grips_moved = 1
                task = Task.MOVE_GRIPS
            stepped = 0
        elif task == Task.EDGE_ENERGY:
            energy = value
            task = Task.BEND_ENERGY
        elif task == Task.BEND_ENERGY:
            energy += value
            task = Task.OBSTACLE_CONTACT
        elif task == Task.OBSTACLE_CONTACT and self_contact:
            energy += value
            task = Task.SELF_CONTACT
        elif task == Task.OBSTACLE_CONTACT or task == Task.SELF_CONTACT:
            energy += value
            attempts += 1 - chord
            task = ti.select(chord, Task.ACCEPT_ITERATE, Task.FACTORIZE)
            if (
                line_search == 1
                and phase == Phase.ITERATION
                and not (energy <= lowest + 1e-13 * ti.abs(lowest))
            ):
                share *= 0.5
                stepped = 0
                task = Task.APPLY_STEP
                if share < 1e-6:
                    # No descent is left above rounding errors.
                    share = 0.0
                    converged = ti.cast(largest < 100.0 * tolerance, ti.i32)
                    phase = Phase.FINAL_HESSIAN
                    exact = 1
                    shift = 0.0
        elif task == Task.FACTORIZE:
            definite = ti.cast(value, ti.i32)
            task = Task.ACCEPT_ITERATE
            if line_search == 1:
                lowest = ti.min(lowest, energy)
            if phase == Phase.FINAL_HESSIAN:
                task = Task.SOLVED
            elif definite == 0:
                if exact == 0:
                    shift = ti.max(10.0 * shift, 1e-9)
                exact = 0
                check_progress = 1
                task = Task.EDGE_ENERGY
        elif task == Task.ACCEPT_ITERATE:
            task = Task.SOLVE
            if line_search == 1:
                # With friction, each iterate has limits of its own.
                lowest += value
            if iterations == 0:
                grips_moved = 0
                task = Task.MOVE_GRIPS
        elif task == Task.MOVE_GRIPS and grips_moved == 0:
            task = Task.SUBTRACT_COUPLINGS
        elif task == Task.SUBTRACT_COUPLINGS:
            task = Task.SOLVE
        elif task == Task.SOLVE:
            moved = 0.0
            rotated = 0.0
            driven = 0.0
            for j in range(2 * n - 1):
                size = load3(w, d + 3 * j).norm_sqr()
                if j % 2 == 1:
                    rotated = ti.max(rotated, size)
                else:
                    moved = ti.max(moved, size)
                    if j < first or j >= end:
                        driven = ti.max(driven, size)
            # The next step will be smaller by the ratio of the last two with old factors, by its
            # square with new ones. The ratio, times a hundred, is a safe estimate of what remains.
            moved, rotated, driven = ti.sqrt(moved), ti.sqrt(rotated), ti.sqrt(driven)
            size = ti.max(moved, length * rotated)
            ratio = 1.0
            if iterations > 0 and share == 1.0:
                ratio = size / (largest + 1e-300)
            remaining = size
            if not derivatives and chord == 0:
                remaining = ti.min(1.0, 100.0 * ratio) * size
            if derivatives and chord == 1:
                # They need the factors of the Hessian where the iteration ends.
                remaining = tolerance
            largest = size
            share = 1.0
            near = ni[Header.OBSTACLES] > 0 or self_contact
            if iterations > 0 or (near and moved > 4.0 * max_stride + 2.0 * driven):
                share = ti.min(share, ti.min(max_stride / (moved + 1e-30), 0.8 / (rotated + 1e-30)))
            if iterations == 0 or share == 1.0:
                full_steps += 1
            stepped = 1
            task = Task.APPLY_STEP
        elif task == Task.APPLY_STEP:
            task = Task.EDGE_ENERGY
            if stepped == 1 and iterations == 0:
                grips_moved = 1
                task = Task.MOVE_GRIPS
            elif stepped == 1:
                check_progress = 1
        else:
            # The grips have been placed.
            task = Task.EDGE_ENERGY
            check_progress = stepped
        if check_progress == 1:
            if stepped == 1:
                stepped = 0
                if iterations > 0 and remaining < tolerance and share == 1.0:
                    converged = 1
                    if self_contact:
                        # Self-contacts without a place in the list are missing from the solve.
                        unplaced = w[rod + ni[Section.SELF_CONTACTS] + 1]
                        converged = ti.cast(unplaced == 0.0, ti.i32)
                    # Derivatives need the true Hessian: FINAL_HESSIAN follows a modified one.
                    phase = ti.cast(exact == 0 or shift > 0.0, ti.i32)
                    if phase == Phase.ITERATION:
                        task = Task.SOLVED
                # Near the solution the factors at hand do for a further step, at half the cost; a
                # last step before derivatives gets its own.
                following = ti.select(chord, ratio, ratio * ratio) * largest
                own_factors = exact == 0 or shift > 0.0 or line_search == 1
                own_factors = own_factors or iterations == 0 or share < 1.0
                own_factors = own_factors or ratio > 0.1 or largest > MAX_CHORD_STEP * length
                own_factors = own_factors or (derivatives and following < tolerance)
                chord = ti.select(own_factors, 0, 1)
                iterations += 1
                exact = 1
                shift = 0.0
            if task != Task.SOLVED and phase == Phase.ITERATION:
                if line_search == 0 and (
                    full_steps >= 14 or attempts >= most or not (largest < 1e6)
                ):
                    line_search = 1
                    chord = 0
                    iterations = 1
                    exact = 1
                    shift = 0.0
                    task = Task.PREDICT
                elif attempts >= ni[Header.MAX_ITERATIONS]:
                    task = Task.SOLVED
        if task == Task.SOLVED and carries and phase < Phase.DERIVATIVES and updated == 0:
            task = Task.UPDATE_STATE
        if task == Task.SOLVED:
            if phase < Phase.DERIVATIVES:
                report = rod + ni[Section.REPORTS] + REPORT_WIDTH * step
                w[report + ReportRow.ITERATIONS] = attempts
                w[report + ReportRow.CONVERGED] = converged
                w[report + ReportRow.LAST_STEP] = largest
                w[report + ReportRow.DEFINITE] = definite
            if phase < Phase.DERIVATIVES and with_sensitivities == 1:
                phase = Phase.DERIVATIVES
                task = Task.INERTIA_DERIVATIVES
            elif backward == 0:
                step += 1
                iterations = 0
                full_steps = 0
                attempts = 0
                exact = 1
                shift = 0.0
                share = 1.0
                lowest = 1e300
                line_search = 0
                phase = Phase.ITERATION
                converged = 0
                largest = 0.0
                grips_moved = 0
                stepped = 0
                chord = 0
                updated = 0
                task = Task.INERTIAL_TARGETS
                if step == ni[Header.STEPS]:
                    task = Task.DONE
                    if ni[Header.DERIVATIVES] >= Derivatives.ADJOINT:
                        backward = 1
                        phase = Phase.DERIVATIVES
                        step -= 1
            if backward == 1:
                task = Task.DONE
                if step >= 0:
                    task = Task.INERTIA_DERIVATIVES
                    adjoint_step = (
                        rod + ni[Section.ADJOINT] + 3 * (2 * n - 1) * (step + HISTORY_SLOTS)
                    )
                    if (step + 1) % ni[Header.SUBSTEPS] == 0:
                        cost = (
                            rod + ni[Section.COST_GRADIENT] + 3 * n * (step // ni[Header.SUBSTEPS])
                        )
                        for i in range(n):
                            add(w, adjoint_step + 6 * i, load3(w, cost + 3 * i))
