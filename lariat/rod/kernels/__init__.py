"""Kernel of the implicit rod: roll-outs, their derivatives, and statics as a roll-out.

**Model.** A Cosserat rod of n nodes and n - 1 edges. Each node has a position x, each edge an
orientation q, whose third axis d3 lies along the edge except for shear. One implicit step of
duration h is the minimizer of an incremental energy, where y and q^ are the inertial targets, to
which inertia alone would lead, and wt = (1 + c h) / h^2 weighs inertia under a damping c:

    nodes     m wt |x - y|^2 / 2 - m g x                                     inertia, weight
    edges     l K |e / l - d3|^2 / 2 + wt J |2 Im(conj(q^) q)|^2 / 2         stretch, inertia
    bends     (k1, k2, k3) |u - rest|^2 / 2, u = log(conj(q_i) q_i+1)        bending, twist
              + tau / h (k1, k2, k3) |u - u1|^2 / 2                          internal damping
    contact   l p(radius - distance), at samples of every edge               obstacles
              l p(diameter - distance) / 2, between edges                    self-contact

**Time.** A step is one solve of implicit Euler, or two solves with h = gamma dt each of the
second-order SDIRK2, gamma = 1 - 1 / sqrt(2) (Alexander 1977). In both, y is a sum of the last
positions, and velocity is counted from a base, another such sum. A solve without inertia's
displacement is a step of the statics.

**Newton's method.** From a first iterate, each iteration evaluates energy, gradient g and Hessian
H, factorizes H = L D L^T, solves H s = -g and moves the iterate along s. Unknowns are ordered from
left to right, in blocks of three for each node and edge, so that H is banded and the cost linear in
n. Plain iterations come first; where they diverge, the solve starts again with line search and
positive definite Hessians.

**Derivatives.** At the minimizer g(x, x1, x0, ..., theta) = 0. By the implicit function theorem,
H dx = -dg/dx1 dx1 - dg/dx0 dx0 - ... - dg/dtheta dtheta. Forwards, this carries columns of
sensitivities from solve to solve; backwards, its transpose carries the gradient of one cost. Both
reuse the factors of the last Newton step.

**Files**, in reading order:

    rollout                  the kernel, and which part of a step comes next
    history                  initial state to history, final velocities
    prediction               inertial targets and first iterate
    grips                    driven ends
    energy                   inertia, weight, stretch, bending
    plasticity               set of bends, in layers that yield
    contact_penalty          p, the penalty of contact
    signed_distance          distance from obstacles, with derivatives
    friction                 Coulomb friction on obstacles
    obstacle_contact         signed distance and contact with obstacles
    self_contact             contact of the rod with itself
    self_contact_hessian     products with its Hessian
    self_contact_coupling    its couplings of free and driven unknowns
    banded_factorization     block LDL^T of the Hessian
    banded_solve             solves with its factors
    newton_update            the iterate moves along the step
    step_derivatives         dg/dx1, dg/dx0, ...
    parameter_derivatives    dg/dtheta
    adjoint                  gradient of a cost, backwards
    sensitivities            derivatives of positions, forwards
    grip_sensitivities       their rows at driven ends
    step_terms, rotations    terms and rotations that these share
    addressing, memory       offsets (`lariat.rod.launch.layout`), loads and stores

`lariat.rod.reference` is the same step in plain NumPy.

**Structure of the code.** Taichi's compile time grows faster than the size of the code, so that the
large parts are real functions, compiled once each. They share one signature: the integer array
`ni`, the doubles `w`, which are also passed as matrices (`w33`), the `Task` to do, the
offset `rod`, the solve `step`, and two arguments of the task. Taichi 1.7 has two faults with real
functions. Functions that are inlined into them lose their branches and loops: they have none
(`ti.select`). And the key of Taichi's offline cache depends on chance as soon as one body names two
real functions: every part therefore names only one other, does its own tasks, and passes on all
others. The chain of parts begins in `adjoint` and ends in `banded_solve`; its order decides what
the compiler inlines, and hence the rounding of results and the speed: a function that is inlined
nowhere reads the addresses of the arrays again after every store, and none of its loops has lanes.
`nm -S` lists those of a library: `sensitivities` must not be one of them.

**Lanes.** Bends, edges and the Newton update are evaluated for up to `LANE_COUNT` neighbours at a
time: their numbers are gathered, term by term, in the section of lanes, a loop over neighbours
computes, and the results are scattered. LLVM makes lanes of such a loop if it has no branch, reads
and writes the section of lanes alone, and runs a multiple of four times, at least 16 at most; and
if terms that are read from the next neighbour lie 64 lanes of four away from what it writes. The
lanes of sensitivities are the columns of a group, whose loops run a constant twelve times.
"""
