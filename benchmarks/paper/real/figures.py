"""Counterparts of the paper's Figs. 5, 8, 9 (right) and 10, drawn from finished runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float64, UInt8
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from benchmarks.paper.real.experiments import GOALS, ROPES, ExperimentRun, bending_stiffness
from benchmarks.paper.real.tables import select
from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle
from lariat.rod import Rod
from lariat.scenario.rod_properties import rod_properties
from lariat.simulation.camera.true_camera import true_camera
from lariat.trajectory import SECOND

GOAL_COLOR, ROPE_COLOR, PATH_COLOR = "magenta", "tab:blue", "tab:green"
MODEL_COLOR, OBSTACLE_COLOR = "tab:orange", "0.75"
"""Colours of the plots, as Matplotlib names them."""
SHOWN_MOMENTS = (0.0, 0.25, 0.5, 1.0)
"""Shown moments, relative to the time to the goal, or to the run's duration if not reached [-]."""
VIEWS = {"front": (0, 2), "top": (0, 1)}
"""Indices of the coordinates that a view shows, by its name."""
IMAGE_WIDTH = 320
"""Width of a drawn camera image [pixels]."""
GOAL_BGR, PERCEIVED_BGR = (255, 0, 255), (255, 128, 0)
"""Colours of nodes in camera images."""


def draw(runs: Sequence[ExperimentRun], folder: Path) -> Iterator[Path]:
    """Draw all figures and yield their paths.

    Figures of single runs show those of the first belief.
    """
    folder.mkdir(parents=True, exist_ok=True)
    belief = runs[0].experiment.belief
    shown = {rope: select(runs, rope, belief, adapt=True) for rope in ROPES}
    yield _manipulation([shown["rope"][0], shown["cable"][0]], folder / "manipulation.png")
    yield _images([run for rope in ROPES for run in shown[rope]], folder / "pictures.jpg")
    yield _adaptation(runs, folder / "adaptation.png")
    yield _model_error(runs, folder / "gap.png")


def _manipulation(runs: Sequence[ExperimentRun], path: Path) -> Path:
    """After Fig. 5: from the front and from above, at four moments."""
    rows = [(run, view) for run in runs for view in VIEWS]
    figure = Figure(figsize=(11, 9), layout="constrained")
    axes = figure.subplots(len(rows), len(SHOWN_MOMENTS))
    for row, (run, view) in zip(axes, rows, strict=True):
        for axis, stamp in zip(row, _moments(run), strict=True):
            _draw_obstacles(axis, run, view)
            _curve(axis, _goal(run), view, GOAL_COLOR, "goal")
            _curve(axis, _at(run.trace.truth, stamp), view, ROPE_COLOR, "true rope")
            path_of_grip = [
                right.position for t, _, right in run.trace.grips if run.started <= t <= stamp
            ]
            if path_of_grip:
                axis.plot(
                    *np.array(path_of_grip)[:, VIEWS[view]].T,
                    color=PATH_COLOR,
                    lw=1.2,
                    label="path of the grip",
                )
            axis.set_title(
                f"{run.experiment.rope}, {view}, {(stamp - run.started) / SECOND:.1f} s", fontsize=9
            )
    axes[0, -1].legend(fontsize=7, loc="upper right")
    return _saved(figure, path)


def _images(runs: Sequence[ExperimentRun], path: Path) -> Path:
    """After Fig. 8: camera images with goal and perceived nodes."""
    rows = []
    for run in runs:
        row = [_image(run, stamp) for stamp in _moments(run)]
        rows.append(np.concatenate(row, axis=1))
    cv2.imwrite(str(path), np.concatenate(rows), [cv2.IMWRITE_JPEG_QUALITY, 70])
    return path


