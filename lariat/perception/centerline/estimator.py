"""Estimation of the rope's nodes in one RGB-D frame, each with its standard deviation.

Rope pixels are thinned to strands and refined to sub-pixel ridges. Hypotheses put the segments in
order, by a prior or by the gaps between them. For each, an inextensible chain is fitted to the
rays through the ridges and the ranges on them, anchored at the grips. The hypothesis most
consistent with the image wins; nodes without ranges are interpolated and count as not observed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float64, UInt16

from lariat.geometry import polylines
from lariat.geometry.cameras import Camera, Picture
from lariat.geometry.poses import Pose
from lariat.perception.centerline.chain_fit import ChainFit
from lariat.perception.centerline.estimate import (
    MAX_INCONSISTENCY,
    CenterlineEstimate,
    ChainLength,
    OtherLine,
    RopeDimensions,
    ShapePrior,
)
from lariat.perception.centerline.fit_samples import SegmentSamples, node_anchors
from lariat.perception.centerline.foreign_strands import strands_beside_chain
from lariat.perception.centerline.initial_chains import InitialChain, initial_chains
from lariat.perception.centerline.observation import FrameObserver, Observation
from lariat.perception.centerline.occlusion import occlusion_uncertainty
from lariat.perception.centerline.other_lines import join_strands
from lariat.perception.centerline.reprojection_consistency import (
    ReprojectionConsistency,
    reprojection_consistency,
)
from lariat.perception.centerline.settings import CenterlineSettings

CHORD_ERROR_SHARE = 0.5
"""Share of the correction from straight edges to a smooth rope that counts as uncertain [-]."""
AWAY_SIGMAS, AWAY_MARGIN = 1.5, 0.002
"""Distance from the expected shape above which a node may be another rope's: standard deviations
[-] and margin [m]."""
KNOWN_WIDTHS, KNOWN_SHARE = 0.7, 0.9
"""Distance in the image up to which a line lies on a known one [rope widths], and share of its
points that do from which it is known."""
GIVEN_LENGTH = ChainLength()
"""Length of a rope that is as long as given."""


class CenterlineEstimator:
    """Estimates one rope in frames of one camera; keeps no state between frames."""

    def __init__(
        self, camera: Camera, rope: RopeDimensions, settings: CenterlineSettings | None = None
    ) -> None:
        self.camera = camera
        self.rope = rope
        self.settings = settings or CenterlineSettings()
        self._observer = FrameObserver(camera, rope, self.settings)
        self._fit = ChainFit(
            rope.node_count, rope.length, rope.weight_over_stiffness, self.settings.fit
        )

    def estimate(
        self,
        color: Picture,
        depth: UInt16[np.ndarray, "h w"],
        left: Pose | None = None,
        right: Pose | None = None,
        prior: ShapePrior | None = None,
        fallback_prior: Callable[[], ShapePrior | None] | None = None,
        bias: float = 0.0,
        length: ChainLength = GIVEN_LENGTH,
        expected_others: Sequence[OtherLine] = (),
    ) -> CenterlineEstimate:
        """Estimate the rope in one frame.

        Args:
            color: Red, green, blue.
            depth: Depth image [mm], 0 where nothing was measured.
            left: Grip that holds the left end; None when it is free or unknown.
            right: Grip that holds the right end.
            prior: Expected shape: the last estimate or a prediction.
            fallback_prior: Function that returns an expected shape; called only where the image
                leaves several hypotheses.
            bias: Bias of every depth [m].
            length: Length of the rope, and whether to measure it.
            expected_others: Lines of other ropes where they are expected.
        """
        view = self._observer.observe(color, depth, bias)
        if isinstance(view, str):
            return CenterlineEstimate.failed(view)
        return self._best_hypothesis(
            view, left, right, prior, fallback_prior, length, expected_others
        )

    def _best_hypothesis(
        self,
        view: Observation,
        left: Pose | None,
        right: Pose | None,
        prior: ShapePrior | None,
        fallback_prior: Callable[[], ShapePrior | None] | None,
        length: ChainLength,
        expected_others: Sequence[OtherLine],
    ) -> CenterlineEstimate:
        """Best hypothesis, with standard deviations widened by its rivals."""
        s = self.settings.hypotheses
        samples = SegmentSamples(view, self.camera, self.rope, self.settings)
        # A vague prior allows other ropes to be taken for this one.
        expected = None if prior is None or prior.vague else prior
        tried: list[tuple[float, float, CenterlineEstimate]] = []
        for start in initial_chains(
            view, self.rope, s.prior_reach, left, right, prior, fallback_prior
        ):
            fitted, consistency, unseen = self._judged(
                samples, start, left, right, prior, length, expected_others
            )
            inconsistency = consistency.inconsistency(unseen) + max(0.0, fitted.misfit - 1.0)
            inconsistency += fitted.rivals / s.tolerated_rivals
            missing = max(0.0, unseen - consistency.covered)
            clear = inconsistency == 0.0 and missing < s.accepted_inconsistency
            if fitted.others and expected is None and not clear and fallback_prior is not None:
                expected = fallback_prior()
            if fitted.others and expected is not None:
                distance = np.linalg.norm(fitted.positions - expected.positions, axis=1)
                away = distance > AWAY_SIGMAS * expected.sigma + AWAY_MARGIN
                inconsistency += float(np.mean(away)) / s.tolerated_away
            # Of two consistent hypotheses, the one that explains more of the image is better.
            tried.append((inconsistency + missing, inconsistency, fitted))
            # Once the first hypothesis has failed, all others are compared before one is accepted.
            seen = len(tried) == 1 and missing < s.max_missing_share
            followed = prior is not None and start.prior is prior
            if inconsistency < s.accepted_inconsistency and (seen or followed):
                break
        if not tried:
            return CenterlineEstimate.failed("no rope pixels lie where the rope can be")
        tried.sort(key=lambda t: t[:2])
        rank, inconsistency, best = tried[0]
        spread = np.zeros(len(best.sigma))
        unseen = 1.0 - float(np.mean(best.observed))
        limit = rank + s.rival_inconsistency + s.rival_inconsistency_per_unseen * unseen
        for other, _, rival in tried[1:]:
            if other < limit:
                distance = np.linalg.norm(rival.positions - best.positions, axis=1)
                spread = np.hypot(spread, distance)
        wrong = min(1.0, (inconsistency / MAX_INCONSISTENCY) ** 2)
        return replace(
            best,
            sigma=np.hypot(
                np.hypot(best.sigma, spread), wrong * self._wrong_topology_sigma(left, right)
            ),
            observed=best.observed
            & (spread < s.max_rival_distance)
            & (inconsistency < MAX_INCONSISTENCY),
            inconsistency=inconsistency,
        )

    def _judged(
        self,
        samples: SegmentSamples,
        start: InitialChain,
        left: Pose | None,
        right: Pose | None,
        prior: ShapePrior | None,
        length: ChainLength,
        expected_others: Sequence[OtherLine],
    ) -> tuple[CenterlineEstimate, ReprojectionConsistency, float]:
        """Fit of one hypothesis, its consistency with the image, and its share without any ranges.

        The chain is fitted without the measurements that may be of other ropes. Where the image
        shows others than the known ones, it is fitted anew.
        """
        view = samples.observation
        fitted = self._fitted(samples, start, left, right, length, expected_others)
        unseen = 1.0 - float(np.mean(fitted.observed))
        axes = [line.pixels for line in expected_others]
        consistency = reprojection_consistency(fitted.positions, self.camera, view, axes)
        if (
            not expected_others
            and consistency.unexplained < self.settings.hypotheses.tolerated_unexplained
        ):
            return fitted, consistency, unseen
        gripped = left is not None, right is not None
        beside = strands_beside_chain(view, self.camera, self.rope, fitted, gripped, prior)
        if beside.foreign:
            lines = [*join_strands(beside.foreign, view.width)]
            every = [*lines, *expected_others]
            if not all(_is_known(line, expected_others, view.width) for line in lines):
                fitted = self._fitted(samples, start, left, right, length, every)
                beside = strands_beside_chain(view, self.camera, self.rope, fitted, gripped, prior)
            fitted = replace(fitted, others=tuple(lines))
            axes = [line.pixels for line in every]
            consistency = reprojection_consistency(fitted.positions, self.camera, view, axes)
        return replace(fitted, rivals=beside.rivals), consistency, unseen

    def _wrong_topology_sigma(
        self, left: Pose | None, right: Pose | None
    ) -> Float64[np.ndarray, "n"]:
        """Standard deviation of every node if the topology is wrong [m]."""
        along = np.linspace(0.0, self.rope.length, self.rope.node_count)
        ratio = self.settings.hypotheses.wrong_topology_sigma
        sigma = np.full(len(along), ratio * self.rope.length)
        if left is not None:
            sigma = np.minimum(sigma, along)
        return sigma if right is None else np.minimum(sigma, along[::-1])

    def _fitted(
        self,
        samples: SegmentSamples,
        start: InitialChain,
        left: Pose | None,
        right: Pose | None,
        length: ChainLength,
        others: Sequence[OtherLine] = (),
    ) -> CenterlineEstimate:
        """Fit of one hypothesis, without the measurements on other ropes."""
        s = self.settings.hypotheses
        rows, edges = [np.zeros((0, 6))], [np.zeros(0, int)]
        for segment, places in start.edges:
            sample, index = samples.without(segment, others) if others else samples.of(segment)
            placed = places[index] >= 0
            rows.append(sample[placed])
            edges.append(places[index][placed])
        anchors = node_anchors(
            start.nodes, start.sliding, start.prior, left, right, self.rope, self.settings
        )
        measured, on_edge = np.concatenate(rows), np.concatenate(edges)
        eye = self.camera.T_world_camera.position
        fit = self._fit.solve(
            start.nodes, measured, on_edge, eye, anchors, length_ratio=length.ratio
        )
        # A misfit above one means that the noise is larger than assumed.
        sigma = fit.sigma * max(1.0, fit.misfit)
        if left is None and right is None:
            sigma = np.hypot(sigma, np.hypot(start.sliding, s.free_end_sigma))
        usual = float(np.median(np.concatenate([fit.support[fit.support > 1.0], [1.0]])))
        observed = fit.support > max(1.0, s.min_support_ratio * usual)
        gripped = left is not None, right is not None
        ratio = None
        if length.measure and all(gripped) and np.mean(observed) >= s.min_seen_for_length:
            free = self._fit.solve(fit.nodes, measured, on_edge, eye, anchors, free_length=True)
            ratio = polylines.length(free.nodes) / self.rope.length
        edge = self.rope.length / (self.rope.node_count - 1)
        sigma = np.hypot(sigma, occlusion_uncertainty(fit.nodes, edge, observed, gripped))
        chord_error = _chord_error(fit.nodes)
        sigma = np.hypot(sigma, CHORD_ERROR_SHARE * np.linalg.norm(chord_error, axis=1))
        sigma = np.where(observed, 1.0, s.hidden_sigma_factor) * sigma
        return CenterlineEstimate(
            fit.nodes - chord_error, sigma, observed, misfit=fit.misfit, length_ratio=ratio
        )


def _is_known(line: OtherLine, others: Sequence[OtherLine], width: float) -> bool:
    """Whether a line lies on known ones in the image."""
    if not others:
        return False
    pixels = np.concatenate([other.pixels for other in others])
    gaps = polylines.least_distances(line.pixels[::4], pixels)
    return float(np.mean(gaps < KNOWN_WIDTHS * width)) > KNOWN_SHARE


def _chord_error(nodes: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "n 3"]:
    """Displacement of a chain's nodes from the smooth rope along which its edges lie [m].

    The edges that fit an arc of curvature k best in the least-squares sense, each of length h, meet
    k h^2 / 12 outside the arc.
    """
    error = np.zeros_like(nodes)
    error[1:-1] = -np.diff(nodes, 2, axis=0) / 12.0
    return error
