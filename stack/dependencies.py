"""Check that the libraries which a scenario's processes import are installed."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec

from lariat.configuration import ConfigurationError
from lariat.scenario import SIDES, Scenario
from shared.runtime.live import HINT


def check(scenario: Scenario, parts: Sequence[str]) -> None:
    """Check that every library that the processes of a scenario import is installed."""
    for part in parts:
        for library in _libraries(scenario, part):
            if find_spec(library) is None:
                raise ConfigurationError(f"{part} needs {library}, which is not installed; {HINT}")


def _libraries(scenario: Scenario, part: str) -> tuple[str, ...]:
    driven = [scenario.end(side) for side in SIDES]
    arms = [end for end in driven if end.driver not in ("fixed", "ideal")]
    match part:
        case "sim":
            return ("llvmlite", "mujoco") if scenario.plant.model != "rod" else ("llvmlite",)
        case "perception":
            return ("llvmlite", "cv2") if scenario.sensing.source == "camera" else ()
        case "planner":
            return ("llvmlite", *["pinocchio"] * bool(arms))
        case "controller":
            paper = scenario.control.method in ("network", "actions")
            return ("llvmlite", "torch") if paper else ("llvmlite",)
        case "robot_gateway":
            simulated = [end for end in arms if end.driver != "cr5" and not end.address]
            messages = [end for end in arms if end.driver == "ros2"]
            real = [end for end in arms if end.driver == "ur" and end.address]
            libraries = (*["pinocchio"] * bool(arms), *["mujoco"] * bool(simulated))
            libraries = (*libraries, *["rtde_control"] * bool(real))
            return (*libraries, *["rosbags", "xxhash"] * bool(messages))
        case "recorder":
            return ("mcap",)
        case "dashboard":
            return ("viser", "aiohttp", "cv2")
        case "ros2":
            return ("rosbags", "xxhash", "cv2")
    return ()
