"""A kernel is compiled once, from this package's sources alone, and kept."""

from __future__ import annotations

import importlib.metadata
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lariat.kernel_cache import cache
from lariat.kernel_cache.key import LANGUAGES, cache_folder, kernel_key
from lariat.kernel_cache.source import ROOT, KernelSource, NoCompilerError
from lariat.rod.launch.machine_code import SOURCE
from lariat.simulation.camera import camera_kernels
from lariat.simulation.camera.kernel_self_tests import edges

PACKAGE_ROOT = ROOT / "lariat"
KERNELS = """
from lariat.kernel_cache.language import ti

doubles = ti.types.ndarray(dtype=ti.f64, ndim=1)

@ti.kernel
def scale(values: doubles, factor: ti.f64):
    ti.loop_config(serialize=True)
    for i in range(values.shape[0]):
        values[i] *= FACTOR * factor
"""
"""Module with a small kernel."""
SELF_TESTS = """
import numpy as np
from lariat.kernel_cache.source import SelfTest

def scale():
    values = np.array([1.0, 2.0, 3.0])
    return [SelfTest((values, 0.5), (values,))]
"""
SCALING = """
import sys
sys.path.insert(0, sys.argv[1])
import numpy as np
import lariat
from lariat.kernel_cache import cache
from lariat.kernel_cache.source import KernelSource

values = np.array([1.0, 10.0])
source = KernelSource("scale", "probe.kernels:scale", ("probe.kernels",), "probe.self_tests:scale")
cache.kernel(source)(values, 0.5)
assert "taichi" not in sys.modules
print(lariat.__path__[0], *values)
"""
"""Program that scales numbers by the kernel of a checkout."""


