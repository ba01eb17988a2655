"""Benches of `lariat bench NAME`: name, module that holds `run`, one line for `--help`."""

from __future__ import annotations

from typing import NamedTuple


class Bench(NamedTuple):
    """One entry of `lariat bench --help`."""

    module: str
    """Module with a function `run`, whose signature is the command line."""
    summary: str


BENCHES: dict[str, Bench] = {
    "arms": Bench(
        "benchmarks.arms.bench", "ways of CR5s whose links meet obstacles, or each other"
    ),
    "attacks": Bench("benchmarks.attacks", "attacks on a live stack by those who may not use it"),
    "cables": Bench("benchmarks.cables", "stiffness of real cables, from hanging and twisting"),
    "camera": Bench("benchmarks.camera", "cost of the simulated camera, accuracy of markers"),
    "chunks": Bench("benchmarks.chunks", "time of the gateway's tick with the longest chunks"),
    "compose": Bench("benchmarks.compose", "every scenario in containers, up, run and down"),
    "coverage": Bench("benchmarks.coverage.bench", "truth of the stated standard deviations"),
    "endurance": Bench("benchmarks.endurance.bench", "hours of runs: memory, files, step times"),
    "faults": Bench("benchmarks.faults", "faults injected into the live stack, and how arms stop"),
    "following": Bench(
        "benchmarks.perception.following.bench", "a held rope beside other ropes and behind hands"
    ),
    "fuzz": Bench("benchmarks.fuzz", "hostile messages and files for every process"),
    "goals": Bench("benchmarks.goals.bench", "closed-loop runs to random goals in random scenes"),
    "horizon": Bench("benchmarks.horizon.bench", "time to plan one horizon, and its error"),
    "instances": Bench(
        "benchmarks.perception.instances.bench", "ropes told apart in pictures, and true doubt"
    ),
    "live": Bench("benchmarks.live", "step times of the live stack, from a recording"),
    "machines": Bench("benchmarks.machines", "a cell on two machines whose line is cut and healed"),
    "network": Bench(
        "benchmarks.network", "runs while messages are lost or late, or clocks differ"
    ),
    "page": Bench("benchmarks.page", "load of the dashboard's process while a run is played"),
    "paper": Bench("benchmarks.paper.bench", "the paper's simulations, its methods and ours"),
    "perception": Bench("benchmarks.perception.bench", "accuracy of the perceived rope"),
    "physics": Bench("benchmarks.physics.bench", "the rod against the continuum and closed forms"),
    "real": Bench("benchmarks.real.bench", "the paper's real experiments, with MuJoCo as the lab"),
    "replay": Bench("benchmarks.replay", "smallest change of a number that each replay detects"),
    "resets": Bench("benchmarks.resets", "every shipped scenario run, reset and run again"),
    "robustness": Bench(
        "benchmarks.robustness.bench", "runs with hidden ropes, grips and simulators"
    ),
    "rod": Bench("benchmarks.rod.bench", "the rod's gradients, speed, robustness and accuracy"),
    "run": Bench("benchmarks.stages.bench", "time of a headless run by stage of the loop"),
    "start": Bench("benchmarks.start", "processor time of each process until the stack is ready"),
    "ways": Bench("benchmarks.ways.bench", "paths through posts, beams, windows and corridors"),
}
"""Benches by name."""
