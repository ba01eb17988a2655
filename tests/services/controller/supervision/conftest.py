"""Fixture of the tests: a run that has begun."""

from __future__ import annotations

import pytest

from tests.services.controller.supervision.started_run import Run


@pytest.fixture
def run() -> Run:
    return Run()
