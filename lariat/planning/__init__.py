"""Planning of whole paths for both ends of a rope, past obstacles, within the arms' limits.

`plan` solves a `Problem`; `scenario_problem` makes that of a scenario's run, `problem_of` that of
any two shapes in its cell. Arms need the extra `planning`.
"""

from __future__ import annotations

from lariat.planning.cell_problem import problem_of, scenario_departure, scenario_problem
from lariat.planning.problem import Problem, WholePath
from lariat.planning.rope_model import RopeModel
from lariat.planning.whole_path import plan

__all__ = [
    "Problem",
    "RopeModel",
    "WholePath",
    "plan",
    "problem_of",
    "scenario_departure",
    "scenario_problem",
]
