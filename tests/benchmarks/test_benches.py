"""The table of benches names modules that exist and explain themselves."""

from __future__ import annotations

import importlib
import inspect
import pkgutil

import pytest

import benchmarks
from benchmarks.benches import BENCHES


@pytest.mark.parametrize("name", BENCHES)
def test_bench_has_a_documented_run(name: str) -> None:
    run = importlib.import_module(BENCHES[name].module).run
    documentation = inspect.getdoc(run) or ""
    arguments = documentation.partition("\nArgs:")[2]
    for parameter in inspect.signature(run).parameters:
        # The fields of `options` carry their docstrings.
        if parameter != "options":
            assert f"{parameter}:" in arguments, f"{name}: no help for {parameter}"


def test_every_module_with_a_run_is_in_the_table() -> None:
    listed = {bench.module for bench in BENCHES.values()}
    for module in pkgutil.iter_modules(benchmarks.__path__):
        path = f"benchmarks.{module.name}"
        if module.ispkg and importlib.util.find_spec(f"{path}.bench"):  # pyright: ignore[reportAttributeAccessIssue]
            path = f"{path}.bench"
        if hasattr(importlib.import_module(path), "run"):
            assert path in listed
