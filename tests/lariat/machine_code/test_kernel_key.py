"""The key of a kernel's machine code follows every source that the kernel is compiled from."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from dataclasses import replace

import pytest

from lariat.machine_code.kernel_key import own_files, own_key
from lariat.machine_code.kernel_source import ROOT, KernelSource
from lariat.perception.centerline.chain_fit import KERNEL
from lariat.rod.launch.machine_code import SOURCE
from lariat.simulation.camera import camera_kernels

SOURCES = (SOURCE, KERNEL, *camera_kernels.SOURCES)


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> KernelSource:
    """Return the rod's kernel in a copy of the package."""
    root = tmp_path_factory.mktemp("checkout")
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "lariat", root / "lariat", ignore=ignored)
    return replace(SOURCE, root=root)


def test_equal_sources_have_one_key_wherever_they_lie(copied: KernelSource) -> None:
    assert own_key(copied) == own_key(SOURCE)


def test_the_key_changes_with_every_source(copied: KernelSource) -> None:
    before = own_key(copied)
    keys = {before}
    for source in own_files(copied):
        content = source.read_bytes()
        source.write_bytes(content + b"# changed\n")
        keys.add(own_key(copied))
        source.write_bytes(content)
    assert len(keys) == 1 + len(own_files(copied))
    assert own_key(copied) == before


def test_a_new_module_of_the_kernel_changes_the_key(copied: KernelSource) -> None:
    before = own_key(copied)
    new = copied.root / "lariat" / "rod" / "kernels" / "friction.py"
    new.write_text("")
    assert own_key(copied) != before
    new.unlink()


@pytest.mark.parametrize("source", SOURCES, ids=lambda s: s.name)
def test_a_kernel_imports_nothing_that_its_key_leaves_out(source: KernelSource) -> None:
    keyed = {path.relative_to(ROOT).as_posix() for path in own_files(source)}
    for path in own_files(source):
        if "machine_code" in path.parts or "launch" in path.parts:
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and "." in (node.module or ""):
                module = str(node.module).replace(".", "/")
                for name in node.names:
                    files = {f"{module}.py", f"{module}/{name.name}.py", f"{module}/__init__.py"}
                    assert files & keyed, f"{path} imports {node.module}.{name.name}"


@pytest.mark.parametrize("source", [SOURCE, camera_kernels.ROPE], ids=lambda s: s.name)
def test_importing_a_kernel_yields_the_key_of_its_files(source: KernelSource) -> None:
    module = source.function.partition(":")[0]
    program = (
        "from lariat.machine_code import compilation, taichi_runtime; taichi_runtime.start(); "
        f"import {module}, pathlib; "
        "from lariat.machine_code.kernel_key import imported_files, kernel_key; "
        "from lariat.machine_code.kernel_source import KernelSource, ROOT; "
        f"source = KernelSource('', '', {source.modules!r}, ''); "
        "print(kernel_key(imported_files(source), ROOT))"
    )
    output = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    assert output.split()[-1] == own_key(source)
