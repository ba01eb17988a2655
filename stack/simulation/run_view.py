"""Three-dimensional view of a finished run, as a page that needs no server."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import rich
import viser
from viser.infra import StateSerializer

from dashboard.scene.scene_view import SceneView
from shared.messages import ArmStates, NodeChain
from stack.simulation.simulated_run import SimulatedRun

FRAME_PERIOD = 0.1
"""Least time between two shapes of a view [s]."""


def recorded_view(run: SimulatedRun) -> StateSerializer:
    """Return the drawing of a run, which plays in real time."""
    with _quiet():
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        view = SceneView(server, run.scenario, on_click=lambda _: None)
        if run.goal is not None:
            view.show_goal(run.goal)
        recording = server.get_scene_serializer()
        shown, scene = -FRAME_PERIOD, None
        for time, nodes, obstacles, arms in zip(
            run.times, run.nodes, run.scenes, run.arms, strict=True
        ):
            if time - shown < FRAME_PERIOD:
                continue
            if shown >= 0.0:
                recording.insert_sleep(float(time - shown))
            shown = time
            view.show_rope(NodeChain(positions=nodes.ravel().tolist()))
            if arms:
                view.show_arms(ArmStates.FromString(arms))
            if obstacles is not scene and scene is not None:
                view.show_obstacles([o for o in obstacles if not o.keep_in])
            scene = obstacles
        return recording
    finally:
        with _quiet():
            server.stop()


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep viser from printing its addresses, of which nobody hears, also into a notebook."""
    console = rich.get_console()
    console.quiet, before = True, console.quiet
    try:
        yield
    finally:
        console.quiet = before
