from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class ArmSetpoints(_message.Message):
    __slots__ = ("arm", "positions", "orientations")
    ARM_FIELD_NUMBER: _ClassVar[int]
    POSITIONS_FIELD_NUMBER: _ClassVar[int]
    ORIENTATIONS_FIELD_NUMBER: _ClassVar[int]
    arm: str
    positions: _containers.RepeatedScalarFieldContainer[float]
    orientations: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, arm: _Optional[str] = ..., positions: _Optional[_Iterable[float]] = ..., orientations: _Optional[_Iterable[float]] = ...) -> None: ...

class Setpoints(_message.Message):
    __slots__ = ("stamp", "session", "sequence", "t0", "dt", "arms", "image_stamp", "hold", "reason")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    T0_FIELD_NUMBER: _ClassVar[int]
    DT_FIELD_NUMBER: _ClassVar[int]
    ARMS_FIELD_NUMBER: _ClassVar[int]
    IMAGE_STAMP_FIELD_NUMBER: _ClassVar[int]
    HOLD_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    session: str
    sequence: int
    t0: int
    dt: int
    arms: _containers.RepeatedCompositeFieldContainer[ArmSetpoints]
    image_stamp: int
    hold: bool
    reason: str
    def __init__(self, stamp: _Optional[int] = ..., session: _Optional[str] = ..., sequence: _Optional[int] = ..., t0: _Optional[int] = ..., dt: _Optional[int] = ..., arms: _Optional[_Iterable[_Union[ArmSetpoints, _Mapping]]] = ..., image_stamp: _Optional[int] = ..., hold: _Optional[bool] = ..., reason: _Optional[str] = ...) -> None: ...

class JointPath(_message.Message):
    __slots__ = ("arm", "positions", "velocities")
    ARM_FIELD_NUMBER: _ClassVar[int]
    POSITIONS_FIELD_NUMBER: _ClassVar[int]
    VELOCITIES_FIELD_NUMBER: _ClassVar[int]
    arm: str
    positions: _containers.RepeatedScalarFieldContainer[float]
    velocities: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, arm: _Optional[str] = ..., positions: _Optional[_Iterable[float]] = ..., velocities: _Optional[_Iterable[float]] = ...) -> None: ...

class JointTrajectory(_message.Message):
    __slots__ = ("id", "stamp", "times", "arms", "cancel")
    ID_FIELD_NUMBER: _ClassVar[int]
    STAMP_FIELD_NUMBER: _ClassVar[int]
    TIMES_FIELD_NUMBER: _ClassVar[int]
    ARMS_FIELD_NUMBER: _ClassVar[int]
    CANCEL_FIELD_NUMBER: _ClassVar[int]
    id: str
    stamp: int
    times: _containers.RepeatedScalarFieldContainer[int]
    arms: _containers.RepeatedCompositeFieldContainer[JointPath]
    cancel: bool
    def __init__(self, id: _Optional[str] = ..., stamp: _Optional[int] = ..., times: _Optional[_Iterable[int]] = ..., arms: _Optional[_Iterable[_Union[JointPath, _Mapping]]] = ..., cancel: _Optional[bool] = ...) -> None: ...

