"""Contenders: the rod of this package, and the solver of the paper."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
from jaxtyping import Float64

from benchmarks.compare.motion import (
    ACTION_DURATION,
    PROPERTIES,
    Contender,
    Moves,
    NodePath,
    final_grips,
    rest_state,
    then_still,
)
from lariat.paper.xpbd import XpbdProperties, XpbdRod
from lariat.rod import Rod, RolloutSpec
from lariat.rod.integration_schemes import Scheme

NAMES: dict[Scheme, str] = {"euler": "Lariat, 1st order", "sdirk2": "Lariat, 2nd order"}
SUBSTEPS = (1, 2, 5, 10, 20)
"""Sub-steps of an action of 10 ms."""
SWEEPS = ((1, 20), (5, 4), (1, 100), (5, 20), (20, 5), (20, 20))
"""Sub-steps of an action, and sweeps over the constraints in each, of the paper's solver."""


def contenders() -> Iterator[Contender]:
    """Yield the rod with both schemes, and the solver of the paper."""
    for scheme in NAMES:
        for n in (10, 20, 40, 80, 160):
            for substeps in SUBSTEPS:
                yield rod(scheme, n, substeps)
    for n in (20, 40, 80):
        for substeps, sweeps in SWEEPS:
            setting = f"{1e3 * ACTION_DURATION / substeps:g} ms, {sweeps} sweeps"
            start = partial(_PaperRun, n, substeps, sweeps)
            yield Contender("paper's XPBD", n, setting, start)


def rod(scheme: Scheme, n: int, substeps: int) -> Contender:
    """Return the rod with one setting."""
    setting = f"{1e3 * ACTION_DURATION / substeps:g} ms"
    return Contender(NAMES[scheme], n, setting, partial(_RodRun, scheme, n, substeps))


class _RodRun:
    """Run of the rod."""

    def __init__(self, scheme: Scheme, n: int, substeps: int, moves: Moves) -> None:
        self._rod = Rod(PROPERTIES, n, scheme=scheme)
        self._spec = RolloutSpec(rest_state(n), moves, ACTION_DURATION, substeps=substeps)

    def run(self) -> NodePath:
        """Return the positions after every action."""
        motion = self._rod.rollout(self._spec)
        self._final = motion.final
        return motion.positions

    def settle(self) -> Float64[np.ndarray, "n 3"]:
        """Return the positions at rest, which the rod finds by itself."""
        grips = final_grips(self._spec.actions)
        return self._rod.rest(*grips, guess=self._final).state.positions


class _PaperRun:
    """Run of the paper's solver."""

    def __init__(self, n: int, substeps: int, sweeps: int, moves: Moves) -> None:
        self._rod = XpbdRod(XpbdProperties.of_material(PROPERTIES, n), n, iterations=sweeps)
        self._start, self._moves, self._substeps = rest_state(n), moves, substeps

    def run(self) -> NodePath:
        """Return the positions after every action."""
        return self._path(self._moves)

    def settle(self) -> Float64[np.ndarray, "n 3"]:
        """Return the positions after the grips have stood still; the solver damps by itself."""
        return self._path(then_still(then_still(then_still(self._moves))))[-1]

    def _path(self, moves: Moves) -> NodePath:
        spec = RolloutSpec(self._start, moves, ACTION_DURATION, substeps=self._substeps)
        return self._rod.rollout(spec).positions
