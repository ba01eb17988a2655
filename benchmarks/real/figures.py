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

from benchmarks.real.experiments import GOALS, ROPES, Trial, bending_stiffness
from benchmarks.real.tables import chosen
from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle
from lariat.rod import Rod, RodProperties
from services.sim.camera.placement import true_camera
from shared.service import SECOND

GOAL, ROPE, WAY, MODEL, BODY = "magenta", "tab:blue", "tab:green", "tab:orange", "0.75"
MOMENTS = (0.0, 0.25, 0.5, 1.0)
"""Of the time until the goal was reached, or of the run where it was not."""
VIEWS = {"front": (0, 2), "top": (0, 1)}
"""Columns of a position that a view shows."""
PICTURE_WIDTH = 320
"""[pixels]"""
GOAL_BGR, SEEN_BGR = (255, 0, 255), (255, 128, 0)


def draw(trials: Sequence[Trial], folder: Path) -> Iterator[Path]:
    """Draws all figures; the first belief stands for the runs that are shown singly."""
    folder.mkdir(parents=True, exist_ok=True)
    belief = trials[0].case.belief
    shown = {rope: chosen(trials, rope, belief, adapt=True) for rope in ROPES}
    yield _manipulation([shown["rope"][0], shown["cable"][0]], folder / "manipulation.png")
    yield _pictures([t for rope in ROPES for t in shown[rope]], folder / "pictures.jpg")
    yield _adaptation(trials, folder / "adaptation.png")
    yield _gap(trials, folder / "gap.png")


def _manipulation(trials: Sequence[Trial], path: Path) -> Path:
    """After Fig. 5: from the front and from above, at four moments."""
    rows = [(trial, view) for trial in trials for view in VIEWS]
    figure = Figure(figsize=(11, 9), layout="constrained")
    axes = figure.subplots(len(rows), len(MOMENTS))
    for row, (trial, view) in zip(axes, rows, strict=True):
        for axis, stamp in zip(row, _moments(trial), strict=True):
            _surroundings(axis, trial, view)
            _curve(axis, _goal(trial), view, GOAL, "goal")
            _curve(axis, _at(trial.trace.truth, stamp), view, ROPE, "true rope")
            way = [
                right.position for t, _, right in trial.trace.grips if trial.started <= t <= stamp
            ]
            if way:
                axis.plot(*np.array(way)[:, VIEWS[view]].T, color=WAY, lw=1.2, label="grip's way")
            axis.set_title(
                f"{trial.case.rope}, {view}, {(stamp - trial.started) / SECOND:.1f} s", fontsize=9
            )
    axes[0, -1].legend(fontsize=7, loc="upper right")
    return _saved(figure, path)


def _pictures(trials: Sequence[Trial], path: Path) -> Path:
    """After Fig. 8: what the camera saw, with goal and perceived nodes."""
    rows = []
    for trial in trials:
        row = [_picture(trial, stamp) for stamp in _moments(trial)]
        rows.append(np.concatenate(row, axis=1))
    cv2.imwrite(str(path), np.concatenate(rows), [cv2.IMWRITE_JPEG_QUALITY, 70])
    return path


