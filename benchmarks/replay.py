"""Smallest change that replay detects, by service: `lariat bench replay`.

Each service is replayed through its reference recording (tests/replay) with one of its gains or
constants scaled by 1 + eps, and eps is bisected in decades. A change is detected if a message
differs from the recording by more than the tolerances of shared/topics.py.
"""

from __future__ import annotations

import gc
import json as encoder
import math
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.result_block import find_block, show
from shared.recording import Recording
from stack.replay.outside_inputs import subject
from stack.replay.recorded_service import RecordedService
from stack.replay.trace_replay import ReplayResult, replay_start

REFERENCE_FOLDER = Path(__file__).parents[1] / "tests" / "replay"
"""Folder of the reference recordings."""
SMALLEST_EXPONENT, LARGEST_EXPONENT = -12, -1
"""Range of the decimal exponent of eps."""


@dataclass(frozen=True)
class Perturbation:
    """One number of one service."""

    service: str
    """Name of the service."""
    recording: str
    """Name of the reference recording."""
    quantity: str
    """Description of the scaled number."""
    target: str
    """Place of the number: `scenario:KEY`, `module:NAME`, `settings:MODULE:CLASS.FIELD` (in every
    live instance), or `frames` (clock of the camera's source)."""


PERTURBATIONS = (
    Perturbation(
        "sim", "rope", "Young's modulus of the MuJoCo plant", "scenario:plant.rope.youngs_modulus"
    ),
    Perturbation(
        "sim", "requests", "Young's modulus of the rod plant", "scenario:rope.youngs_modulus"
    ),
    Perturbation("sim", "rope", "noise of the depth camera", "scenario:sensing.depth_noise"),
    Perturbation("camera", "camera", "clock of the source", "frames"),
    Perturbation(
        "perception",
        "rope",
        "prior change of curvature in the chain fit",
        "settings:lariat.perception.centerline.chain_fit:FitSettings.curvature_change_sigma",
    ),
    Perturbation("planner", "rope", "wanted clearance", "scenario:control.clearance"),
    Perturbation(
        "planner",
        "rope",
        "weight on smooth paths",
        "settings:lariat.planning.path_optimization.settings:PathOptimizationSettings"
        ".smoothness_weight",
    ),
    Perturbation("controller", "rope", "weight on speed", "scenario:control.speed_weight"),
    Perturbation(
        "controller",
        "rope",
        "model error of the material filter",
        "settings:lariat.control.estimation.material_filter_settings"
        ":MaterialFilterSettings.model_error",
    ),
    Perturbation("robot_gateway", "requests", "limit of the jerk", "scenario:limits.jerk"),
    Perturbation(
        "robot_gateway", "rope", "length of the tool", "scenario:ends.right.tool_position.2"
    ),
    Perturbation(
        "recorder", "requests", "radius of the drawn grippers", "scenario:limits.gripper_radius"
    ),
)
"""Numbers that are scaled, at least one of every service that publishes numbers of its own.

The dashboard publishes what people enter.
"""


def run(service: tuple[str, ...] = (), docs: Path | None = None, json: bool = False) -> int:
    """Measure the smallest relative change of one number that each service's replay detects.

    Args:
        service: Names of services; all by default.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of a table.
    """
    block = find_block(docs)
    chosen = [p for p in PERTURBATIONS if not service or p.service in service]
    console = Console(stderr=True)
    rows = []
    for perturbation in track(chosen, "Replaying", console=console, transient=True):
        smallest = smallest_detected(perturbation)
        rows.append(
            {
                "service": perturbation.service,
                "recording": perturbation.recording,
                "quantity": perturbation.quantity,
                "smallest": smallest if math.isfinite(smallest) else None,
            }
        )
    if json:
        print(encoder.dumps({"relative_change": rows}))
        return 0
    table = Table("service", "recording", "scaled number", "smallest change detected")
    for row in rows:
        found = f"{row['smallest']:.0e}" if row["smallest"] else "none"
        table.add_row(row["service"], row["recording"], row["quantity"], found)
    show([table], block)
    return 0


def smallest_detected(perturbation: Perturbation) -> float:
    """Return the smallest power of ten that replay detects; infinite where it detects none [-].

    Every change larger than a detected one is assumed to be detected too.
    """
    low, high = SMALLEST_EXPONENT, LARGEST_EXPONENT
    if not detects(perturbation, 10.0**high):
        return math.inf
    while low < high:
        middle = (low + high) // 2
        if detects(perturbation, 10.0**middle):
            high = middle
        else:
            low = middle + 1
    return 10.0**high


def detects(perturbation: Perturbation, eps: float) -> bool:
    """Whether the replay with one number scaled by 1 + eps differs from the recording."""
    return not replay_perturbed(perturbation, eps).same


def replay_perturbed(perturbation: Perturbation, eps: float) -> ReplayResult:
    """Replay one service with one of its numbers scaled by 1 + eps."""
    recording, recorded = _recorded(perturbation.recording, perturbation.service)
    kind, _, name = perturbation.target.partition(":")
    with tempfile.TemporaryDirectory() as folder, _module_scaled(perturbation, 1.0 + eps):
        scenario = recording.scenario(Path(folder))
        if kind == "scenario":
            scenario = _scaled(scenario, name.split("."), 1.0 + eps)
        (session,) = recorded.starts
        with subject(perturbation.service, scenario, session, recording, recorded) as (s, feed):
            s.warm_up()
            if kind == "frames":
                _scale_frames(s, 1.0 + eps)
            with _settings_scaled(name if kind == "settings" else "", 1.0 + eps):
                return replay_start(recorded, s, session, feed=feed)


@cache
def _recorded(name: str, service: str) -> tuple[Recording, RecordedService]:
    recording = Recording.open(REFERENCE_FOLDER / f"{name}.mcap")
    return recording, RecordedService(recording, service)


@contextmanager
def _module_scaled(perturbation: Perturbation, factor: float) -> Iterator[None]:
    kind, _, place = perturbation.target.partition(":")
    if kind != "module":
        yield
        return
    module_name, _, constant = place.partition(":")
    module = import_module(module_name)
    value = getattr(module, constant)
    setattr(module, constant, type(value)(value * factor))
    try:
        yield
    finally:
        setattr(module, constant, value)


def _scaled(value: Any, path: list[str], factor: float) -> Any:
    """Copy of a scenario, section or tuple with one number scaled."""
    if not path:
        return value * factor
    first, *rest = path
    if isinstance(value, tuple):
        index = int(first)
        return (*value[:index], _scaled(value[index], rest, factor), *value[index + 1 :])
    return replace(value, **{first: _scaled(getattr(value, first), rest, factor)})


@contextmanager
def _settings_scaled(place: str, factor: float) -> Iterator[None]:
    """Scale one field of every live instance of a frozen dataclass, shared defaults among them."""
    if not place:
        yield
        return
    module_name, _, field = place.partition(":")
    class_name, _, name = field.partition(".")
    kind = getattr(import_module(module_name), class_name)
    instances = [(o, getattr(o, name)) for o in gc.get_objects() if type(o) is kind]
    for instance, value in instances:
        object.__setattr__(instance, name, value * factor)
    try:
        yield
    finally:
        for instance, value in instances:
            object.__setattr__(instance, name, value)


def _scale_frames(service: Any, factor: float) -> None:
    """Scale the times of the exposures of a camera's source."""
    source = service._streams[0]._source
    newest: Callable[[int], Any] = source.newest

    def scaled(now: int) -> Any:
        exposure = newest(now)
        return exposure and replace(exposure, time=round(exposure.time * factor))

    source.newest = scaled
