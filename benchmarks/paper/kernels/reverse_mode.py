"""Algorithm 1 of the paper, differentiated by Taichi's own reverse mode, as in the paper.

Reverse mode does not keep values that a kernel overwrites, and its gradient of a whole roll-out in
one kernel, with several loops inside a step, is silently wrong. Therefore every phase of every
sweep is a kernel of its own, which reads one stage of the states and writes the next. Both ends are
clamped and only translate; there is no contact. Frame 0 and the last one are those of the grips;
edge e has frame e + 1.
"""

from lariat.kernel_cache.language import ti
from lariat.paper.xpbd.kernels.quaternions import (
    director,
    director_transpose,
    relative_imaginary,
    rotation_imaginary,
    times_vector,
    vector_times,
)
from lariat.rod.kernels.step_terms import bend_share

Vector3 = ti.types.vector(3, ti.f64)
Vector4 = ti.types.vector(4, ti.f64)


@ti.data_oriented
class ReverseRod:
    """Roll-out of one horizon of one rod; fields hold every stage of it."""

    def __init__(self, nodes, iterations, horizon, length, dt, damping, angular_damping):
        """Allocate the fields.

        Args:
            nodes: Number of nodes.
            iterations: Number of sweeps J of each step.
            horizon: Number of steps.
            length: Rest length of an edge [m].
            dt: Time step [s].
            damping: Linear damping xi_v of the paper.
            angular_damping: Angular damping xi_omega of the paper.
        """
        self.n, self.m, self.J, self.H = nodes, nodes + 1, iterations, horizon
        self.length, self.dt = length, dt
        self.linear_decay, self.angular_decay = (1.0 - damping) ** dt, (1.0 - angular_damping) ** dt

        def vectors(kind, *shape):
            return kind.field(shape=shape, needs_grad=True)

        self.x = vectors(Vector3, horizon, 2 * iterations + 1, nodes)
        self.q = vectors(Vector4, horizon, 4 * iterations + 1, self.m)
        self.multipliers = vectors(Vector3, horizon, iterations + 1, nodes)
        self.positions = vectors(Vector3, horizon + 1, nodes)
        self.orientations = vectors(Vector4, horizon + 1, self.m)
        self.velocities = vectors(Vector3, horizon + 1, nodes)
        self.angular_velocities = vectors(Vector3, horizon + 1, self.m)
        self.actions = vectors(Vector3, horizon, 2)
        self.slope = Vector3.field(shape=(horizon, nodes))
        # Inverse mass, inverse inertia, compliance.
        self.theta = ti.field(ti.f64, shape=3, needs_grad=True)
        self.cost = ti.field(ti.f64, shape=(), needs_grad=True)

    def run(self):
        """Roll out, and compute the gradient by `ti.ad.Tape`."""
        with ti.ad.Tape(loss=self.cost):
            self.roll()
            self.sum_cost()

    def roll(self):
        """Roll out."""
        for t in range(self.H):
            self.predict(t)
            for j in range(self.J):
                for color in range(2):
                    self.stretch(t, j, color)
                for color in range(2):
                    self.bend(t, j, color)
            self.settle(t)

    @ti.func
    def weight(self, i):
        return ti.select(i > 0 and i < self.n - 1, self.theta[0], 0.0)

    @ti.func
    def edge_weight(self, i):
        return ti.select(i > 0 and i < self.m - 1, self.theta[1], 0.0)

    @ti.kernel
    def predict(self, t: ti.i32):
        for i in range(self.n):
            h = self.dt
            if i == 0 or i == self.n - 1:
                end = i // (self.n - 1)
                self.x[t, 0, i] = self.positions[t, i] + h * self.actions[t, end]
            else:
                fall = Vector3(0.0, 0.0, -9.81 * h * h)
                self.x[t, 0, i] = self.positions[t, i] + h * self.velocities[t, i] + fall
        for i in range(self.m):
            p = self.orientations[t, i]
            if i > 0 and i < self.m - 1:
                p += (0.5 * self.dt) * vector_times(self.angular_velocities[t, i], p)
            self.q[t, 0, i] = p / ti.sqrt(p.dot(p))

    @ti.kernel
    def stretch(self, t: ti.i32, j: ti.i32, color: ti.i32):
        for e in range(self.n - 1):
            i = e + 1
            if e % 2 == color:
                x1, x2 = self.x[t, 2 * j + color, e], self.x[t, 2 * j + color, e + 1]
                q = self.q[t, 4 * j + color, i]
                w1, w2, wq = self.weight(e), self.weight(e + 1), self.edge_weight(i)
                per = 1.0 / self.length
                inverse = 1.0 / ((w1 + w2) * per * per + 4.0 * wq)
                dl = -inverse * (per * (x2 - x1) - director(q))
                self.x[t, 2 * j + color + 1, e] = x1 - (w1 * per) * dl
                self.x[t, 2 * j + color + 1, e + 1] = x2 + (w2 * per) * dl
                p = q - wq * director_transpose(q, dl)
                self.q[t, 4 * j + color + 1, i] = p / ti.sqrt(p.dot(p))
            else:
                self.q[t, 4 * j + color + 1, i] = self.q[t, 4 * j + color, i]
        for end in range(2):
            grip = end * (self.m - 1)
            self.q[t, 4 * j + color + 1, grip] = self.q[t, 4 * j + color, grip]
            # An end node whose edge has the other colour is copied.
            if end * (self.n - 2) % 2 != color:
                i = end * (self.n - 1)
                self.x[t, 2 * j + color + 1, i] = self.x[t, 2 * j + color, i]

    @ti.kernel
    def bend(self, t: ti.i32, j: ti.i32, color: ti.i32):
        for i in range(self.m - 1):
            if i % 2 == color:
                q1, q2 = self.q[t, 4 * j + 2 + color, i], self.q[t, 4 * j + 2 + color, i + 1]
                w1, w2 = self.edge_weight(i), self.edge_weight(i + 1)
                share = bend_share(i, self.m - 1, 1, 1)
                soft = share * self.theta[2] / (self.dt * self.dt)
                multiplier = self.multipliers[t, j, i]
                dl = -(relative_imaginary(q1, q2) + soft * multiplier) / (w1 + w2 + soft)
                self.multipliers[t, j + 1, i] = multiplier + dl
                p1, p2 = q1 - w1 * times_vector(q2, dl), q2 + w2 * times_vector(q1, dl)
                self.q[t, 4 * j + 3 + color, i] = p1 / ti.sqrt(p1.dot(p1))
                self.q[t, 4 * j + 3 + color, i + 1] = p2 / ti.sqrt(p2.dot(p2))
        for end in range(2):
            # A grip whose bend has the other colour is copied.
            if end * (self.m - 2) % 2 != color:
                grip = end * (self.m - 1)
                self.q[t, 4 * j + 3 + color, grip] = self.q[t, 4 * j + 2 + color, grip]

    @ti.kernel
    def settle(self, t: ti.i32):
        for i in range(self.n):
            x = self.x[t, 2 * self.J, i]
            self.positions[t + 1, i] = x
            self.velocities[t + 1, i] = (self.linear_decay / self.dt) * (x - self.positions[t, i])
        for i in range(self.m):
            q = self.q[t, 4 * self.J, i]
            self.orientations[t + 1, i] = q
            turn = rotation_imaginary(self.orientations[t, i], q)
            self.angular_velocities[t + 1, i] = (2.0 * self.angular_decay / self.dt) * turn

    @ti.kernel
    def sum_cost(self):
        for t, i in ti.ndrange(self.H, self.n):
            self.cost[None] += self.slope[t, i].dot(self.positions[t + 1, i])
