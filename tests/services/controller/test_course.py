from __future__ import annotations

import numpy as np

from services.controller.adaptation import Adaptation
from services.controller.course import Course
from services.controller.run_monitor import RunMonitor
from tests.services.controller.cell import PROPERTIES
from tests.services.controller.test_task import task


def test_rope_that_nobody_controls_and_that_leaves_its_goal_waits_for_a_start() -> None:
    t, monitor = task(), RunMonitor(tolerance=0.005, radius=0.004)
    course = Course(t, monitor, Adaptation(PROPERTIES))
    t.start(1)
    t.enter("reached", "there")
    nodes = t.goal.nodes
    for off, state in ((0.004, "reached"), (0.012, "reached"), (0.2, "idle")):
        monitor.look(2, nodes + np.array([off, 0.0, 0.0]), nodes, [])
        course.let_go()
        assert t.state == state, off
    assert "200 mm" in t.reason
    # A run that is held on its way goes on by itself.
    t.start(3)
    course.let_go()
    assert t.state == "running"
