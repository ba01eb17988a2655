"""The kernel from its library: what Taichi computes, of this source, and only that."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lariat.rod import Rod, RodProperties
from lariat.rod.launch import machine_code

has_assembler = pytest.mark.skipif(
    not (shutil.which("as") and shutil.which("ld")), reason="as and ld are not installed"
)


def slope() -> np.ndarray:
    rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 8)
    state = rod.straight((0.0, 0.0, 0.3), (1.0, 0.0, 0.3))
    actions = np.full((3, 2, 6), 0.1)
    found = rod.gradient(state, actions, 0.02, d_cost_d_positions=np.ones((3, 8, 3)))
    return found.actions


@has_assembler
def test_the_library_answers_as_taichi_does(monkeypatch: pytest.MonkeyPatch) -> None:
    assert machine_code.kernel() is not None
    with_library = slope()
    monkeypatch.setattr(machine_code, "kernel", lambda: None)
    through_taichi = slope()
    np.testing.assert_allclose(with_library, through_taichi, rtol=1e-10, atol=1e-16)


def test_the_key_follows_the_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here = Path(machine_code.__file__).parent
    for name in here.glob("*.py"):
        shutil.copy(name, tmp_path)
    before = machine_code._key()
    monkeypatch.setattr(machine_code, "_HERE", tmp_path)
    assert machine_code._key() == before
    with (tmp_path / "kernels_band.py").open("a") as source:
        source.write("# changed\n")
    assert machine_code._key() != before


@has_assembler
def test_a_rod_needs_no_taichi() -> None:
    program = (
        "import sys; from tests.lariat.rod.launch.test_machine_code import slope; slope(); "
        "sys.exit('taichi' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True, cwd=Path(__file__).parents[4])


@has_assembler
def test_what_is_no_library_leaves_the_rod_to_taichi(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    broken = tmp_path / ".cache" / "lariat" / f"rod-{machine_code._key()}.so"
    broken.parent.mkdir(parents=True)
    broken.write_text("no library")
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    assert machine_code.kernel.__wrapped__() is None
    assert "through Taichi" in caplog.text


@has_assembler
def test_after_a_failure_nobody_tries_again_at_every_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tries = []

    def fail(*command: object, **options: object) -> None:
        tries.append(command)
        raise subprocess.CalledProcessError(1, "python", "", "no room on the disk")

    monkeypatch.setattr(subprocess, "run", fail)
    for _ in range(2):
        with pytest.raises(OSError, match="no room on the disk"):
            machine_code._library(tmp_path)
    assert len(tries) == 1


@has_assembler
def test_a_home_that_cannot_be_written_leaves_the_rod_to_taichi(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Path, "home", lambda: Path("/proc"))
    assert machine_code.kernel.__wrapped__() is None