class ArmState(_message.Message):
    __slots__ = ("arm", "driver", "position", "orientation", "linear_velocity", "angular_velocity", "joints", "gripper_closed", "alarms", "tracking_error", "link_age", "mode", "link_rate", "link_gap", "pull", "powered", "tracking_angle", "address", "commanded_joints", "force", "torque")
    ARM_FIELD_NUMBER: _ClassVar[int]
    DRIVER_FIELD_NUMBER: _ClassVar[int]
    POSITION_FIELD_NUMBER: _ClassVar[int]
    ORIENTATION_FIELD_NUMBER: _ClassVar[int]
    LINEAR_VELOCITY_FIELD_NUMBER: _ClassVar[int]
    ANGULAR_VELOCITY_FIELD_NUMBER: _ClassVar[int]
    JOINTS_FIELD_NUMBER: _ClassVar[int]
    GRIPPER_CLOSED_FIELD_NUMBER: _ClassVar[int]
    ALARMS_FIELD_NUMBER: _ClassVar[int]
    TRACKING_ERROR_FIELD_NUMBER: _ClassVar[int]
    LINK_AGE_FIELD_NUMBER: _ClassVar[int]
    MODE_FIELD_NUMBER: _ClassVar[int]
    LINK_RATE_FIELD_NUMBER: _ClassVar[int]
    LINK_GAP_FIELD_NUMBER: _ClassVar[int]
    PULL_FIELD_NUMBER: _ClassVar[int]
    POWERED_FIELD_NUMBER: _ClassVar[int]
    TRACKING_ANGLE_FIELD_NUMBER: _ClassVar[int]
    ADDRESS_FIELD_NUMBER: _ClassVar[int]
    COMMANDED_JOINTS_FIELD_NUMBER: _ClassVar[int]
    FORCE_FIELD_NUMBER: _ClassVar[int]
    TORQUE_FIELD_NUMBER: _ClassVar[int]
    arm: str
    driver: str
    position: _containers.RepeatedScalarFieldContainer[float]
    orientation: _containers.RepeatedScalarFieldContainer[float]
    linear_velocity: _containers.RepeatedScalarFieldContainer[float]
    angular_velocity: _containers.RepeatedScalarFieldContainer[float]
    joints: _containers.RepeatedScalarFieldContainer[float]
    gripper_closed: bool
    alarms: _containers.RepeatedScalarFieldContainer[str]
    tracking_error: float
    link_age: float
    mode: str
    link_rate: float
    link_gap: float
    pull: float
    powered: bool
    tracking_angle: float
    address: str
    commanded_joints: _containers.RepeatedScalarFieldContainer[float]
    force: _containers.RepeatedScalarFieldContainer[float]
    torque: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, arm: _Optional[str] = ..., driver: _Optional[str] = ..., position: _Optional[_Iterable[float]] = ..., orientation: _Optional[_Iterable[float]] = ..., linear_velocity: _Optional[_Iterable[float]] = ..., angular_velocity: _Optional[_Iterable[float]] = ..., joints: _Optional[_Iterable[float]] = ..., gripper_closed: _Optional[bool] = ..., alarms: _Optional[_Iterable[str]] = ..., tracking_error: _Optional[float] = ..., link_age: _Optional[float] = ..., mode: _Optional[str] = ..., link_rate: _Optional[float] = ..., link_gap: _Optional[float] = ..., pull: _Optional[float] = ..., powered: _Optional[bool] = ..., tracking_angle: _Optional[float] = ..., address: _Optional[str] = ..., commanded_joints: _Optional[_Iterable[float]] = ..., force: _Optional[_Iterable[float]] = ..., torque: _Optional[_Iterable[float]] = ...) -> None: ...

