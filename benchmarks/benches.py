"""Benches of `lariat bench NAME [PART]`: module that holds `run`, and one line for `--help`."""

from __future__ import annotations

from typing import NamedTuple


class Bench(NamedTuple):
    """One entry of `lariat bench --help`."""

    module: str
    """Module with a function `run`, whose signature is the command line."""
    summary: str


BENCHES: dict[str, Bench] = {
    "goals": Bench("benchmarks.goals.bench", "closed-loop runs to random goals in random scenes"),
    "robustness": Bench(
        "benchmarks.robustness.bench", "runs with hidden ropes, grips and simulators"
    ),
    "robustness boards": Bench(
        "benchmarks.robustness.boards", "a cable laid on boards whose clips are moved"
    ),
    "narrow": Bench("benchmarks.narrow.bench", "paths through posts, beams, windows and corridors"),
    "narrow ablation": Bench(
        "benchmarks.narrow.ablation", "paths with parts of the planner switched off in turn"
    ),
    "paper": Bench("benchmarks.paper.bench", "the paper's simulations, its methods and ours"),
    "paper horizon": Bench("benchmarks.paper.horizon", "the time to plan one horizon"),
    "paper real": Bench("benchmarks.paper.real", "its real experiments, MuJoCo as the lab"),
    "physics": Bench("benchmarks.physics.bench", "the rod against the continuum and closed forms"),
    "physics cables": Bench("benchmarks.physics.cables", "stiffness of real cables"),
    "physics twins": Bench("benchmarks.physics.twins", "stated intervals of identified twins"),
    "rod": Bench("benchmarks.rod.bench", "the rod's speed and robustness"),
    "compare": Bench("benchmarks.compare.bench", "solvers side by side: error over time"),
    "perception": Bench("benchmarks.perception.bench", "accuracy of the perceived rope"),
    "perception following": Bench(
        "benchmarks.perception.following.bench", "a held rope beside other ropes and behind hands"
    ),
    "perception instances": Bench(
        "benchmarks.perception.instances.bench", "ropes in pictures, and truth of their p_wrong"
    ),
    "perception camera": Bench("benchmarks.perception.camera", "the simulated camera, and markers"),
    "faults": Bench(
        "benchmarks.faults.bench", "faults injected into the live stack, and how arms stop"
    ),
    "faults attacks": Bench("benchmarks.faults.attacks", "attacks by those who may not use it"),
    "faults chunks": Bench("benchmarks.faults.chunks", "the gateway's tick with longest chunks"),
    "speed run": Bench("benchmarks.speed.headless", "a headless run by process"),
    "speed live": Bench("benchmarks.speed.live", "steps of the live stack, from a recording"),
    "speed start": Bench("benchmarks.speed.start", "each process until the stack is ready"),
    "speed page": Bench("benchmarks.speed.page", "the load of the dashboard's process"),
    "speed endurance": Bench(
        "benchmarks.speed.endurance", "a live stack for hours: memory, files, steps"
    ),
}
"""Benches by name, and their parts by name and part."""


def find(words: list[str]) -> tuple[str, list[str]]:
    """Return the name of the bench that begins a command's words, and the words after it."""
    for count in (2, 1):
        name = " ".join(words[:count])
        if name in BENCHES and len(words) >= count:
            return name, words[count:]
    raise KeyError(" ".join(words[:2]))
