"""The key of a kernel's machine code follows every source that the kernel is compiled from."""

from __future__ import annotations

import ast
import shutil
from dataclasses import replace

import pytest

from lariat.kernel_cache.key import LEVEL, LEVEL_FEATURES, files, kernel_key, target
from lariat.kernel_cache.source import ROOT, KernelSource
from lariat.paper.xpbd.launch import kernel_launch as xpbd
from lariat.perception.centerline.chain_fit import KERNEL
from lariat.rod.launch.machine_code import SOURCE
from lariat.simulation.camera import camera_kernels

SOURCES = (SOURCE, KERNEL, xpbd.SOURCE, *camera_kernels.SOURCES)


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> KernelSource:
    """Return the rod's kernel in a copy of the package."""
    root = tmp_path_factory.mktemp("checkout")
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "lariat", root / "lariat", ignore=ignored)
    return replace(SOURCE, root=root)


def test_equal_sources_have_one_key_wherever_they_lie(copied: KernelSource) -> None:
    assert kernel_key(copied) == kernel_key(SOURCE)


def test_the_key_changes_with_every_source(copied: KernelSource) -> None:
    before = kernel_key(copied)
    keys = {before}
    for source in files(copied):
        content = source.read_bytes()
        source.write_bytes(content + b"# changed\n")
        keys.add(kernel_key(copied))
        source.write_bytes(content)
    assert len(keys) == 1 + len(files(copied))
    assert kernel_key(copied) == before


def test_a_new_module_of_the_kernel_changes_the_key(copied: KernelSource) -> None:
    before = kernel_key(copied)
    new = copied.root / "lariat" / "rod" / "kernels" / "friction.py"
    new.write_text("")
    assert kernel_key(copied) != before
    new.unlink()


@pytest.mark.parametrize("source", SOURCES, ids=lambda s: s.name)
def test_a_kernel_imports_nothing_that_its_key_leaves_out(source: KernelSource) -> None:
    keyed = {path.relative_to(ROOT).as_posix() for path in files(source)}
    for path in files(source):
        if "kernel_cache" in path.parts or "launch" in path.parts:
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and "." in (node.module or ""):
                module = str(node.module).replace(".", "/")
                for name in node.names:
                    modules = {f"{module}.py", f"{module}/{name.name}.py", f"{module}/__init__.py"}
                    language = "lariat/kernel_cache/language.py" in modules
                    assert language or modules & keyed, f"{path} imports {node.module}.{name.name}"


@pytest.mark.parametrize("feature", ["none", *sorted(LEVEL_FEATURES)])
def test_the_target_is_the_level_where_the_processor_has_all_of_it(
    feature: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from llvmlite import binding as llvm

    features = llvm.FeatureMap({name: name != feature for name in (*LEVEL_FEATURES, "sse2")})
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: features)
    processor, listed = target.__wrapped__()
    if feature == "none":
        assert (processor, listed) == (LEVEL, "")
    else:
        assert processor == llvm.get_host_cpu_name()
        assert f"-{feature}" in listed.split(",")
