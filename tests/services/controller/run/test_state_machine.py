"""A run whose path the arms cannot follow tries another one once, and ends."""

from __future__ import annotations

from services.controller.estimation.material_filter import MaterialFilter
from services.controller.run.progress import ProgressMonitor
from services.controller.run.state_machine import Course
from tests.services.controller.cell import PROPERTIES
from tests.services.controller.run.test_task import task


def test_way_that_is_refused_again_ends_the_run_with_the_reason() -> None:
    t = task()
    t.start(1)
    course = Course(t, ProgressMonitor(0.003, 0.004), MaterialFilter(PROPERTIES))
    asked = t.replan_count
    course.barred("the gateway refuses the way (joint_limits)")
    assert (t.state, t.replan_count) == ("running", asked + 1)
    course.barred("the gateway refuses the way (joint_limits)")
    assert (t.state, t.replan_count) == ("failed", asked + 1)
    assert "joint_limits" in t.reason
    course.begin()
    t.start(2)
    course.barred("the gateway refuses the way (joint_limits)")
    assert t.state == "running"
