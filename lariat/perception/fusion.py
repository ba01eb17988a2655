"""Fusion of what several cameras see of one rope at one instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lariat.perception.centerline.estimate import MAX_INCONSISTENCY, CenterlineEstimate


def fuse(estimates: Sequence[CenterlineEstimate]) -> CenterlineEstimate:
    """Return one estimate of the rope from one of each camera.

    A node that some cameras observe is the mean of their positions, weighted by 1/sigma^2; one that
    no camera observes, the same mean of all interpolations, which tell no more together than the
    best of them. Where positions differ by more than their standard deviations, the standard
    deviation is widened to their difference. An estimate that contradicts its image counts only if
    all do.

    Args:
        estimates: At least one; those in which the rope is lost do not count.

    Returns:
        The fused estimate; if the rope is lost in all images, one that names all reasons.
    """
    usable = [e for e in estimates if not e.lost]
    if not usable:
        return CenterlineEstimate.failed("; ".join(e.lost for e in estimates))
    usable = [e for e in usable if e.inconsistency <= MAX_INCONSISTENCY] or usable
    if len(usable) == 1:
        return usable[0]
    positions = np.stack([e.positions for e in usable])
    sigma = np.stack([e.sigma for e in usable])
    observed = np.stack([e.observed for e in usable])
    seen = observed.any(axis=0)
    counts = observed | ~seen
    weight = np.where(counts, sigma**-2.0, 0.0)
    total = weight.sum(axis=0)
    mean = np.sum(weight[..., None] * positions, axis=0) / total[:, None]
    deviation = np.where(seen, total**-0.5, sigma.min(axis=0))
    # Standard deviations are those of all coordinates together: of honest ones the sum of squares
    # is the number of positions less one, on average.
    squares = np.sum(weight * np.sum((positions - mean) ** 2, axis=2), axis=0)
    freedom = np.maximum(counts.sum(axis=0) - 1, 1)
    disagreement = np.sqrt(squares / freedom)
    best = min(usable, key=lambda e: e.inconsistency)
    return replace(
        best,
        positions=mean,
        sigma=deviation * np.maximum(1.0, disagreement),
        observed=seen,
        misfit=max(e.misfit for e in usable),
        others=tuple(line for e in usable for line in e.others),
    )