def _image(run: ExperimentRun, stamp: int) -> UInt8[np.ndarray, "h w 3"]:
    moment, jpeg = min(run.trace.images, key=lambda i: abs(i[0] - stamp))
    image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    camera = true_camera(run.scenario.camera_setups[0], run.scenario.plant)
    scale = IMAGE_WIDTH / image.shape[1]
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    for nodes, color in ((_goal(run), GOAL_BGR), (_at(run.trace.perceived, moment), PERCEIVED_BGR)):
        for u, v in scale * camera.project(nodes)[0]:
            cv2.circle(small, (round(u), round(v)), 2, color, -1, cv2.LINE_AA)
    label = f"{run.experiment.rope} {run.experiment.goal}, {(moment - run.started) / SECOND:.1f} s"
    cv2.putText(small, label, (8, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (255, 255, 255), 1)
    return small


def _adaptation(runs: Sequence[ExperimentRun], path: Path) -> Path:
    """After Fig. 9, right: the error over time, with adaptation and without."""
    beliefs = sorted({r.experiment.belief for r in runs})
    figure = Figure(figsize=(10, 6), layout="constrained")
    axes = figure.subplots(len(ROPES), len(beliefs), sharex=True, squeeze=False)
    for row, rope in zip(axes, ROPES, strict=True):
        for axis, belief in zip(row, beliefs, strict=True):
            for adapt, style in ((True, "-"), (False, "--")):
                for run in select(runs, rope, belief, adapt):
                    times, errors = np.array(run.errors).T
                    color = f"C{run.experiment.goal - 1}"
                    label = f"goal {run.experiment.goal}, {'adapting' if adapt else 'not adapting'}"
                    axis.semilogy(times, 1e3 * errors, style, color=color, lw=1.2, label=label)
            axis.set_title(f"{rope}, believed {belief:g} times as stiff", fontsize=10)
            axis.set_ylabel("mean node error [mm]")
            axis.grid(alpha=0.3)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    axes[0, 0].legend(fontsize=7)
    return _saved(figure, path)


def _model_error(runs: Sequence[ExperimentRun], path: Path) -> Path:
    """After Fig. 10: true rope and model between the same grips, at the end of the run."""
    belief = runs[0].experiment.belief
    columns = [(rope, adapt) for rope in ROPES for adapt in (True, False)]
    figure = Figure(figsize=(12, 6), layout="constrained")
    axes = figure.subplots(len(VIEWS), len(columns))
    for column, (rope, adapt) in zip(axes.T, columns, strict=True):
        run = select(runs, rope, belief, adapt)[GOALS[0] - 1]
        true, model = run.trace.truth[-1][1], _model_shape(run)
        gap = 1e3 * polylines.mean_node_distance(polylines.resample(model, len(true)), true)
        for axis, view in zip(column, VIEWS, strict=True):
            _draw_obstacles(axis, run, view)
            _curve(axis, _goal(run), view, GOAL_COLOR, "goal")
            _curve(axis, model, view, MODEL_COLOR, "model")
            _curve(axis, true, view, ROPE_COLOR, "true rope")
        how = "adapting" if adapt else "not adapting"
        column[0].set_title(f"{rope}, {how}: model error {gap:.1f} mm", fontsize=9)
    axes[0, 0].legend(fontsize=7)
    return _saved(figure, path)


def _model_shape(run: ExperimentRun) -> Float64[np.ndarray, "n 3"]:
    """Rest shape of the controller's rod between the last grips [m]."""
    rope = run.scenario.rope
    properties = rod_properties(rope)
    factor = run.adapted_stiffness[0] / bending_stiffness(rope)
    adapted = properties.with_stiffness(
        factor * properties.bending_stiffness, factor * properties.twisting_stiffness
    )
    _, left, right = run.trace.grips[-1]
    return Rod(adapted, rope.node_count).rest(left, right).state.positions


def _moments(run: ExperimentRun) -> list[int]:
    seconds = run.score.reached_s or run.score.sim_s
    return [run.started + round(m * seconds * SECOND) for m in SHOWN_MOMENTS]


def _at(
    rows: Sequence[tuple[int, Float64[np.ndarray, "n 3"]]], stamp: int
) -> Float64[np.ndarray, "n 3"]:
    return min(rows, key=lambda row: abs(row[0] - stamp))[1]


def _goal(run: ExperimentRun) -> Float64[np.ndarray, "n 3"]:
    nodes = run.scenario.nodes(run.scenario.goal)
    assert nodes is not None
    return nodes


def _curve(
    axis: Axes, nodes: Float64[np.ndarray, "n 3"], view: str, color: str, label: str
) -> None:
    axis.plot(*nodes[:, VIEWS[view]].T, "o-", color=color, ms=2.2, lw=0.8, label=label)


def _draw_obstacles(axis: Axes, run: ExperimentRun, view: str) -> None:
    for obstacle in run.scenario.bodies:
        if obstacle.shape == "cylinder":
            axis.add_patch(_outline(obstacle, view))
    axis.set_xlim(-0.3, 0.3)
    axis.set_ylim(*((0.0, 0.4) if view == "front" else (-0.25, 0.3)))
    axis.set_aspect("equal")
    axis.tick_params(labelsize=7)


def _outline(cylinder: Obstacle, view: str) -> Circle | Rectangle:
    x, y, z = cylinder.position
    r, h = cylinder.radius, cylinder.height
    if view == "top":
        return Circle((x, y), r, color=OBSTACLE_COLOR)
    return Rectangle((x - r, z - h / 2.0), 2.0 * r, h, color=OBSTACLE_COLOR)


def _saved(figure: Figure, path: Path) -> Path:
    figure.savefig(path, dpi=75)
    return path