def _picture(trial: Trial, stamp: int) -> UInt8[np.ndarray, "h w 3"]:
    moment, jpeg = min(trial.trace.pictures, key=lambda p: abs(p[0] - stamp))
    image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    camera = true_camera(trial.scenario)
    scale = PICTURE_WIDTH / image.shape[1]
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    for nodes, color in ((_goal(trial), GOAL_BGR), (_at(trial.trace.seen, moment), SEEN_BGR)):
        for u, v in scale * camera.project(nodes)[0]:
            cv2.circle(small, (round(u), round(v)), 2, color, -1, cv2.LINE_AA)
    label = f"{trial.case.rope} {trial.case.goal}, {(moment - trial.started) / SECOND:.1f} s"
    cv2.putText(small, label, (8, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (255, 255, 255), 1)
    return small


def _adaptation(trials: Sequence[Trial], path: Path) -> Path:
    """After Fig. 9, right: the error over time, with adaptation and without."""
    beliefs = sorted({t.case.belief for t in trials})
    figure = Figure(figsize=(10, 6), layout="constrained")
    axes = figure.subplots(len(ROPES), len(beliefs), sharex=True, squeeze=False)
    for row, rope in zip(axes, ROPES, strict=True):
        for axis, belief in zip(row, beliefs, strict=True):
            for adapt, style in ((True, "-"), (False, "--")):
                for trial in chosen(trials, rope, belief, adapt):
                    times, errors = np.array(trial.errors).T
                    color = f"C{trial.case.goal - 1}"
                    label = f"goal {trial.case.goal}, {'adapting' if adapt else 'not adapting'}"
                    axis.semilogy(times, 1e3 * errors, style, color=color, lw=1.2, label=label)
            axis.set_title(f"{rope}, believed {belief:g} times as stiff", fontsize=10)
            axis.set_ylabel("mean node error [mm]")
            axis.grid(alpha=0.3)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    axes[0, 0].legend(fontsize=7)
    return _saved(figure, path)


def _gap(trials: Sequence[Trial], path: Path) -> Path:
    """After Fig. 10: true rope and model between the same grips, when the run was over."""
    belief = trials[0].case.belief
    columns = [(rope, adapt) for rope in ROPES for adapt in (True, False)]
    figure = Figure(figsize=(12, 6), layout="constrained")
    axes = figure.subplots(len(VIEWS), len(columns))
    for column, (rope, adapt) in zip(axes.T, columns, strict=True):
        trial = chosen(trials, rope, belief, adapt)[GOALS[0] - 1]
        true, model = trial.trace.truth[-1][1], _modelled(trial)
        gap = 1e3 * polylines.mean_node_distance(polylines.resampled(model, len(true)), true)
        for axis, view in zip(column, VIEWS, strict=True):
            _surroundings(axis, trial, view)
            _curve(axis, _goal(trial), view, GOAL, "goal")
            _curve(axis, model, view, MODEL, "model")
            _curve(axis, true, view, ROPE, "true rope")
        how = "adapting" if adapt else "not adapting"
        column[0].set_title(f"{rope}, {how}: model {gap:.1f} mm off", fontsize=9)
    axes[0, 0].legend(fontsize=7)
    return _saved(figure, path)


def _modelled(trial: Trial) -> Float64[np.ndarray, "n 3"]:
    """The shape that the controller's rod has at rest between the last grips [m]."""
    rope = trial.scenario.rope
    properties = RodProperties(**{k: v for k, v in vars(rope).items() if k != "node_count"})
    factor = trial.adapted_stiffness[0] / bending_stiffness(rope)
    learnt = properties.with_stiffness(
        factor * properties.bending_stiffness, factor * properties.twisting_stiffness
    )
    _, left, right = trial.trace.grips[-1]
    return Rod(learnt, rope.node_count).rest(left, right).state.positions


def _moments(trial: Trial) -> list[int]:
    seconds = trial.score.reached_s or trial.score.sim_s
    return [trial.started + round(m * seconds * SECOND) for m in MOMENTS]


def _at(
    rows: Sequence[tuple[int, Float64[np.ndarray, "n 3"]]], stamp: int
) -> Float64[np.ndarray, "n 3"]:
    return min(rows, key=lambda row: abs(row[0] - stamp))[1]


def _goal(trial: Trial) -> Float64[np.ndarray, "n 3"]:
    nodes = trial.scenario.nodes(trial.scenario.goal)
    assert nodes is not None
    return nodes


def _curve(
    axis: Axes, nodes: Float64[np.ndarray, "n 3"], view: str, color: str, label: str
) -> None:
    axis.plot(*nodes[:, VIEWS[view]].T, "o-", color=color, ms=2.2, lw=0.8, label=label)


def _surroundings(axis: Axes, trial: Trial, view: str) -> None:
    for body in trial.scenario.bodies:
        if body.shape == "cylinder":
            axis.add_patch(_outline(body, view))
    axis.set_xlim(-0.3, 0.3)
    axis.set_ylim(*((0.0, 0.4) if view == "front" else (-0.25, 0.3)))
    axis.set_aspect("equal")
    axis.tick_params(labelsize=7)


def _outline(cylinder: Obstacle, view: str) -> Circle | Rectangle:
    x, y, z = cylinder.position
    r, h = cylinder.radius, cylinder.height
    if view == "top":
        return Circle((x, y), r, color=BODY)
    return Rectangle((x - r, z - h / 2.0), 2.0 * r, h, color=BODY)


def _saved(figure: Figure, path: Path) -> Path:
    figure.savefig(path, dpi=75)
    return path
