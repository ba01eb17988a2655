"""Classes from outside of Lariat: found by name, called under guard.

A name is that of an entry point of an installed package, or `package.module:Class`. Only what a
process is given at its start may name one: a scenario's file or a command line, never a message
and, unless it is allowed by name, no recording.
"""

from __future__ import annotations

import importlib
import sys
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64

from lariat.configuration import ConfigurationError, Extensible
from lariat.scenario.sections import (
    CONTROL_METHODS,
    DRIVERS,
    PATH_PLANNERS,
    PERCEPTION_METHODS,
    SIDES,
    STATE_ESTIMATORS,
)


class ExtensionFault(Exception):
    """A class from outside has raised or answered nonsense; the text says which and how."""


@dataclass(frozen=True)
class Extension:
    """Name of a class from outside, and the key that gives it."""

    key: str
    """Key of the scenario."""
    name: str
    """Name of an entry point, or `package.module:Class`."""
    names: Extensible
    """Names of Lariat's own, and the group of entry points."""

    def __str__(self) -> str:
        return f"{self.key} {self.name!r}"

    def load(self) -> type:
        """Import and return the class.

        Raises:
            ConfigurationError: It cannot be imported.
        """
        if ":" not in self.name:
            for point in entry_points(group=self.names.group, name=self.name):
                return self._imported(point.value)
            raise ConfigurationError(
                f"{self.key} = {self.name!r}: no installed package has an entry point of that name "
                f"in group {self.names.group!r}"
            )
        return self._imported(self.name)

    def _imported(self, place: str) -> type:
        module, _, attribute = place.partition(":")
        # The folder in which the command was typed, as with `python -m`.
        here = str(Path.cwd())
        if here not in sys.path and "" not in sys.path:
            sys.path.append(here)
        try:
            imported = getattr(importlib.import_module(module), attribute)
        except ModuleNotFoundError as error:
            raise ConfigurationError(
                f"{self.key} = {self.name!r}: no module {error.name!r}; install its package, or "
                "start Lariat in the folder that holds it"
            ) from error
        except AttributeError as error:
            raise ConfigurationError(f"{self.key} = {self.name!r}: {error}") from error
        except Exception as error:
            raise ConfigurationError(
                f"{self.key} = {self.name!r}: its module raised {_place_of(error)}"
            ) from error
        if not isinstance(imported, type):
            raise ConfigurationError(f"{self.key} = {self.name!r} is no class")
        return imported

    def create(self, members: Sequence[str], setup: object) -> Any:
        """Import the class and return an instance.

        Args:
            members: Names of the methods that it must have.
            setup: Argument of its constructor.

        Raises:
            ConfigurationError: It cannot be imported, lacks a method, or its constructor raises.
        """
        kind = self.load()
        missing = [name for name in members if not callable(getattr(kind, name, None))]
        if missing:
            raise ConfigurationError(f"{self.key} = {self.name!r} lacks {', '.join(missing)}()")
        try:
            return kind(setup)
        except ConfigurationError:
            raise
        except Exception as error:
            raise ConfigurationError(
                f"{self.key} = {self.name!r}: its constructor raised {_place_of(error)}"
            ) from error

    @contextmanager
    def guarded(self, call: str) -> Iterator[None]:
        """Turn whatever a call raises into a fault that says whose it is.

        Args:
            call: Name of the method that is called.

        Raises:
            ExtensionFault: The call raised.
        """
        try:
            yield
        except ExtensionFault:
            raise
        except Exception as error:
            raise ExtensionFault(f"{self}: {call}() raised {_place_of(error)}") from error

    def checked(
        self, call: str, answer: object, shape: tuple[int, ...]
    ) -> Float64[np.ndarray, ...]:
        """Return a numerical answer as an array.

        Args:
            call: Name of the method that answered.
            answer: Its answer.
            shape: Shape that it must have; -1 stands for any length.

        Raises:
            ExtensionFault: The answer is not numerical, not finite or of another shape.
        """
        try:
            array = np.array(answer, dtype=float)
        except (TypeError, ValueError) as error:
            raise ExtensionFault(f"{self}: {call}() answered no array: {error}") from error
        fits = array.ndim == len(shape) and all(
            expected in (-1, length) for expected, length in zip(shape, array.shape, strict=True)
        )
        if not fits:
            expected = tuple("any" if n == -1 else n for n in shape)
            raise ExtensionFault(
                f"{self}: {call}() answered an array of shape {array.shape}, not {expected}"
            )
        if not np.all(np.isfinite(array)):
            raise ExtensionFault(f"{self}: {call}() answered a number that is not finite")
        return array


def extension(key: str, name: str, names: Extensible) -> Extension | None:
    """Return the extension that a key names; None for a name of Lariat's own."""
    return None if name in names.included else Extension(key, name, names)


def extensions_of(scenario: Any) -> tuple[Extension, ...]:
    """Return all classes from outside that a scenario names.

    Args:
        scenario: A `lariat.scenario.Scenario`.
    """
    control = scenario.control
    named = [
        extension("control.method", control.method, CONTROL_METHODS),
        extension("control.state_estimator", control.state_estimator, STATE_ESTIMATORS),
        extension("control.path_planner", control.path_planner, PATH_PLANNERS),
        extension("sensing.method", scenario.sensing.method, PERCEPTION_METHODS),
        *(extension(f"ends.{s}.driver", scenario.end(s).driver, DRIVERS) for s in SIDES),
    ]
    return tuple(each for each in named if each is not None)


def require_allowed(scenario: Any, allowed: Sequence[str]) -> None:
    """Refuse a scenario that was not given by a person and names classes from outside.

    Args:
        scenario: Scenario of a recording.
        allowed: Names that a person has allowed.

    Raises:
        ConfigurationError: It names a class that is not allowed.
    """
    for named in extensions_of(scenario):
        if named.name not in allowed:
            raise ConfigurationError(
                f"the recording names {named.key} = {named.name!r}, code from outside of Lariat; "
                f"if you trust it, allow it with --allow {named.name}"
            )


def _place_of(error: Exception) -> str:
    """Return an exception with the file and line that raised it."""
    frames = traceback.extract_tb(error.__traceback__)
    where = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {error}{where}"
