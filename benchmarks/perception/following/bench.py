"""Accuracy of a followed rope beside other ropes, behind hands and out of view."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float64

from benchmarks.perception.following.cases import CASES, COLORFUL, ROPE_COLOR, Case
from benchmarks.perception.following.doubt import StatedDoubt, fitted, reliability
from benchmarks.perception.following.frames import VIEW, TrueFrame, frames_of
from benchmarks.perception.following.others import OthersFigures, OthersFollower
from benchmarks.perception.scenes import ROPES, STIFFNESS_ERROR, believed
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.control.estimation.rope_tracker import MAX_P_WRONG
from lariat.geometry import polylines
from lariat.geometry.obstacles import TABLE
from lariat.perception.centerline.estimate import CenterlineEstimate
from lariat.perception.centerline.estimator import CenterlineEstimator
from lariat.perception.centerline.settings import CenterlineSettings
from lariat.perception.tracking.centerline_tracker import CenterlineTracker
from lariat.simulation.camera.depth_faults import REAL_SENSOR, DepthFaults

WRONG_ERROR, WRONG_SIGMAS = 0.010, 3.0
"""Error [m] and error relative to sigma above which a node counts as confidently wrong."""
FOUND_ERROR, FOUND_SHARE = 0.003, 0.5
"""Mean error of the observed nodes [m], and their share of the visible ones, from which the rope
counts as found again."""
GONE_SHARE = 0.1
"""Share of visible nodes below which the rope counts as gone."""
INTERVAL_SIGMAS = 1.4435
"""Radius of the sphere that holds 90 % of the positions with a standard deviation of one in all
directions together, in three even dimensions [-]."""


@dataclass
class Figures:
    """What is counted over the frames of a case."""

    frames: int = 0
    lost: int = 0
    """Number of frames in which the rope counts as lost."""
    wrong: int = 0
    """Number of frames with a confidently wrong node."""
    followed: int = 0
    """Number of frames with an observed node that is off and lies on another rope."""
    believed: int = 0
    """Number of these whose stated doubt lets the controller use them."""
    refused: int = 0
    """Number of frames with a right chain whose stated doubt keeps the controller from using it."""
    doubts: list[StatedDoubt] = field(default_factory=list)
    """Stated doubt of every chain, and whether it was wrong."""
    errors: list[Float64[np.ndarray, "n"]] = field(default_factory=list)
    sigmas: list[Float64[np.ndarray, "n"]] = field(default_factory=list)
    observed: list[Bool[np.ndarray, "n"]] = field(default_factory=list)
    visible: list[Bool[np.ndarray, "n"]] = field(default_factory=list)
    found_again: list[float] = field(default_factory=list)
    """Times from the first frame in which half the rope is visible again [s]."""
    times: list[float] = field(default_factory=list)
    """Processor times [ms]."""
    others: OthersFigures = field(default_factory=OthersFigures)
    """What was published of the other ropes."""

    def row(self, case: Case) -> dict[str, float | str]:
        """Return the row of the table."""
        errors, sigmas, observed, visible = (
            np.array(v) for v in (self.errors, self.sigmas, self.observed, self.visible)
        )
        seen = errors[observed]
        return {
            "case": case,
            "frames": self.frames,
            "lost": self.lost,
            "mean_mm": 1e3 * float(np.mean(seen)),
            "p99_mm": 1e3 * float(np.percentile(seen, 99)),
            "max_mm": 1e3 * float(np.max(seen)),
            "other_rope_followed": self.followed,
            "believed": self.believed,
            "right_refused": self.refused,
            "confidently_wrong": self.wrong,
            "within_90": float(np.mean(seen < INTERVAL_SIGMAS * sigmas[observed])),
            "observed_of_visible": float(np.mean(observed[visible])),
            "found_again_s": max(self.found_again, default=float("nan")),
            "ms_p50": float(np.median(self.times)),
            "ms_p99": float(np.percentile(self.times, 99)),
        }


def run(
    sequences: int = 4,
    seed: int = 0,
    only: tuple[Case, ...] = CASES,
    fit: bool = False,
    real_sensor: bool = False,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Measure how a held rope is followed beside other ropes, behind hands and out of view.

    Plant: MuJoCo's rope, n = 88 for a model of 30, moved by its grips for three seconds. Sensed:
    the simulated camera at 30 Hz, 640 by 480 pixels. The stiffness is believed twice as large as it
    is; nothing is adapted.

    Examples:
      lariat bench perception following --only crossing hand
      lariat bench perception following --only alone --real-sensor

    Args:
        sequences: Number of sequences of each case.
        seed: Seed of the first one.
        only: Cases to measure.
        fit: Print the coefficients of the doubt, fitted to these sequences.
        real_sensor: Give the depth images holes in glare and darkness, bleeding edges, bands of
            interference and the bias of a sensor that warms up.
    """
    rows, doubts, others = [], [], []
    for case in only:
        print(f"{case} ...", file=sys.stderr)
        figures = Figures()
        for k in range(sequences):
            follow(case, seed + k, figures, REAL_SENSOR if real_sensor else None)
        rows.append(figures.row(case))
        others.append({"case": case, **figures.others.row()})
        doubts += figures.doubts
    bins = reliability(doubts)
    caption = (
        "Plant: MuJoCo, n = 88 for a model of 30; sensed: the simulated camera, 640 by 480 pixels; "
        f"believed / true stiffness {STIFFNESS_ERROR:g}, not adapting; {sequences} sequences a row."
    )
    stated = (
        "Probability that a visible node is off by over a centimetre, stated and as it came out."
    )
    beside = "Other ropes as published from the third of a second on."
    tables = Result("followed", rows, caption), Result("others", others, beside)
    options.publish(*tables, Result("doubt", bins, stated))
    if fit:
        print(f"COEFFICIENTS = {tuple(round(c, 3) for c in fitted(doubts))}")
    return 0