class ArmStates(_message.Message):
    __slots__ = ("stamp", "boot", "mode", "reason", "rule", "needs_acknowledgement", "session", "sequence", "refused_sequence", "last_command", "refusal", "arms", "braking", "reset_count", "cause", "may_move", "needs_resume", "next_session", "approach_distance", "approach_angle", "approaching", "needs_approach", "scenario", "reaches_hardware", "slow_pauses", "trajectory", "trajectory_state", "trajectory_reason", "chunk_refusal")
    class Mode(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        DISARMED: _ClassVar[ArmStates.Mode]
        ARMED: _ClassVar[ArmStates.Mode]
        MOVING: _ClassVar[ArmStates.Mode]
        HOLDING: _ClassVar[ArmStates.Mode]
        FAULT: _ClassVar[ArmStates.Mode]
    DISARMED: ArmStates.Mode
    ARMED: ArmStates.Mode
    MOVING: ArmStates.Mode
    HOLDING: ArmStates.Mode
    FAULT: ArmStates.Mode
    class TrajectoryState(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        NO_TRAJECTORY: _ClassVar[ArmStates.TrajectoryState]
        EXECUTING: _ClassVar[ArmStates.TrajectoryState]
        REACHED: _ClassVar[ArmStates.TrajectoryState]
        CANCELLED: _ClassVar[ArmStates.TrajectoryState]
        REFUSED: _ClassVar[ArmStates.TrajectoryState]
        STOPPED: _ClassVar[ArmStates.TrajectoryState]
    NO_TRAJECTORY: ArmStates.TrajectoryState
    EXECUTING: ArmStates.TrajectoryState
    REACHED: ArmStates.TrajectoryState
    CANCELLED: ArmStates.TrajectoryState
    REFUSED: ArmStates.TrajectoryState
    STOPPED: ArmStates.TrajectoryState
    STAMP_FIELD_NUMBER: _ClassVar[int]
    BOOT_FIELD_NUMBER: _ClassVar[int]
    MODE_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    RULE_FIELD_NUMBER: _ClassVar[int]
    NEEDS_ACKNOWLEDGEMENT_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    REFUSED_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    LAST_COMMAND_FIELD_NUMBER: _ClassVar[int]
    REFUSAL_FIELD_NUMBER: _ClassVar[int]
    ARMS_FIELD_NUMBER: _ClassVar[int]
    BRAKING_FIELD_NUMBER: _ClassVar[int]
    RESET_COUNT_FIELD_NUMBER: _ClassVar[int]
    CAUSE_FIELD_NUMBER: _ClassVar[int]
    MAY_MOVE_FIELD_NUMBER: _ClassVar[int]
    NEEDS_RESUME_FIELD_NUMBER: _ClassVar[int]
    NEXT_SESSION_FIELD_NUMBER: _ClassVar[int]
    APPROACH_DISTANCE_FIELD_NUMBER: _ClassVar[int]
    APPROACH_ANGLE_FIELD_NUMBER: _ClassVar[int]
    APPROACHING_FIELD_NUMBER: _ClassVar[int]
    NEEDS_APPROACH_FIELD_NUMBER: _ClassVar[int]
    SCENARIO_FIELD_NUMBER: _ClassVar[int]
    REACHES_HARDWARE_FIELD_NUMBER: _ClassVar[int]
    SLOW_PAUSES_FIELD_NUMBER: _ClassVar[int]
    TRAJECTORY_FIELD_NUMBER: _ClassVar[int]
    TRAJECTORY_STATE_FIELD_NUMBER: _ClassVar[int]
    TRAJECTORY_REASON_FIELD_NUMBER: _ClassVar[int]
    CHUNK_REFUSAL_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    boot: str
    mode: ArmStates.Mode
    reason: str
    rule: str
    needs_acknowledgement: bool
    session: str
    sequence: int
    refused_sequence: int
    last_command: str
    refusal: str
    arms: _containers.RepeatedCompositeFieldContainer[ArmState]
    braking: bool
    reset_count: int
    cause: str
    may_move: bool
    needs_resume: bool
    next_session: str
    approach_distance: float
    approach_angle: float
    approaching: bool
    needs_approach: bool
    scenario: str
    reaches_hardware: bool
    slow_pauses: int
    trajectory: str
    trajectory_state: ArmStates.TrajectoryState
    trajectory_reason: str
    chunk_refusal: str
    def __init__(self, stamp: _Optional[int] = ..., boot: _Optional[str] = ..., mode: _Optional[_Union[ArmStates.Mode, str]] = ..., reason: _Optional[str] = ..., rule: _Optional[str] = ..., needs_acknowledgement: _Optional[bool] = ..., session: _Optional[str] = ..., sequence: _Optional[int] = ..., refused_sequence: _Optional[int] = ..., last_command: _Optional[str] = ..., refusal: _Optional[str] = ..., arms: _Optional[_Iterable[_Union[ArmState, _Mapping]]] = ..., braking: _Optional[bool] = ..., reset_count: _Optional[int] = ..., cause: _Optional[str] = ..., may_move: _Optional[bool] = ..., needs_resume: _Optional[bool] = ..., next_session: _Optional[str] = ..., approach_distance: _Optional[float] = ..., approach_angle: _Optional[float] = ..., approaching: _Optional[bool] = ..., needs_approach: _Optional[bool] = ..., scenario: _Optional[str] = ..., reaches_hardware: _Optional[bool] = ..., slow_pauses: _Optional[int] = ..., trajectory: _Optional[str] = ..., trajectory_state: _Optional[_Union[ArmStates.TrajectoryState, str]] = ..., trajectory_reason: _Optional[str] = ..., chunk_refusal: _Optional[str] = ...) -> None: ...

class ArmCommand(_message.Message):
    __slots__ = ("id", "stamp", "boot", "action", "arm", "close", "answers", "approach_distance", "approach_angle", "session")
    class Action(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        UNSPECIFIED: _ClassVar[ArmCommand.Action]
        ARM: _ClassVar[ArmCommand.Action]
        APPROACH: _ClassVar[ArmCommand.Action]
        DISARM: _ClassVar[ArmCommand.Action]
        HOLD: _ClassVar[ArmCommand.Action]
        ACKNOWLEDGE: _ClassVar[ArmCommand.Action]
        RESUME: _ClassVar[ArmCommand.Action]
        GRIPPER: _ClassVar[ArmCommand.Action]
    UNSPECIFIED: ArmCommand.Action
    ARM: ArmCommand.Action
    APPROACH: ArmCommand.Action
    DISARM: ArmCommand.Action
    HOLD: ArmCommand.Action
    ACKNOWLEDGE: ArmCommand.Action
    RESUME: ArmCommand.Action
    GRIPPER: ArmCommand.Action
    ID_FIELD_NUMBER: _ClassVar[int]
    STAMP_FIELD_NUMBER: _ClassVar[int]
    BOOT_FIELD_NUMBER: _ClassVar[int]
    ACTION_FIELD_NUMBER: _ClassVar[int]
    ARM_FIELD_NUMBER: _ClassVar[int]
    CLOSE_FIELD_NUMBER: _ClassVar[int]
    ANSWERS_FIELD_NUMBER: _ClassVar[int]
    APPROACH_DISTANCE_FIELD_NUMBER: _ClassVar[int]
    APPROACH_ANGLE_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    id: str
    stamp: int
    boot: str
    action: ArmCommand.Action
    arm: str
    close: bool
    answers: int
    approach_distance: float
    approach_angle: float
    session: str
    def __init__(self, id: _Optional[str] = ..., stamp: _Optional[int] = ..., boot: _Optional[str] = ..., action: _Optional[_Union[ArmCommand.Action, str]] = ..., arm: _Optional[str] = ..., close: _Optional[bool] = ..., answers: _Optional[int] = ..., approach_distance: _Optional[float] = ..., approach_angle: _Optional[float] = ..., session: _Optional[str] = ...) -> None: ...

class Consent(_message.Message):
    __slots__ = ("command", "boot", "sequence", "stamp", "answers")
    COMMAND_FIELD_NUMBER: _ClassVar[int]
    BOOT_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    STAMP_FIELD_NUMBER: _ClassVar[int]
    ANSWERS_FIELD_NUMBER: _ClassVar[int]
    command: str
    boot: str
    sequence: int
    stamp: int
    answers: int
    def __init__(self, command: _Optional[str] = ..., boot: _Optional[str] = ..., sequence: _Optional[int] = ..., stamp: _Optional[int] = ..., answers: _Optional[int] = ...) -> None: ...
