"""Integer codes of derivatives, holds and tasks in launches and kernels."""

from __future__ import annotations

from enum import IntEnum, IntFlag, auto


class Derivatives(IntFlag):
    """Derivatives that a launch computes."""

    SENSITIVITIES = 1
    """Forward: of all positions with respect to actions, parameters and initial state."""
    ADJOINT = 2
    """Backward: of one cost."""


class EndHold(IntEnum):
    """Ways to hold an end of the rod."""

    FREE = 0
    PINNED = 1
    CLAMPED = 2


class Task(IntEnum):
    """Tasks of the kernel's parts, roughly in the order of a step."""

    INERTIAL_TARGETS = 0
    PREDICT = auto()
    MOVE_GRIPS = auto()
    EDGE_ENERGY = auto()
    BEND_ENERGY = auto()
    OBSTACLE_CONTACT = auto()
    SELF_CONTACT = auto()
    FACTORIZE = auto()
    ACCEPT_ITERATE = auto()
    SUBTRACT_COUPLINGS = auto()
    SOLVE = auto()
    APPLY_STEP = auto()
    SOLVED = auto()
    UPDATE_STATE = auto()
    INERTIA_DERIVATIVES = auto()
    PARAMETER_DERIVATIVES = auto()
    GRIP_SENSITIVITIES = auto()
    SENSITIVITIES = auto()
    SUBTRACT_SELF_CONTACT_COUPLINGS = auto()
    SOLVE_EXACTLY = auto()
    SOLVE_AGAIN = auto()
    WRITE_SENSITIVITIES = auto()
    FOLD_SELF_CONTACTS = auto()
    SEED_STATE = auto()
    ADJOINT = auto()
    GRIP_ADJOINT = auto()
    DONE = auto()


class HessianPart(IntEnum):
    """Parts of the Hessian that an evaluation of the energy computes."""

    POSITIVE = 0
    """A positive definite part."""
    MIXED = auto()
    """All of it, with the tensions that the last linear solve predicted."""
    TRUE = auto()
    """All of it, with the tensions of the iterate."""
    NONE = auto()
    """Nothing: the gradient alone."""


class Phase(IntEnum):
    """Phases of a solve."""

    ITERATION = 0
    FINAL_HESSIAN = auto()
    """Factorization of the true Hessian after an iteration that ended with a modified one."""
    DERIVATIVES = auto()
    FINISHED = auto()


class FrictionMode(IntEnum):
    """Ways in which an evaluation of friction tells samples that slide from those that stick."""

    FIRST = -1
    """First iterate of a solve: as at the end of the solve before."""
    NEWTON = 0
    """By the force of each sample; one that turns back sticks."""
    LINE_SEARCH = 1
    """By the force alone, with the energy at the limits of the last iterate that was accepted."""
    FINAL = 2
    """By the force alone, after a solve."""
