"""Settings of the centreline estimation."""

from __future__ import annotations

from dataclasses import dataclass

from lariat.perception.centerline.chain_fit import FitSettings
from lariat.perception.lines.segmentation import Color


@dataclass(frozen=True)
class FrameLimits:
    """Limits outside of which a frame is rejected."""

    max_image_share: float = 0.15
    """Share of the image that rope pixels may cover, if their area exceeds `max_area_ratio` too."""
    max_area_ratio: float = 6.0
    """Area that rope pixels may cover, relative to the area of the whole rope without occlusion."""
    dark_threshold_ratio: float = 0.3
    """Brightness of the brightest pixel, relative to the threshold, up to which the image is too
    dark for a lower threshold to help."""
    min_visible_share: float = 0.1
    """Share of the rope's length that must be visible."""
    min_depth_pixels: int = 10
    """Number of rope pixels that must have a depth."""
    near_percentile: float = 30.0
    """Percentile of the rope pixels' depths from which the width in the image is computed [%]."""
    depth_smoothing_half_window: int = 6
    """Half the window of the running mean over a ridge's depth [pixels]."""


@dataclass(frozen=True)
class HypothesisSettings:
    """Choice between hypotheses, and uncertainty where the image does not decide."""

    accepted_inconsistency: float = 0.15
    """Inconsistency below which a hypothesis ends the search, if it leaves little of the rope
    unseen."""
    max_missing_share: float = 0.25
    """Share of the rope that is neither seen nor hidden, above which other topologies are tried."""
    rival_inconsistency: float = 0.3
    """Difference of inconsistency below which two hypotheses cannot be told apart."""
    rival_inconsistency_per_unseen: float = 2.0
    """Increase of that difference per unseen share of the rope: the less of the rope is seen, the
    more hypotheses are consistent with the image."""
    max_rival_distance: float = 0.005
    """Distance between a node's positions in rival hypotheses from which it is not observed [m]."""
    min_support_ratio: float = 0.15
    """Number of ranges that an observed node needs, relative to the median of all nodes."""
    hidden_sigma_factor: float = 1.6
    """Factor on the standard deviation of hidden nodes: stiffness and motion there are unknown."""
    wrong_topology_sigma: float = 0.12
    """Standard deviation of a node in a wrong topology, relative to the rope's length."""
    min_seen_for_length: float = 0.75
    """Share of observed nodes from which the image tells the length of the rope [-]."""
    free_end_sigma: float = 0.002
    """Standard deviation of a visible end that no grip holds [m]: skeletons are shorter than the
    rope by about its radius."""
    tolerated_unexplained: float = 0.01
    """Share of the rope pixels away from the chain up to which no other ropes are looked for."""
    tolerated_rivals: float = 0.1
    """Length of rivals of seen parts, relative to the rope's, that corresponds to an inconsistency
    of one."""
    tolerated_away: float = 0.1
    """Share of the nodes away from the expected shape, beside other ropes, that corresponds to an
    inconsistency of one."""
    prior_reach: float = 0.03
    """Distance from a prior above which a segment does not belong to it [m], in addition to two
    standard deviations of the prior."""


@dataclass(frozen=True)
class CenterlineSettings:
    """Sensor noise, segmentation, and the settings of each step."""

    threshold: int = 128
    """Least brightness of a rope pixel, 1..254; with a colour, least likeness to it."""
    rope_color: Color | None = None
    """Colour that identifies the rope; None: the rope is brighter than everything else."""
    depth_sigma: float = 0.0015
    """Standard deviation of a depth [m]."""
    depth_quantum: float = 0.001
    """Quantisation step of the depth [m]."""
    min_depth_sigma: float = 2e-4
    """Least standard deviation of a depth, noise and quantisation together [m]."""
    grip_sigma: float = 0.0003
    """Standard deviation of a grip's position in the camera's frame, due to calibration [m]."""
    grip_tangent_factor: float = 1.5
    """Factor on `grip_sigma` for the node next to a grip, which lies in the grip's direction."""
    fit: FitSettings = FitSettings()
    frame: FrameLimits = FrameLimits()
    hypotheses: HypothesisSettings = HypothesisSettings()
