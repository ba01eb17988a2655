"""Fixture of the tests: a run that has begun."""

from __future__ import annotations

import pytest

from tests.lariat.control.supervision.started_run import Run


@pytest.fixture
def run() -> Run:
    return Run()
