"""Rod, optimizer and adaptation by the `control` section of a scenario."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lariat.configuration import ConfigurationError
from lariat.paper.adaptation import PaperAdaptation
from lariat.paper.xpbd import XpbdRod
from lariat.rope_controller import RopeController
from lariat.scenario import load
from lariat.scenario.sections import End, Ends, PaperControl

SCENARIO = load(Path(__file__).parents[2] / "scenarios" / "three-cylinders.toml")


def test_controller_with_the_papers_rod_warms_up_and_adapts() -> None:
    paper = PaperControl(bending_compliance=0.002, iterations=7, optimizer_steps=2)
    control = replace(SCENARIO.control, solver="xpbd", method="network", adapt=True, paper=paper)
    service = RopeController(replace(SCENARIO, control=control))
    rod = service.rope.estimator.rod
    assert isinstance(rod, XpbdRod)
    assert (rod.properties.bending_compliance, rod.model.iterations) == (0.002, 7)
    assert isinstance(service.rope.adaptation, PaperAdaptation)
    service.warm_up()


def test_combinations_that_the_papers_rod_does_not_support_are_refused() -> None:
    control = replace(SCENARIO.control, solver="xpbd")
    with pytest.raises(ConfigurationError, match=r"sensitivities.*'gauss_newton'"):
        RopeController(replace(SCENARIO, control=control))
    control = replace(control, method="network", adapt=True)
    turning = replace(SCENARIO, control=control, ends=Ends(right=End(rotates=True)))
    with pytest.raises(ConfigurationError, match="rotate"):
        RopeController(turning)