def follow(case: Case, seed: int, figures: Figures, faults: DepthFaults | None = None) -> None:
    """Follow the rope through one sequence and count."""
    truth = ROPES["rope"]
    properties, model = believed(truth)
    settings = CenterlineSettings(rope_color=ROPE_COLOR if case in COLORFUL else None)
    tracker = CenterlineTracker(CenterlineEstimator(VIEW, model, settings), properties, [TABLE])
    gone, returned = False, 0.0
    beside = OthersFollower(model.radius, figures.others)
    for number, frame in enumerate(frames_of(truth, case, seed, faults)):
        if not number:
            tracker.warm_up(frame.left, frame.right)
        started = time.process_time()
        estimate = tracker.track(
            frame.images.color,
            frame.images.depth,
            frame.left,
            frame.right,
            round(1e9 * (1.0 + frame.time)),
        )
        figures.times.append(1e3 * (time.process_time() - started))
        figures.frames += 1
        beside.take(frame, estimate, round(1e9 * (1.0 + frame.time)))
        visible = float(np.mean(frame.visible))
        if visible < GONE_SHARE:
            gone, returned = True, 0.0
        elif gone and visible > FOUND_SHARE and not returned:
            returned = frame.time
        if estimate.lost:
            figures.lost += 1
            continue
        errors = np.linalg.norm(estimate.positions - frame.nodes, axis=1)
        _count(figures, frame, estimate, errors)
        off = bool(np.any(errors[frame.visible] > WRONG_ERROR))
        figures.doubts.append(StatedDoubt(estimate.p_wrong, off, tracker.wrong_chain.features))
        figures.refused += not off and estimate.p_wrong > MAX_P_WRONG
        if gone and returned and _is_found(frame, estimate, errors):
            figures.found_again.append(frame.time - returned)
            gone = False
    if gone and returned:
        figures.found_again.append(float("inf"))


def _count(
    figures: Figures,
    frame: TrueFrame,
    estimate: CenterlineEstimate,
    errors: Float64[np.ndarray, "n"],
) -> None:
    off = errors > WRONG_ERROR
    figures.wrong += bool(np.any(off & (errors > WRONG_SIGMAS * estimate.sigma)))
    suspects = estimate.positions[off & estimate.observed]
    if len(suspects):
        on_another = any(
            bool(np.any(_axis_distance(suspects, tube.nodes) < 2.0 * tube.radius))
            for tube in frame.tubes
        )
        figures.followed += on_another
        figures.believed += on_another and estimate.p_wrong <= MAX_P_WRONG
    figures.errors.append(errors)
    figures.sigmas.append(estimate.sigma)
    figures.observed.append(estimate.observed)
    figures.visible.append(frame.visible)


def _axis_distance(
    points: Float64[np.ndarray, "k 3"], axis: Float64[np.ndarray, "n 3"]
) -> Float64[np.ndarray, "k"]:
    """Distance of points from an axis [m]."""
    return np.min(polylines.point_distances(points, polylines.resample(axis, 400)), axis=1)


def _is_found(
    frame: TrueFrame, estimate: CenterlineEstimate, errors: Float64[np.ndarray, "n"]
) -> bool:
    seen = estimate.observed
    share = float(np.mean(seen[frame.visible])) if np.any(frame.visible) else 0.0
    return share > FOUND_SHARE and float(np.mean(errors[seen])) < FOUND_ERROR
