"""Launches by which a library of the kernel is compared with Taichi's kernel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.geometry.obstacles import Obstacle, pack
from lariat.kernel_cache.source import SelfTest
from lariat.rod.initial_shapes import straight
from lariat.rod.launch.buffers import BufferPool, kernel_arrays
from lariat.rod.launch.codes import Derivatives
from lariat.rod.launch.inputs import DerivativeRequest, pack_constants, prepare
from lariat.rod.launch.layout import Section
from lariat.rod.model import ImplicitRodModel
from lariat.rod.properties import RodProperties
from lariat.rod.rollout_spec import RolloutSpec

RESULTS = (
    Section.POSITIONS,
    Section.ORIENTATIONS,
    Section.SENSITIVITIES_OUT,
    Section.ACTIONS_OUT,
    Section.PARAMETERS_OUT,
)
"""Sections with the results of a launch."""


SHARED = ("bending_stiffness", "length", "damping", "internal_damping", "drag_coefficient")
"""Parameters that all launches with derivatives differentiate in."""


def self_tests() -> list[SelfTest]:
    """Return launches that together run every part of the kernel."""
    properties = RodProperties(
        0.45, 0.008, 0.044, 1e6, internal_damping=0.01, drag_coefficient=20.0
    )
    soft = replace(properties, yield_curvature=3.0, inner_friction=0.2, hardening=0.1)
    bar = Obstacle(
        "capsule", (0.2, 0.0, 0.285), (0.7071, 0.7071, 0.0, 0.0), radius=0.01, height=1.0
    )
    box = Obstacle("box", (0.3, 0.0, 0.2), size=(0.1, 0.1, 0.17))
    cone = Obstacle("cone", (0.1, 0.0, 0.24), radius=0.05, height=0.1)
    scene = pack([bar, box, cone])
    rough = pack([replace(bar, friction=0.3), box, cone])
    rng = np.random.default_rng(0)
    actions = rng.uniform(-0.3, 0.3, (2, 3, 2, 6))
    cost = rng.standard_normal((2, 3, 12, 3))
    tests = []
    for kinds, self_contact, friction in (
        (Derivatives.ADJOINT, False, False),
        (Derivatives.SENSITIVITIES, False, False),
        (Derivatives(0), True, False),
        (Derivatives.ADJOINT, False, True),
        (Derivatives.SENSITIVITIES, False, True),
    ):
        scheme = "euler" if friction else "sdirk2"
        of = soft if friction else properties
        model = ImplicitRodModel(of, 12, scheme=scheme, self_contact=self_contact)
        state = straight(model, (0.0, 0.0, 0.3), (1.0, 0.0, 0.3))
        names = (*SHARED, "yield_curvature", "friction_factor") if friction else SHARED
        request = DerivativeRequest(
            kinds, names if kinds else (), d_cost_d_positions=cost if kinds else None
        )
        states = [state, replace(state, velocities=state.velocities + 0.1)]
        bodies = rough if friction else scene
        spec = RolloutSpec(states, actions, 0.02, obstacles=bodies)
        launch = prepare(model, pack_constants(model), BufferPool(), spec, request)
        arguments = (*kernel_arrays(launch.integers, launch.doubles), launch.sizes.batch)
        tests.append(SelfTest(arguments, [launch.section(name) for name in RESULTS]))
    return tests
