"""Finished run as arrays, tables, plots and a view."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from jaxtyping import Float64

from lariat.configuration import ConfigurationError
from lariat.geometry.obstacles import Obstacle, chain_clearance
from lariat.scenario import Goal, Scenario
from shared.messages.parameters import described
from stack.simulation.score import Score

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TableName = Literal["nodes", "errors", "parameters"]


@dataclass(frozen=True)
class SimulatedRun:
    """A finished run; it can be pickled."""

    scenario: Scenario
    """Scenario that ran."""
    score: Score
    """Measured quantities."""
    reason: str
    """Why the run ended."""
    goal: Goal | None
    """Goal at the end."""
    times: Float64[np.ndarray, "t"]
    """Times since the start [s]."""
    nodes: Float64[np.ndarray, "t n 3"]
    """Nodes of the true rope, which is finer than the controller's [m]."""
    errors: Float64[np.ndarray, "t 2"]
    """Mean and largest distance of the nodes that count from the goal [m]."""
    parameter_times: Float64[np.ndarray, "k"]
    """Times at which parameters were published, since the start [s]."""
    parameters: dict[str, Float64[np.ndarray, "k 2"]]
    """Value and standard deviation of each parameter of the rope by name [SI]; the deviation of one
    that is not estimated is 0."""
    scenes: tuple[tuple[Obstacle, ...], ...] = field(repr=False)
    """True obstacles at each time, without supports."""
    arms: tuple[bytes, ...] = field(repr=False)
    """Encoded `ArmStates` at each time; empty before the first."""

    @cached_property
    def clearances(self) -> Float64[np.ndarray, "t"]:
        """Distances between the surfaces of rope and obstacles, infinite without any [m]."""
        radius = self.scenario.plant_rope.diameter / 2.0
        pairs = zip(self.nodes, self.scenes, strict=True)
        return np.array([chain_clearance(nodes, radius, scene) for nodes, scene in pairs])

    def table(self, name: TableName) -> dict[str, np.ndarray]:
        """Return columns of equal length by their names.

        Args:
            name: `nodes` with a row for each node at each time: time, node, x, y, z; `errors`:
                time, error, max_error, clearance; `parameters` with a row for each parameter at
                each time: time, name, value, deviation. SI units.
        """
        match name:
            case "nodes":
                count = self.nodes.shape[1]
                x, y, z = self.nodes.reshape(-1, 3).T
                return {
                    "time": np.repeat(self.times, count),
                    "node": np.tile(np.arange(count), len(self.times)),
                    "x": x,
                    "y": y,
                    "z": z,
                }
            case "errors":
                mean, largest = self.errors.T
                columns = {"error": mean, "max_error": largest, "clearance": self.clearances}
                return {"time": self.times, **columns}
            case "parameters":
                values = np.concatenate([*self.parameters.values(), np.zeros((0, 2))])
                return {
                    "time": np.tile(self.parameter_times, len(self.parameters)),
                    "name": np.repeat(list(self.parameters), len(self.parameter_times)),
                    "value": values[:, 0],
                    "deviation": values[:, 1],
                }
        raise ValueError(f"table {name!r}; there are 'nodes', 'errors' and 'parameters'")

    def frame(self, name: TableName) -> Any:
        """Return a `table` as a data frame of pandas.

        Raises:
            ConfigurationError: pandas is not installed.
        """
        try:
            import pandas  # pyright: ignore[reportMissingImports]
        except ImportError:
            raise ConfigurationError(
                "data frames need pandas: pip install pandas; table() has the same columns as "
                "arrays"
            ) from None
        return pandas.DataFrame(self.table(name))

    def plot(self, parameters: Sequence[str] = ("bending_stiffness",)) -> Figure:
        """Return a figure of errors and clearance over time, and of parameters with deviations.

        Args:
            parameters: Names of the parameters that are drawn where they are estimated.
        """
        import matplotlib.pyplot as plt

        drawn = [n for n in parameters if np.any(self.parameters.get(n, np.zeros((1, 2)))[:, 1])]
        height = 4.0 + 1.6 * len(drawn)
        figure, rows = plt.subplots(
            2 + len(drawn), sharex=True, figsize=(7.0, height), layout="constrained"
        )
        rows[0].semilogy(self.times, 1e3 * self.errors, label=["mean", "largest"])
        rows[0].axhline(1e3 * self.scenario.run.tolerance, color="0.6")
        rows[0].legend()
        rows[0].set(ylabel="error [mm]", title=f"{self.scenario.name}: {self.reason}")
        rows[1].plot(self.times, 1e3 * self.clearances)
        rows[1].set(ylabel="clearance [mm]")
        for axes, name in zip(rows[2:], drawn, strict=True):
            value, deviation = self.parameters[name].T
            axes.plot(self.parameter_times, value)
            low, high = value - deviation, value + deviation
            axes.fill_between(self.parameter_times, low, high, alpha=0.3)
            words, unit = described(name)
            axes.set(ylabel=f"{words} [{unit}]")
        rows[-1].set(xlabel="time [s]")
        return figure

    def view(self, file: Path | str | None = None, height: int = 480) -> None:
        """Show the run in 3-D: inline in a notebook, else in a browser; rotate it with the mouse.

        Args:
            file: HTML file to write instead.
            height: Height in a notebook [pixels].
        """
        from stack.simulation.run_view import recorded_view

        view = recorded_view(self)
        if file is None:
            view.show(height)
        else:
            Path(file).write_text(view.as_html())
