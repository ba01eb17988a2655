"""Interfaces of methods and arms from outside of Lariat: plain arrays in, plain arrays out.

A method is a class with the members of `Controller`, `PathPlanner`, `StateEstimator` or
`RopePerception`, a driver one with those of `Arm`. It knows no bus, message or process, need not
derive from the protocol, and is created with one argument, its setup. A scenario names it as
`"package.module:Class"`.

Lengths are in metres, times in seconds, quaternions are wxyz, poses and vectors are in the world
frame. Of two grips, index 0 is the left one, which holds the first node.
"""

from lariat.protocols.arm import Arm, ArmFacts, ArmReading, ArmSetup
from lariat.protocols.controller import Controller, ControllerInput, ControllerSetup
from lariat.protocols.estimator import EstimatorSetup, NodeObservation, StateEstimator
from lariat.protocols.perception import PerceptionSetup, RopeEstimate, RopePerception
from lariat.protocols.planner import GripPath, PathPlanner, PlannerSetup, PlanningProblem

__all__ = [
    "Arm",
    "ArmFacts",
    "ArmReading",
    "ArmSetup",
    "Controller",
    "ControllerInput",
    "ControllerSetup",
    "EstimatorSetup",
    "GripPath",
    "NodeObservation",
    "PathPlanner",
    "PerceptionSetup",
    "PlannerSetup",
    "PlanningProblem",
    "RopeEstimate",
    "RopePerception",
    "StateEstimator",
]
