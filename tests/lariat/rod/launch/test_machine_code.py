"""The kernel's library computes the same as Taichi, and comes from this package's sources alone."""

from __future__ import annotations

import logging
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lariat.rod import Rod, RodProperties, RolloutSpec
from lariat.rod.launch import machine_code
from lariat.rod.launch.kernel_key import PACKAGE_ROOT, kernel_key, own_sources

has_assembler = pytest.mark.skipif(
    not (shutil.which("as") and shutil.which("ld")), reason="as and ld are not installed"
)

REPOSITORY = PACKAGE_ROOT.parent
GRAVITY = 9.81
SAGGING_ROD = """
import sys
{imports}
import numpy as np
import lariat
from lariat.rod import Rod, RodProperties, RolloutSpec

rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 8, gravity=(0.0, 0.0, -{gravity}))
state = rod.straight((0.0, 0.0, 0.3), (1.0, 0.0, 0.3))
final = rod.rollout(RolloutSpec(state, np.zeros((5, 2, 6)), 0.02)).final.positions
assert "taichi" not in sys.modules
print(lariat.__path__[0], float(final[:, 2].min()).hex())
"""


def gradient() -> np.ndarray:
    rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 8)
    state = rod.straight((0.0, 0.0, 0.3), (1.0, 0.0, 0.3))
    actions = np.full((3, 2, 6), 0.1)
    found = rod.gradient(RolloutSpec(state, actions, 0.02), np.ones((3, 8, 3)))
    return found.actions


def sag(
    package: Path, current: Path, home: Path, search_path: str = "", gravity: float = GRAVITY
) -> float:
    """Return the height of a rod's lowest node, computed by a process of its own [m].

    Args:
        package: Folder of the package `lariat` that the process imports.
        current: Folder that the process runs in.
        home: Folder of its cache.
        search_path: PYTHONPATH of the process.
        gravity: Magnitude of gravity [m/s^2].
    """
    program = SAGGING_ROD.format(
        imports=f"sys.path.insert(0, {str(package.parent)!r})", gravity=gravity
    )
    environment = {"HOME": str(home), "PATH": "/usr/bin:/bin", "PYTHONPATH": search_path}
    output = subprocess.run(
        [sys.executable, "-c", program],
        cwd=current,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    assert output[0] == str(package)
    return float.fromhex(output[1])


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """Home folder whose cache holds the library of this package."""
    assert machine_code.kernel() is not None
    cache = tmp_path / "home" / ".cache" / "lariat"
    cache.mkdir(parents=True)
    key = kernel_key(own_sources())
    ours = machine_code.library_path(Path.home() / ".cache" / "lariat", key)
    shutil.copy(ours, machine_code.library_path(cache, key))
    return tmp_path / "home"


@has_assembler
def test_the_library_computes_the_same_as_taichi(monkeypatch: pytest.MonkeyPatch) -> None:
    assert machine_code.kernel() is not None
    with_library = gradient()
    monkeypatch.setattr(machine_code, "kernel", lambda: None)
    through_taichi = gradient()
    np.testing.assert_allclose(with_library, through_taichi, rtol=1e-10, atol=1e-14)


@has_assembler
def test_two_checkouts_each_run_their_own_physics(tmp_path: Path, home: Path) -> None:
    first, second = tmp_path / "first" / "lariat", tmp_path / "second" / "lariat"
    for package in (first, second):
        shutil.copytree(PACKAGE_ROOT, package, ignore=shutil.ignore_patterns("__pycache__"))
    energy = second / "rod" / "kernels" / "energy.py"
    source = energy.read_text()
    changed = source.replace("displacement - gravity)", "displacement - 2.0 * gravity)")
    assert changed != source
    energy.write_text(changed)

    # The process runs in the first checkout, first on the search path, with the second's package.
    doubled = sag(second, first.parent, home, search_path=str(first.parent))
    plain = sag(first, second.parent, home, search_path=str(second.parent))

    assert plain == sag(PACKAGE_ROOT, REPOSITORY, home)
    assert doubled == pytest.approx(sag(first, tmp_path, home, gravity=2.0 * GRAVITY), rel=1e-9)
    assert abs(doubled - plain) > 1e-3
    assert sag(second, first.parent, home) == doubled


@has_assembler
def test_folders_named_like_packages_do_not_shadow_them_while_compiling(tmp_path: Path) -> None:
    for name in ("lariat", "shared", "services"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise ImportError('the wrong package')")
    program = machine_code._COMPILING_PROGRAM.replace(
        "compilation.main(folder)", "print(compilation.__file__)"
    )
    output = subprocess.run(
        [sys.executable, "-P", "-c", program, str(PACKAGE_ROOT), str(tmp_path)],
        cwd=tmp_path,
        env={"HOME": str(tmp_path), "PATH": "/usr/bin:/bin", "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert output.split()[-1] == str(PACKAGE_ROOT / "rod" / "launch" / "compilation.py")


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
    key = kernel_key(own_sources())
    own = machine_code.library_path(cache, key)
    kept = shutil.copy(own, tmp_path)
    if foreign == "no library":
        own.write_text("no library")
    else:
        own.write_bytes(own.read_bytes().replace(key.encode(), b"0123456789abcdef" * 4))
    compiled = []

    def compile_own(path: Path, failure: Path) -> None:
        compiled.append(path)
        shutil.copy(kept, path)

    monkeypatch.setattr(Path, "home", lambda: home)
    monkeypatch.setattr(machine_code, "_compile", compile_own)
    assert machine_code.kernel.__wrapped__() is not None
    assert compiled == [own]
    assert str(own) in caplog.text


@has_assembler
def test_a_library_compiled_from_changed_sources_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def compile_other(command: list[str], **options: object) -> None:
        machine_code.library_path(Path(command[-1]), "f" * 64).write_text("of other sources")

    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    monkeypatch.setattr(subprocess, "run", compile_other)
    with caplog.at_level(logging.WARNING):
        assert machine_code.kernel.__wrapped__() is None
    assert "sources changed" in caplog.text


@has_assembler
def test_a_rod_needs_no_taichi() -> None:
    program = (
        "import sys; from tests.lariat.rod.launch.test_machine_code import gradient; gradient(); "
        "sys.exit('taichi' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True, cwd=REPOSITORY)


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
            machine_code._library(tmp_path, kernel_key(own_sources()))
    assert len(attempts) == 1


@has_assembler
def test_without_a_writable_home_the_rod_runs_through_taichi(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(Path, "home", lambda: Path("/proc"))
    assert machine_code.kernel.__wrapped__() is None
    assert "through Taichi" in caplog.text
