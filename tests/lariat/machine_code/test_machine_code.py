"""A kernel's library computes the same as Taichi, and comes from this package's sources alone."""

from __future__ import annotations

import importlib.metadata
import logging
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lariat.machine_code import compilation, library
from lariat.machine_code.kernel_key import own_key
from lariat.machine_code.kernel_source import ROOT, KernelSource
from lariat.perception.centerline.chain_fit import KERNEL
from lariat.rod import Rod, RodProperties, RolloutSpec
from lariat.rod.launch import machine_code
from lariat.rod.launch.machine_code import SOURCE
from lariat.simulation.camera import camera_kernels

has_assembler = pytest.mark.skipif(
    not (shutil.which("as") and shutil.which("ld")), reason="as and ld are not installed"
)

PACKAGE_ROOT = ROOT / "lariat"
KERNELS = """
import taichi as ti

doubles = ti.types.ndarray(dtype=ti.f64, ndim=1)

@ti.kernel
def scale(values: doubles, factor: ti.f64):
    ti.loop_config(serialize=True)
    for i in range(values.shape[0]):
        values[i] *= FACTOR * factor
"""
"""Module with a small kernel."""
TRIALS = """
import numpy as np
from lariat.machine_code.kernel_source import Trial

def trials():
    values = np.array([1.0, 2.0, 3.0])
    return [Trial((values, 0.5), (values,))]
"""
SCALING = """
import sys
sys.path.insert(0, sys.argv[1])
import numpy as np
import lariat
from lariat.machine_code import library
from lariat.machine_code.kernel_source import KernelSource

values = np.array([1.0, 10.0])
source = KernelSource("scale", "probe.kernels:scale", ("probe.kernels",), "probe.trials:trials")
library.compiled_kernel(source)(values, 0.5)
assert "taichi" not in sys.modules
print(lariat.__path__[0], *values)
"""
"""Program that scales numbers by the kernel of a checkout."""


def gradient() -> np.ndarray:
    rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 8)
    state = rod.straight((0.0, 0.0, 0.3), (1.0, 0.0, 0.3))
    actions = np.full((3, 2, 6), 0.1)
    found = rod.gradient(RolloutSpec(state, actions, 0.02), np.ones((3, 8, 3)))
    return found.actions


def checkout(folder: Path, factor: float) -> Path:
    """Return a checkout with a small kernel that scales numbers by a factor."""
    ignored = shutil.ignore_patterns("__pycache__", "rod")
    shutil.copytree(PACKAGE_ROOT, folder / "lariat", ignore=ignored)
    probe = folder / "probe"
    probe.mkdir()
    (probe / "__init__.py").write_text("")
    (probe / "kernels.py").write_text(KERNELS.replace("FACTOR", str(factor)))
    (probe / "trials.py").write_text(TRIALS)
    return folder


