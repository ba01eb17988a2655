"""Read a recording: the error of a run over time, and the speed of its grips."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from lariat.geometry import polylines
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import chain
from shared.recording import Recording

FILE = Path(__file__).parents[1] / "tests" / "replay" / "three-cylinders.mcap"
"""Recording to read; `lariat up` writes yours to the folder `recordings`."""


def main(file: Path = FILE) -> Figure:
    recording = Recording.open(file)
    with tempfile.TemporaryDirectory() as folder:
        scenario = recording.scenario(Path(folder))  # the scenario and its files, as they were
    goal, errors, speeds = None, [], []
    keys = {topics.TASK_STATE.key, topics.ROPE_TRUTH.key, topics.ARM_STATE.key}
    for entry in recording.messages(keys):
        message = entry.parse()
        if entry.key == topics.TASK_STATE.key and message.goal.positions:
            goal = chain(message.goal.positions)
        elif entry.key == topics.ROPE_TRUTH.key and goal is not None:
            nodes = polylines.resample_smooth(chain(message.positions), len(goal))
            distance = np.linalg.norm(nodes - goal, axis=1).mean()
            errors.append((message.stamp / SECOND, 1e3 * distance))
        elif entry.key == topics.ARM_STATE.key:
            fastest = max(np.linalg.norm(arm.linear_velocity) for arm in message.arms)
            speeds.append((message.stamp / SECOND, fastest))

    print(f"{scenario.name}: from {errors[0][1]:.0f} mm to {errors[-1][1]:.2f} mm")
    figure, (above, below) = plt.subplots(2, sharex=True)
    above.semilogy(*np.array(errors).T)
    above.set(ylabel="error [mm]")
    below.plot(*np.array(speeds).T)
    below.axhline(scenario.limits.speed, color="0.6")
    below.set(xlabel="time [s]", ylabel="speed of the faster grip [m/s]")
    return figure


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FILE).savefig("08_read_a_recording.png")
