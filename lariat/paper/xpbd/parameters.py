"""Parameters that the paper's rod can be differentiated in."""

from __future__ import annotations

PARAMETERS = ("mass", "inertia", "linear_damping", "angular_damping", "bending_compliance")
"""Parameters theta of Algorithm 1, line 2, fields of `XpbdProperties`, in the kernel's order."""


def check_parameters(names: tuple[str, ...]) -> None:
    """Check the names of parameters.

    Raises:
        ValueError: A name is not a parameter of the paper's rod.
    """
    for name in names:
        if name not in PARAMETERS:
            raise ValueError(f"no parameter {name!r}; choose from {', '.join(PARAMETERS)}")
