from shared.messages import task_pb2 as _task_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Path(_message.Message):
    __slots__ = ("stamp", "goal_revision", "scene_revision", "replan_count", "reached", "reason", "dt", "left_positions", "left_orientations", "right_positions", "right_orientations", "nodes", "node_count", "final_error", "clearance", "bending_stiffness", "blocked", "others_revision", "motion_run_started", "start_after", "start_before", "certain_clearance")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    GOAL_REVISION_FIELD_NUMBER: _ClassVar[int]
    SCENE_REVISION_FIELD_NUMBER: _ClassVar[int]
    REPLAN_COUNT_FIELD_NUMBER: _ClassVar[int]
    REACHED_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    DT_FIELD_NUMBER: _ClassVar[int]
    LEFT_POSITIONS_FIELD_NUMBER: _ClassVar[int]
    LEFT_ORIENTATIONS_FIELD_NUMBER: _ClassVar[int]
    RIGHT_POSITIONS_FIELD_NUMBER: _ClassVar[int]
    RIGHT_ORIENTATIONS_FIELD_NUMBER: _ClassVar[int]
    NODES_FIELD_NUMBER: _ClassVar[int]
    NODE_COUNT_FIELD_NUMBER: _ClassVar[int]
    FINAL_ERROR_FIELD_NUMBER: _ClassVar[int]
    CLEARANCE_FIELD_NUMBER: _ClassVar[int]
    BENDING_STIFFNESS_FIELD_NUMBER: _ClassVar[int]
    BLOCKED_FIELD_NUMBER: _ClassVar[int]
    OTHERS_REVISION_FIELD_NUMBER: _ClassVar[int]
    MOTION_RUN_STARTED_FIELD_NUMBER: _ClassVar[int]
    START_AFTER_FIELD_NUMBER: _ClassVar[int]
    START_BEFORE_FIELD_NUMBER: _ClassVar[int]
    CERTAIN_CLEARANCE_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    goal_revision: int
    scene_revision: int
    replan_count: int
    reached: bool
    reason: str
    dt: int
    left_positions: _containers.RepeatedScalarFieldContainer[float]
    left_orientations: _containers.RepeatedScalarFieldContainer[float]
    right_positions: _containers.RepeatedScalarFieldContainer[float]
    right_orientations: _containers.RepeatedScalarFieldContainer[float]
    nodes: _containers.RepeatedScalarFieldContainer[float]
    node_count: int
    final_error: float
    clearance: float
    bending_stiffness: float
    blocked: bool
    others_revision: int
    motion_run_started: int
    start_after: int
    start_before: int
    certain_clearance: float
    def __init__(self, stamp: _Optional[int] = ..., goal_revision: _Optional[int] = ..., scene_revision: _Optional[int] = ..., replan_count: _Optional[int] = ..., reached: _Optional[bool] = ..., reason: _Optional[str] = ..., dt: _Optional[int] = ..., left_positions: _Optional[_Iterable[float]] = ..., left_orientations: _Optional[_Iterable[float]] = ..., right_positions: _Optional[_Iterable[float]] = ..., right_orientations: _Optional[_Iterable[float]] = ..., nodes: _Optional[_Iterable[float]] = ..., node_count: _Optional[int] = ..., final_error: _Optional[float] = ..., clearance: _Optional[float] = ..., bending_stiffness: _Optional[float] = ..., blocked: _Optional[bool] = ..., others_revision: _Optional[int] = ..., motion_run_started: _Optional[int] = ..., start_after: _Optional[int] = ..., start_before: _Optional[int] = ..., certain_clearance: _Optional[float] = ...) -> None: ...

class Plan(_message.Message):
    __slots__ = ("stamp", "dt", "node_count", "nodes", "cost", "iterations")
    class CostEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: float
        def __init__(self, key: _Optional[str] = ..., value: _Optional[float] = ...) -> None: ...
    STAMP_FIELD_NUMBER: _ClassVar[int]
    DT_FIELD_NUMBER: _ClassVar[int]
    NODE_COUNT_FIELD_NUMBER: _ClassVar[int]
    NODES_FIELD_NUMBER: _ClassVar[int]
    COST_FIELD_NUMBER: _ClassVar[int]
    ITERATIONS_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    dt: int
    node_count: int
    nodes: _containers.RepeatedScalarFieldContainer[float]
    cost: _containers.ScalarMap[str, float]
    iterations: int
    def __init__(self, stamp: _Optional[int] = ..., dt: _Optional[int] = ..., node_count: _Optional[int] = ..., nodes: _Optional[_Iterable[float]] = ..., cost: _Optional[_Mapping[str, float]] = ..., iterations: _Optional[int] = ...) -> None: ...

class Estimate(_message.Message):
    __slots__ = ("value", "standard_deviation")
    VALUE_FIELD_NUMBER: _ClassVar[int]
    STANDARD_DEVIATION_FIELD_NUMBER: _ClassVar[int]
    value: float
    standard_deviation: float
    def __init__(self, value: _Optional[float] = ..., standard_deviation: _Optional[float] = ...) -> None: ...

