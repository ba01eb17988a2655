"""The key of the kernel's machine code follows every source that the kernel is compiled from."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from lariat.rod.launch.kernel_key import PACKAGE_ROOT, kernel_key, own_sources


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    copy = tmp_path_factory.mktemp("checkout") / "lariat"
    shutil.copytree(PACKAGE_ROOT, copy, ignore=shutil.ignore_patterns("__pycache__"))
    return copy


def test_equal_sources_have_one_key_wherever_they_lie(package: Path) -> None:
    assert kernel_key(own_sources(package), package) == kernel_key(own_sources())


def test_the_key_changes_with_every_source(package: Path) -> None:
    before = kernel_key(own_sources(package), package)
    keys = {before}
    for source in own_sources(package):
        content = source.read_bytes()
        source.write_bytes(content + b"# changed\n")
        keys.add(kernel_key(own_sources(package), package))
        source.write_bytes(content)
    assert len(keys) == 1 + len(own_sources(package))
    assert kernel_key(own_sources(package), package) == before


def test_a_new_module_of_the_kernel_changes_the_key(package: Path) -> None:
    before = kernel_key(own_sources(package), package)
    new = package / "rod" / "kernels" / "friction.py"
    new.write_text("")
    assert kernel_key(own_sources(package), package) != before
    new.unlink()


def test_the_kernel_imports_nothing_that_the_key_leaves_out() -> None:
    keyed = {path.relative_to(PACKAGE_ROOT.parent).as_posix() for path in own_sources()}
    for path in own_sources():
        if path.parent.name != "kernels":
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("lariat"):
                module = str(node.module).replace(".", "/")
                for name in node.names:
                    files = {f"{module}.py", f"{module}/{name.name}.py", f"{module}/__init__.py"}
                    assert files & keyed, f"{path} imports {node.module}.{name.name}"


def test_importing_the_kernel_yields_the_key_of_its_files() -> None:
    program = (
        "from lariat.rod.launch import compilation, taichi_runtime; taichi_runtime.start(); "
        "from lariat.rod.kernels import rollout; "
        "from lariat.rod.launch.kernel_key import imported_sources, kernel_key; "
        "print(kernel_key(imported_sources()))"
    )
    output = subprocess.run(
        [sys.executable, "-c", program],
        cwd=PACKAGE_ROOT.parent,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert output.split()[-1] == kernel_key(own_sources())
