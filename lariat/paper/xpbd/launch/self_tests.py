"""Launches by which the kernel's machine code is compared with Taichi's kernel."""

from __future__ import annotations

import numpy as np

from lariat.geometry.obstacles import Obstacle, pack
from lariat.kernel_cache.source import SelfTest
from lariat.paper.xpbd.launch.inputs import pack_constants, prepare, write_adjoint_seed
from lariat.paper.xpbd.model import XpbdRodModel
from lariat.paper.xpbd.properties import XpbdProperties
from lariat.rod.initial_shapes import straight
from lariat.rod.launch.buffers import BufferPool
from lariat.rod.rollout_spec import RolloutSpec


def self_tests() -> list[SelfTest]:
    """Return roll-outs of two ropes beside obstacles, with their adjoint."""
    model = XpbdRodModel(XpbdProperties(0.45, 0.008), 12)
    bar = Obstacle(
        "capsule", (0.2, 0.0, 0.285), (0.7071, 0.7071, 0.0, 0.0), radius=0.01, height=1.0
    )
    box = Obstacle("box", (0.3, 0.0, 0.2), size=(0.1, 0.1, 0.17))
    rng = np.random.default_rng(0)
    state = straight(model, (0.0, 0.0, 0.3), (1.0, 0.0, 0.3))
    spec = RolloutSpec(
        [state, state], rng.uniform(-0.3, 0.3, (2, 3, 2, 6)), 0.02, obstacles=pack([bar, box])
    )
    buffers = prepare(model, pack_constants(model), BufferPool(), spec, with_tape=True)
    write_adjoint_seed(buffers, rng.standard_normal((2, 3, 12, 3)))
    return [SelfTest((buffers.integers, buffers.doubles, 2, 1, 1), (buffers.rods,))]
