"""Batches of rods: one launch computes what separate launches compute, on any number of threads."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lariat.geometry.obstacles import Obstacle, pack
from lariat.kernel_cache.language import ti
from lariat.rod import Rod, RodProperties, RolloutSpec
from lariat.rod.launch.kernel_launch import Device

PROPERTIES = RodProperties(0.45, 0.008, 0.044, 1e6)
ROOT = Path(__file__).parents[3]
ON_A_DEVICE = """
import sys
import numpy as np
from lariat.geometry.obstacles import Obstacle, pack
from lariat.rod import Rod, RodProperties, RolloutSpec
rods = [
    Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 12, scheme="sdirk2", self_contact=True, device=d)
    for d in (None, sys.argv[1])
]
start = rods[0].straight([0.0, 0.0, 0.3], [1.0, 0.0, 0.3])
rng = np.random.default_rng(0)
obstacles = pack([Obstacle("sphere", (0.2, 0.0, 0.27), radius=0.02)])
for count in (1, 5, 5):
    actions = rng.uniform(-0.3, 0.3, (count, 3, 2, 6))
    spec = RolloutSpec([start] * count, actions, 0.01, obstacles=obstacles, substeps=2)
    cost = rng.standard_normal((count, 3, 12, 3))
    for a, b in zip(*(rod.gradient(spec, cost) for rod in rods), strict=True):
        np.testing.assert_allclose(a.rollout.positions, b.rollout.positions, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(a.actions, b.actions, rtol=1e-9, atol=1e-12)
    for a, b in zip(*(rod.linearize(spec) for rod in rods), strict=True):
        ours, theirs = a.d_positions_d_actions, b.d_positions_d_actions
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-11)
"""
OBSTACLES = pack([Obstacle("sphere", (0.2, 0.0, 0.27), radius=0.02)])


@pytest.mark.parametrize("threads", [2, 3, 8])
def test_threads_share_a_batch_without_changing_its_results(threads: int) -> None:
    one, many = Rod(PROPERTIES, 12), Rod(PROPERTIES, 12, threads=threads)
    rng = np.random.default_rng(threads)
    start = one.straight([0.0, 0.0, 0.3], [1.0, 0.0, 0.3])
    states = [
        replace(start, velocities=0.3 * rng.standard_normal(start.velocities.shape))
        for _ in range(5)
    ]
    actions = rng.uniform(-0.3, 0.3, (5, 3, 2, 6))
    spec = RolloutSpec(states, actions, 0.01, obstacles=OBSTACLES)
    cost = rng.standard_normal((5, 3, 12, 3))
    for a, b in zip(one.rollout(spec), many.rollout(spec), strict=True):
        np.testing.assert_array_equal(a.positions, b.positions)
    for a, b in zip(one.linearize(spec), many.linearize(spec), strict=True):
        np.testing.assert_array_equal(a.d_positions_d_actions, b.d_positions_d_actions)
    for a, b in zip(one.gradient(spec, cost), many.gradient(spec, cost), strict=True):
        np.testing.assert_array_equal(a.actions, b.actions)
        assert a.parameters == b.parameters


def test_a_rod_without_threads_is_refused() -> None:
    with pytest.raises(ValueError, match=r"threads.*0"):
        Rod(PROPERTIES, 12, threads=0)


@pytest.mark.parametrize("device", ["taichi-cpu", "cuda"])
def test_a_device_computes_what_machine_code_computes(device: Device) -> None:
    # Taichi runs on one device in a process.
    done = subprocess.run(
        [sys.executable, "-c", ON_A_DEVICE, device], capture_output=True, text=True, cwd=ROOT
    )
    if device == "cuda" and "device='cuda' needs a GPU" in done.stderr:
        pytest.skip("no CUDA: " + done.stderr.strip().splitlines()[-1])
    assert done.returncode == 0, done.stderr


def test_a_missing_gpu_is_named_with_a_way_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ti.lang.misc, "is_arch_supported", lambda arch: False)
    with pytest.raises(ValueError, match=r"'cuda'.*GPU.*'taichi-cpu'"):
        Rod(PROPERTIES, 12, device="cuda")


def test_a_device_with_threads_is_refused() -> None:
    with pytest.raises(ValueError, match="leave out threads=2"):
        Rod(PROPERTIES, 12, threads=2, device="taichi-cpu")