def checkout(folder: Path, factor: float) -> Path:
    """Return a checkout with a small kernel that scales numbers by a factor."""
    ignored = shutil.ignore_patterns("__pycache__", "rod")
    shutil.copytree(PACKAGE_ROOT, folder / "lariat", ignore=ignored)
    probe = folder / "probe"
    probe.mkdir()
    (probe / "__init__.py").write_text("")
    (probe / "kernels.py").write_text(KERNELS.replace("FACTOR", str(factor)))
    (probe / "self_tests.py").write_text(SELF_TESTS)
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
    done = subprocess.run(
        [sys.executable, "-c", SCALING, str(root)],
        cwd=current,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    output = done.stdout.split()
    assert output[0] == str(root / "lariat")
    return [float(word) for word in output[1:]]


def probe(root: Path) -> KernelSource:
    """Return the small kernel of a checkout."""
    return KernelSource(
        "scale", "probe.kernels:scale", ("probe.kernels",), "probe.self_tests:scale", root
    )


def without_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let this process find the version of neither Taichi nor Quadrants."""
    version = importlib.metadata.version

    def other_version(name: str) -> str:
        if name in LANGUAGES:
            raise importlib.metadata.PackageNotFoundError(name)
        return version(name)

    monkeypatch.setattr(importlib.metadata, "version", other_version)


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a checkout, and a cache that holds its small kernel."""
    folder = tmp_path_factory.mktemp("compiled")
    root = checkout(folder / "checkout", 4.0)
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("XDG_CACHE_HOME", str(folder / "kept"))
        cache.kernel.__wrapped__(probe(root))
    return folder


@pytest.fixture
def kept(compiled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the file of a small kernel in a cache of its own."""
    root = shutil.copytree(compiled, tmp_path, dirs_exist_ok=True) / "checkout"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "kept"))
    return cache.kernel_path(tmp_path / "kept" / "lariat", "scale", kernel_key(probe(root)))


def test_two_checkouts_each_run_their_own_kernel(tmp_path: Path) -> None:
    first, second = checkout(tmp_path / "first", 4.0), checkout(tmp_path / "second", 6.0)

    # Each process runs in one checkout, first on the search path, with the packages of the other.
    for _ in range(2):
        assert scaled(first, second, tmp_path, search_path=second) == [2.0, 20.0]
        assert scaled(second, first, tmp_path, search_path=first) == [3.0, 30.0]
    assert len(list((tmp_path / ".cache" / "lariat").glob("scale-*.kernel"))) == 2


def test_folders_named_like_packages_do_not_shadow_them_while_compiling(tmp_path: Path) -> None:
    for name in ("lariat", "shared", "services"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise ImportError('the wrong package')")
    command = cache.compiling_command(SOURCE, tmp_path)
    place = command.index("-c") + 1
    shown = command[place].replace("compiler.main(folder, source)", "print(compiler.__file__)")
    output = subprocess.run(
        [*command[:place], shown, *command[place + 1 :]],
        cwd=tmp_path,
        env={"HOME": str(tmp_path), "PATH": "/usr/bin:/bin", "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert output.split()[-1] == str(PACKAGE_ROOT / "kernel_cache" / "compiler.py")


def test_the_folder_is_that_of_the_users_caches(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "lariat"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert cache_folder() == Path.home() / ".cache" / "lariat"


@pytest.mark.parametrize("damage", ["other text", "half", "one byte"])
def test_a_damaged_file_is_compiled_anew(
    damage: str, kept: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    whole = kept.read_bytes()
    other = bytes([whole[-9] ^ 1])
    kept.write_bytes(
        {"other text": b"no kernel", "half": whole[: len(whole) // 2]}.get(
            damage, whole[:-9] + other + whole[-8:]
        )
    )
    values = np.array([1.0, 10.0])
    cache.kernel.__wrapped__(probe(tmp_path / "checkout"))(values, 0.5)
    np.testing.assert_array_equal(values, [2.0, 20.0])
    assert str(kept) in caplog.text
    assert kept.read_bytes() == whole


def test_what_was_compiled_from_changed_sources_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def compile_other(command: list[str], **options: object) -> None:
        cache.kernel_path(tmp_path / "lariat", "rod", "f" * 64).write_text("of other sources")

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(subprocess, "run", compile_other)
    with pytest.raises(RuntimeError, match=f"{SOURCE.name} changed"):
        cache.kernel.__wrapped__(SOURCE)


def test_a_failed_compilation_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = checkout(tmp_path / "checkout", 4.0)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    (root / "probe" / "self_tests.py").write_text("def scale(): raise ValueError('no test')")
    with pytest.raises(RuntimeError, match=r"scale.*ValueError: no test"):
        cache.kernel.__wrapped__(probe(root))


def test_a_rod_needs_no_taichi() -> None:
    program = (
        "import sys; import numpy as np; from lariat.rod import Rod, RodProperties, RolloutSpec; "
        "rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 8); "
        "state = rod.straight((0.0, 0.0, 0.3), (1.0, 0.0, 0.3)); "
        "rod.rollout(RolloutSpec(state, np.zeros((3, 2, 6)), 0.02)); "
        "sys.exit('taichi' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True, cwd=ROOT)


def test_without_a_compiler_what_is_kept_is_used(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    without_compiler(monkeypatch)
    values = np.array([1.0, 10.0])
    cache.kernel.__wrapped__(probe(tmp_path / "checkout"))(values, 0.5)
    np.testing.assert_array_equal(values, [2.0, 20.0])
    kept.unlink()
    with pytest.raises(NoCompilerError):
        cache.kernel.__wrapped__(probe(tmp_path / "checkout"))
    assert not caplog.text


@pytest.mark.parametrize(
    "launch",
    [
        "chain_fit.ChainFit(8, 0.5)",
        "Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 8).rest(*GRIPS)",
        "paper_rod(PaperControl(), 0.45, 0.008, 8).rest(*GRIPS)",
    ],
)
def test_without_a_compiler_and_a_kernel_the_way_out_is_named(launch: str, tmp_path: Path) -> None:
    program = (
        "import numpy as np; "
        "from lariat.kernel_cache import key; key.LANGUAGES = (); "
        "from lariat.geometry.poses import Pose; "
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
    assert "NoCompilerError" in last
    assert "Taichi" in last
    assert "Quadrants" in last
    assert "docker compose build" in last


def test_where_nothing_can_be_kept_a_kernel_is_compiled_for_its_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    root = checkout(tmp_path / "checkout", 4.0)
    # A file in its place, which root cannot write either.
    (tmp_path / "kept").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "kept"))
    values = np.array([1.0, 10.0])
    cache.kernel.__wrapped__(probe(root))(values, 0.5)
    np.testing.assert_array_equal(values, [2.0, 20.0])
    assert "cannot be kept" in caplog.text


def test_a_compiled_kernel_refuses_other_arrays_than_it_takes() -> None:
    kernel = cache.kernel(camera_kernels.EDGES)
    depth, z_buffer, *others = map(np.asarray, edges()[0].arguments)
    with pytest.raises(TypeError, match=r"uint16.*int32"):
        kernel(depth.astype(np.int32), z_buffer, *others)
    with pytest.raises(TypeError, match=r"contiguous.*float32"):
        kernel(depth, z_buffer[:, ::2], *others)
    with pytest.raises(TypeError, match="expected 5 arguments, got 2"):
        kernel(depth, z_buffer)


def test_a_prepared_call_sees_what_its_arrays_hold_and_takes_the_last_numbers(
    kept: Path, tmp_path: Path
) -> None:
    kernel = cache.kernel.__wrapped__(probe(tmp_path / "checkout"))
    values = np.array([1.0, 10.0])
    call = kernel.prepared(values)
    call(0.5)
    np.testing.assert_array_equal(values, [2.0, 20.0])
    values[1] = 0.0
    call(1.0)
    np.testing.assert_array_equal(values, [8.0, 0.0])
    for numbers in ((), (3.0, 3.0)):
        with pytest.raises(ValueError, match="zip"):
            call(*numbers)
    with pytest.raises(TypeError, match="expected all arrays"):
        kernel.prepared()


def test_seeing_a_rope_in_simulation_needs_no_taichi() -> None:
    program = (
        "import sys; from lariat.simulation.camera.rgbd_camera import RgbdCamera; "
        "from lariat.perception.centerline.chain_fit import ChainFit; "
        "from tests.lariat.simulation.camera.test_rgbd_camera import VIEW, arch; "
        "RgbdCamera(VIEW).take(arch(), 0.01); "
        "ChainFit(10, 0.5); sys.exit('taichi' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True, cwd=ROOT)
