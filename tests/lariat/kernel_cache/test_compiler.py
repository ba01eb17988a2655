"""Machine code computes the same as Taichi, or is not kept."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from lariat.kernel_cache import cache, compiler
from lariat.kernel_cache.source import ROOT, KernelSource
from lariat.perception.centerline.chain_fit import KERNEL
from lariat.simulation.camera import camera_kernels

PROGRAM = """
import sys
from lariat.kernel_cache import compiler
from lariat.kernel_cache.language import ti

@ti.kernel
def kernel(values: ti.types.ndarray(dtype=ti.f64, ndim=1), flag: ti.i32):
    ti.loop_config(serialize=True)
    for i in range(values.shape[0]):
        values[i] = BODY

import numpy as np
from lariat.kernel_cache import runtime
runtime.start(writes_intermediate_code=True)
kernel(np.zeros(3), 1)
print(compiler._argument_codes(kernel))
compiler._machine_code("kernel")
"""


def translated(body: str, folder: object, serial: bool = True) -> subprocess.CompletedProcess[str]:
    """Return what the translation of a kernel printed, in a process of its own."""
    program = PROGRAM.replace("BODY", body)
    if not serial:
        program = program.replace("    ti.loop_config(serialize=True)\n", "")
    path = f"{folder}/program.py"
    with open(path, "w") as file:
        file.write(program)
    environment = {"HOME": str(folder), "PATH": "/usr/bin:/bin", "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, path], cwd=str(folder), env=environment, capture_output=True, text=True
    )


def test_argument_types_are_those_of_the_signature(tmp_path) -> None:
    done = translated("2.0 * i", tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "f64:1:0,i32"


def test_a_function_of_the_runtime_that_is_not_linked_is_named(tmp_path) -> None:
    done = translated("ti.tanh(values[i])", tmp_path)
    assert "tanh_f64" in done.stderr
    assert "RUNTIME_FUNCTIONS" in done.stderr


def test_a_parallel_kernel_is_refused(tmp_path) -> None:
    done = translated("2.0 * i", tmp_path, serial=False)
    assert "serial" in done.stderr


@pytest.mark.parametrize("source", [KERNEL, *camera_kernels.SOURCES], ids=lambda s: s.name)
def test_self_tests_of_a_kernel_change_what_it_writes(source: KernelSource) -> None:
    run = cache.kernel(source)
    for test in compiler.attribute(source.self_tests)():
        before = [result.copy() for result in test.results]
        run(*test.arguments)
        assert any(np.any(a != b) for a, b in zip(test.results, before, strict=True))


def test_machine_code_with_other_numbers_is_rejected() -> None:
    doubles = np.array([1.0, 2.0])
    compiler.compare([doubles * (1.0 + 1e-7)], [doubles])
    for wrong in (doubles * (1.0 + 1e-5), doubles * np.nan):
        with pytest.raises(ValueError, match="deviates"):
            compiler.compare([wrong], [doubles])
    counts = np.array([1, 200], np.uint8)
    compiler.compare([counts + 1], [counts])
    with pytest.raises(ValueError, match="deviates"):
        compiler.compare([counts + 2], [counts])