class RodParameters(_message.Message):
    __slots__ = ("bending_stiffness", "twist_ratio", "damping", "length", "stiffness_profile", "rest_curvature", "grip_offset", "grip_rotation", "drag_coefficient", "yield_curvature", "friction_factor")
    BENDING_STIFFNESS_FIELD_NUMBER: _ClassVar[int]
    TWIST_RATIO_FIELD_NUMBER: _ClassVar[int]
    DAMPING_FIELD_NUMBER: _ClassVar[int]
    LENGTH_FIELD_NUMBER: _ClassVar[int]
    STIFFNESS_PROFILE_FIELD_NUMBER: _ClassVar[int]
    REST_CURVATURE_FIELD_NUMBER: _ClassVar[int]
    GRIP_OFFSET_FIELD_NUMBER: _ClassVar[int]
    GRIP_ROTATION_FIELD_NUMBER: _ClassVar[int]
    DRAG_COEFFICIENT_FIELD_NUMBER: _ClassVar[int]
    YIELD_CURVATURE_FIELD_NUMBER: _ClassVar[int]
    FRICTION_FACTOR_FIELD_NUMBER: _ClassVar[int]
    bending_stiffness: Estimate
    twist_ratio: Estimate
    damping: Estimate
    length: Estimate
    stiffness_profile: _containers.RepeatedCompositeFieldContainer[Estimate]
    rest_curvature: _containers.RepeatedCompositeFieldContainer[Estimate]
    grip_offset: _containers.RepeatedCompositeFieldContainer[Estimate]
    grip_rotation: _containers.RepeatedCompositeFieldContainer[Estimate]
    drag_coefficient: Estimate
    yield_curvature: Estimate
    friction_factor: Estimate
    def __init__(self, bending_stiffness: _Optional[_Union[Estimate, _Mapping]] = ..., twist_ratio: _Optional[_Union[Estimate, _Mapping]] = ..., damping: _Optional[_Union[Estimate, _Mapping]] = ..., length: _Optional[_Union[Estimate, _Mapping]] = ..., stiffness_profile: _Optional[_Iterable[_Union[Estimate, _Mapping]]] = ..., rest_curvature: _Optional[_Iterable[_Union[Estimate, _Mapping]]] = ..., grip_offset: _Optional[_Iterable[_Union[Estimate, _Mapping]]] = ..., grip_rotation: _Optional[_Iterable[_Union[Estimate, _Mapping]]] = ..., drag_coefficient: _Optional[_Union[Estimate, _Mapping]] = ..., yield_curvature: _Optional[_Union[Estimate, _Mapping]] = ..., friction_factor: _Optional[_Union[Estimate, _Mapping]] = ...) -> None: ...

class XpbdParameters(_message.Message):
    __slots__ = ("mass", "inertia", "linear_damping", "angular_damping", "bending_compliance")
    MASS_FIELD_NUMBER: _ClassVar[int]
    INERTIA_FIELD_NUMBER: _ClassVar[int]
    LINEAR_DAMPING_FIELD_NUMBER: _ClassVar[int]
    ANGULAR_DAMPING_FIELD_NUMBER: _ClassVar[int]
    BENDING_COMPLIANCE_FIELD_NUMBER: _ClassVar[int]
    mass: float
    inertia: float
    linear_damping: float
    angular_damping: float
    bending_compliance: float
    def __init__(self, mass: _Optional[float] = ..., inertia: _Optional[float] = ..., linear_damping: _Optional[float] = ..., angular_damping: _Optional[float] = ..., bending_compliance: _Optional[float] = ...) -> None: ...

class Parameters(_message.Message):
    __slots__ = ("stamp", "prediction_error", "rod", "xpbd", "plastic_curvature", "unknowns", "covariance")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    PREDICTION_ERROR_FIELD_NUMBER: _ClassVar[int]
    ROD_FIELD_NUMBER: _ClassVar[int]
    XPBD_FIELD_NUMBER: _ClassVar[int]
    PLASTIC_CURVATURE_FIELD_NUMBER: _ClassVar[int]
    UNKNOWNS_FIELD_NUMBER: _ClassVar[int]
    COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    prediction_error: float
    rod: RodParameters
    xpbd: XpbdParameters
    plastic_curvature: _containers.RepeatedScalarFieldContainer[float]
    unknowns: _containers.RepeatedScalarFieldContainer[float]
    covariance: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, stamp: _Optional[int] = ..., prediction_error: _Optional[float] = ..., rod: _Optional[_Union[RodParameters, _Mapping]] = ..., xpbd: _Optional[_Union[XpbdParameters, _Mapping]] = ..., plastic_curvature: _Optional[_Iterable[float]] = ..., unknowns: _Optional[_Iterable[float]] = ..., covariance: _Optional[_Iterable[float]] = ...) -> None: ...

class RunResult(_message.Message):
    __slots__ = ("stamp", "run", "reached", "duration", "error", "max_node_error", "min_clearance", "replans", "reason", "reason_code", "angle_error", "slow_pauses")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    RUN_FIELD_NUMBER: _ClassVar[int]
    REACHED_FIELD_NUMBER: _ClassVar[int]
    DURATION_FIELD_NUMBER: _ClassVar[int]
    ERROR_FIELD_NUMBER: _ClassVar[int]
    MAX_NODE_ERROR_FIELD_NUMBER: _ClassVar[int]
    MIN_CLEARANCE_FIELD_NUMBER: _ClassVar[int]
    REPLANS_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    REASON_CODE_FIELD_NUMBER: _ClassVar[int]
    ANGLE_ERROR_FIELD_NUMBER: _ClassVar[int]
    SLOW_PAUSES_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    run: str
    reached: bool
    duration: float
    error: float
    max_node_error: float
    min_clearance: float
    replans: int
    reason: str
    reason_code: _task_pb2.TaskState.Reason
    angle_error: float
    slow_pauses: int
    def __init__(self, stamp: _Optional[int] = ..., run: _Optional[str] = ..., reached: _Optional[bool] = ..., duration: _Optional[float] = ..., error: _Optional[float] = ..., max_node_error: _Optional[float] = ..., min_clearance: _Optional[float] = ..., replans: _Optional[int] = ..., reason: _Optional[str] = ..., reason_code: _Optional[_Union[_task_pb2.TaskState.Reason, str]] = ..., angle_error: _Optional[float] = ..., slow_pauses: _Optional[int] = ...) -> None: ...