def scaled(root: Path, current: Path, home: Path, search_path: Path) -> list[float]:
    """Return 1 and 10, scaled by the kernel of a checkout in a process of its own.

    Args:
        root: The checkout.
        current: Folder that the process runs in.
        home: Folder of its cache.
        search_path: PYTHONPATH of the process.
    """
    environment = {"HOME": str(home), "PATH": "/usr/bin:/bin", "PYTHONPATH": str(search_path)}
    output = subprocess.run(
        [sys.executable, "-c", SCALING, str(root)],
        cwd=current,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    assert output[0] == str(root / "lariat")
    return [float(word) for word in output[1:]]


def probe(root: Path) -> KernelSource:
    """Return the small kernel of a checkout."""
    return KernelSource(
        "scale", "probe.kernels:scale", ("probe.kernels",), "probe.trials:trials", root
    )


def without_taichi(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let this process find neither Taichi nor its version."""
    version, find_spec = importlib.metadata.version, library.find_spec

    def other_version(name: str) -> str:
        if name == "taichi":
            raise importlib.metadata.PackageNotFoundError(name)
        return version(name)

    monkeypatch.setattr(importlib.metadata, "version", other_version)
    monkeypatch.setattr(library, "find_spec", lambda name: name != "taichi" and find_spec(name))


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """Home folder whose cache holds the library of this package."""
    assert machine_code.kernel() is not None
    cache = tmp_path / "home" / ".cache" / "lariat"
    cache.mkdir(parents=True)
    key = own_key(SOURCE)
    ours = library.library_path(Path.home() / ".cache" / "lariat", "rod", key)
    shutil.copy(ours, library.library_path(cache, "rod", key))
    return tmp_path / "home"


@has_assembler
def test_the_library_computes_the_same_as_taichi(monkeypatch: pytest.MonkeyPatch) -> None:
    assert machine_code.kernel() is not None
    with_library = gradient()
    monkeypatch.setattr(machine_code, "kernel", lambda: None)
    through_taichi = gradient()
    np.testing.assert_allclose(with_library, through_taichi, rtol=1e-10, atol=1e-14)


@has_assembler
def test_two_checkouts_each_run_their_own_kernel(tmp_path: Path) -> None:
    first, second = checkout(tmp_path / "first", 4.0), checkout(tmp_path / "second", 6.0)

    # Each process runs in one checkout, first on the search path, with the packages of the other.
    for _ in range(2):
        assert scaled(first, second, tmp_path, search_path=second) == [2.0, 20.0]
        assert scaled(second, first, tmp_path, search_path=first) == [3.0, 30.0]
    assert len(list((tmp_path / ".cache" / "lariat").glob("scale-*.so"))) == 2


@has_assembler
def test_folders_named_like_packages_do_not_shadow_them_while_compiling(tmp_path: Path) -> None:
    for name in ("lariat", "shared", "services"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise ImportError('the wrong package')")
    command = library.compiling_command(SOURCE, tmp_path)
    place = command.index("-c") + 1
    shown = command[place].replace(
        "compilation.main(folder, source)", "print(compilation.__file__)"
    )
    output = subprocess.run(
        [*command[:place], shown, *command[place + 1 :]],
        cwd=tmp_path,
        env={"HOME": str(tmp_path), "PATH": "/usr/bin:/bin", "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert output.split()[-1] == str(PACKAGE_ROOT / "machine_code" / "compilation.py")


@has_assembler
@pytest.mark.parametrize("foreign", ["other sources", "no library"])
def test_a_foreign_library_is_replaced(
    foreign: str,
    tmp_path: Path,
    home: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    cache = home / ".cache" / "lariat"
    key = own_key(SOURCE)
    own = library.library_path(cache, "rod", key)
    kept = shutil.copy(own, tmp_path)
    if foreign == "no library":
        own.write_text("no library")
    else:
        own.write_bytes(own.read_bytes().replace(key.encode(), b"0123456789abcdef" * 4))
    compiled = []

    def compile_own(source: KernelSource, path: Path, failure: Path) -> None:
        compiled.append(path)
        shutil.copy(kept, path)

    monkeypatch.setattr(Path, "home", lambda: home)
    monkeypatch.setattr(library, "_compile", compile_own)
    assert library.compiled_kernel.__wrapped__(SOURCE) is not None
    assert compiled == [own]
    assert str(own) in caplog.text


@has_assembler
def test_a_library_compiled_from_changed_sources_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def compile_other(command: list[str], **options: object) -> None:
        library.library_path(tmp_path, "rod", "f" * 64).write_text("of other sources")

    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    monkeypatch.setattr(subprocess, "run", compile_other)
    with caplog.at_level(logging.WARNING):
        assert library.compiled_kernel.__wrapped__(SOURCE) is None
    assert "sources changed" in caplog.text


@has_assembler
def test_a_rod_needs_no_taichi() -> None:
    program = (
        "import sys; import numpy as np; from lariat.rod import Rod, RodProperties, RolloutSpec; "
        "rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 8); "
        "state = rod.straight((0.0, 0.0, 0.3), (1.0, 0.0, 0.3)); "
        "rod.rollout(RolloutSpec(state, np.zeros((3, 2, 6)), 0.02)); "
        "sys.exit('taichi' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True, cwd=ROOT)


@has_assembler
@pytest.mark.parametrize("kept", [True, False], ids=["kept", "not kept"])
def test_without_taichi_a_kept_library_is_used(
    kept: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    root = checkout(tmp_path / "checkout", 4.0)
    if kept:
        scaled(root, tmp_path, tmp_path, search_path=tmp_path)
    without_taichi(monkeypatch)
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    compiled = library.compiled_kernel.__wrapped__(probe(root))
    assert (compiled is not None) == kept
    assert not caplog.text
    if compiled is not None:
        values = np.array([1.0, 10.0])
        compiled(values, 0.5)
        np.testing.assert_array_equal(values, [2.0, 20.0])


@pytest.mark.parametrize(
    "launch",
    [
        "library.kernel(chain_fit.KERNEL)",
        "Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 8).rest(*GRIPS)",
        "paper_rod(PaperControl(), 0.45, 0.008, 8).rest(*GRIPS)",
    ],
)
def test_without_taichi_and_a_library_the_way_out_is_named(launch: str, tmp_path: Path) -> None:
    program = (
        "import sys; sys.modules['taichi'] = None; import numpy as np; "
        "from lariat.geometry.poses import Pose; from lariat.machine_code import library; "
        "from lariat.rod import Rod, RodProperties; "
        "from lariat.controllers import paper_rod; "
        "from lariat.perception.centerline import chain_fit; "
        "from lariat.scenario.sections import PaperControl; "
        "places = np.zeros(3), np.array([0.4, 0.0, 0.0]); "
        "GRIPS = [Pose(p, np.array([1.0, 0.0, 0.0, 0.0])) for p in places]; "
        f"{launch}"
    )
    environment = {"HOME": str(tmp_path), "PATH": "/usr/bin:/bin"}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, env=environment, capture_output=True, text=True
    )
    last = done.stderr.splitlines()[-1]
    assert "NoCompilerError: Taichi is not installed" in last
    assert "docker compose build" in last


@has_assembler
def test_a_missing_library_is_none_without_an_assembler(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    root = checkout(tmp_path / "checkout", 4.0)
    scaled(root, tmp_path, tmp_path, search_path=tmp_path)
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert library.compiled_kernel.__wrapped__(probe(root)) is not None
    changed = root / "probe" / "kernels.py"
    changed.write_text(changed.read_text() + "# changed\n")
    assert library.compiled_kernel.__wrapped__(probe(root)) is None
    assert not caplog.text


@has_assembler
def test_a_failed_compilation_is_not_repeated_at_every_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    attempts = []

    def fail(*command: object, **options: object) -> None:
        attempts.append(command)
        raise subprocess.CalledProcessError(1, "python", "", "no room on the disk")

    monkeypatch.setattr(subprocess, "run", fail)
    for _ in range(2):
        with pytest.raises(OSError, match="no room on the disk"):
            library._library(SOURCE, tmp_path, own_key(SOURCE))
    assert len(attempts) == 1


@has_assembler
def test_without_a_writable_home_the_rod_runs_through_taichi(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(Path, "home", lambda: Path("/proc"))
    assert library.compiled_kernel.__wrapped__(SOURCE) is None
    assert "through Taichi" in caplog.text


@has_assembler
@pytest.mark.parametrize("source", [KERNEL, *camera_kernels.SOURCES], ids=lambda s: s.name)
def test_kernels_of_services_have_libraries(source: KernelSource) -> None:
    compiled = library.compiled_kernel(source)
    assert compiled is not None
    for trial in compilation.attribute(source.trials)():
        before = [result.copy() for result in trial.results]
        compiled(*trial.arguments)
        assert any(np.any(a != b) for a, b in zip(trial.results, before, strict=True))


@has_assembler
def test_the_library_of_the_fit_computes_the_same_as_taichi() -> None:
    compiled, through_taichi = library.compiled_kernel(KERNEL), library._through_taichi(KERNEL)
    assert compiled is not None
    trials = compilation.attribute(KERNEL.trials)
    for trial, other in zip(trials(), trials(), strict=True):
        compiled(*trial.arguments)
        through_taichi(*other.arguments)
        compilation.compare(trial.results, other.results)


def test_a_library_with_other_numbers_is_rejected() -> None:
    doubles = np.array([1.0, 2.0])
    compilation.compare([doubles * (1.0 + 1e-10)], [doubles])
    for wrong in (doubles * (1.0 + 1e-8), doubles * np.nan):
        with pytest.raises(ValueError, match="deviates from Taichi's kernel"):
            compilation.compare([wrong], [doubles])
    counts = np.array([1, 200], np.uint8)
    compilation.compare([counts + 1], [counts])
    with pytest.raises(ValueError, match="deviates"):
        compilation.compare([counts + 2], [counts])


@has_assembler
def test_a_compiled_kernel_refuses_other_arrays_than_it_takes() -> None:
    compiled = library.compiled_kernel(camera_kernels.EDGES)
    assert compiled is not None
    depth, z_buffer, *others = compilation.attribute(camera_kernels.EDGES.trials)()[0].arguments
    with pytest.raises(TypeError, match="array of uint16 with 2 dimensions, got int32"):
        compiled(depth.astype(np.int32), z_buffer, *others)
    with pytest.raises(TypeError, match="contiguous array of float32"):
        compiled(depth, z_buffer[:, ::2], *others)
    with pytest.raises(TypeError, match="expected 5 arguments, got 2"):
        compiled(depth, z_buffer)


@has_assembler
def test_a_prepared_call_sees_what_its_arrays_hold_and_takes_the_last_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    root = checkout(tmp_path / "checkout", 4.0)
    compiled = library.compiled_kernel.__wrapped__(probe(root))
    assert compiled is not None
    values = np.array([1.0, 10.0])
    call = compiled.prepared(values)
    call(0.5)
    np.testing.assert_array_equal(values, [2.0, 20.0])
    values[1] = 0.0
    call(1.0)
    np.testing.assert_array_equal(values, [8.0, 0.0])
    for numbers in ((), (3.0, 3.0)):
        with pytest.raises(ValueError, match="zip"):
            call(*numbers)
    with pytest.raises(TypeError, match="expected all arrays"):
        compiled.prepared()


@has_assembler
def test_seeing_a_rope_in_simulation_needs_no_taichi() -> None:
    program = (
        "import sys; from lariat.simulation.camera.rgbd_camera import RgbdCamera; "
        "from lariat.perception.centerline.chain_fit import ChainFit; "
        "from tests.lariat.simulation.camera.test_rgbd_camera import VIEW, arch; "
        "RgbdCamera(VIEW).take(arch(), 0.01); "
        "ChainFit(10, 0.5); sys.exit('taichi' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True, cwd=ROOT)
