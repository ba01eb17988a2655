from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class RunState(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    IDLE: _ClassVar[RunState]
    RUNNING: _ClassVar[RunState]
    PAUSED: _ClassVar[RunState]
    REACHED: _ClassVar[RunState]
    FAILED: _ClassVar[RunState]
IDLE: RunState
RUNNING: RunState
PAUSED: RunState
REACHED: RunState
FAILED: RunState

class Grip(_message.Message):
    __slots__ = ("position", "orientation")
    POSITION_FIELD_NUMBER: _ClassVar[int]
    ORIENTATION_FIELD_NUMBER: _ClassVar[int]
    position: _containers.RepeatedScalarFieldContainer[float]
    orientation: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, position: _Optional[_Iterable[float]] = ..., orientation: _Optional[_Iterable[float]] = ...) -> None: ...

class Goal(_message.Message):
    __slots__ = ("positions", "left", "right", "left_oriented", "right_oriented", "turns", "part", "ends_only", "route")
    POSITIONS_FIELD_NUMBER: _ClassVar[int]
    LEFT_FIELD_NUMBER: _ClassVar[int]
    RIGHT_FIELD_NUMBER: _ClassVar[int]
    LEFT_ORIENTED_FIELD_NUMBER: _ClassVar[int]
    RIGHT_ORIENTED_FIELD_NUMBER: _ClassVar[int]
    TURNS_FIELD_NUMBER: _ClassVar[int]
    PART_FIELD_NUMBER: _ClassVar[int]
    ENDS_ONLY_FIELD_NUMBER: _ClassVar[int]
    ROUTE_FIELD_NUMBER: _ClassVar[int]
    positions: _containers.RepeatedScalarFieldContainer[float]
    left: Grip
    right: Grip
    left_oriented: bool
    right_oriented: bool
    turns: float
    part: _containers.RepeatedScalarFieldContainer[float]
    ends_only: bool
    route: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, positions: _Optional[_Iterable[float]] = ..., left: _Optional[_Union[Grip, _Mapping]] = ..., right: _Optional[_Union[Grip, _Mapping]] = ..., left_oriented: _Optional[bool] = ..., right_oriented: _Optional[bool] = ..., turns: _Optional[float] = ..., part: _Optional[_Iterable[float]] = ..., ends_only: _Optional[bool] = ..., route: _Optional[_Iterable[str]] = ...) -> None: ...

class TaskState(_message.Message):
    __slots__ = ("stamp", "revision", "state", "reason", "goal", "goal_revision", "reset_count", "replan_count", "run", "run_started", "settings", "last_request", "refusal", "error", "clearance", "turns", "reason_code", "clearance_margin", "pace", "angle_error", "tension", "restore_count")
    class Reason(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        UNSPECIFIED: _ClassVar[TaskState.Reason]
        WAITING_FOR_START: _ClassVar[TaskState.Reason]
        STARTED: _ClassVar[TaskState.Reason]
        SCHEDULED_GOAL: _ClassVar[TaskState.Reason]
        SETTLED: _ClassVar[TaskState.Reason]
        PAUSE_REQUESTED: _ClassVar[TaskState.Reason]
        STOP_REQUESTED: _ClassVar[TaskState.Reason]
        RESET_REQUESTED: _ClassVar[TaskState.Reason]
        LEFT_GOAL: _ClassVar[TaskState.Reason]
        SNAG_STAYS_BEHIND: _ClassVar[TaskState.Reason]
        SNAG_TAUT: _ClassVar[TaskState.Reason]
        STALLED: _ClassVar[TaskState.Reason]
        PATH_ENDS_SHORT: _ClassVar[TaskState.Reason]
        NO_PATH: _ClassVar[TaskState.Reason]
        PATH_NOT_FOLLOWED: _ClassVar[TaskState.Reason]
        CONTACT_EXPECTED: _ClassVar[TaskState.Reason]
        METHOD_FAULT: _ClassVar[TaskState.Reason]
        SLIPPED: _ClassVar[TaskState.Reason]
        NEXT_GOAL: _ClassVar[TaskState.Reason]
        PULLED: _ClassVar[TaskState.Reason]
    UNSPECIFIED: TaskState.Reason
    WAITING_FOR_START: TaskState.Reason
    STARTED: TaskState.Reason
    SCHEDULED_GOAL: TaskState.Reason
    SETTLED: TaskState.Reason
    PAUSE_REQUESTED: TaskState.Reason
    STOP_REQUESTED: TaskState.Reason
    RESET_REQUESTED: TaskState.Reason
    LEFT_GOAL: TaskState.Reason
    SNAG_STAYS_BEHIND: TaskState.Reason
    SNAG_TAUT: TaskState.Reason
    STALLED: TaskState.Reason
    PATH_ENDS_SHORT: TaskState.Reason
    NO_PATH: TaskState.Reason
    PATH_NOT_FOLLOWED: TaskState.Reason
    CONTACT_EXPECTED: TaskState.Reason
    METHOD_FAULT: TaskState.Reason
    SLIPPED: TaskState.Reason
    NEXT_GOAL: TaskState.Reason
    PULLED: TaskState.Reason
    class SettingsEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: str
        def __init__(self, key: _Optional[str] = ..., value: _Optional[str] = ...) -> None: ...
    STAMP_FIELD_NUMBER: _ClassVar[int]
    REVISION_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    GOAL_FIELD_NUMBER: _ClassVar[int]
    GOAL_REVISION_FIELD_NUMBER: _ClassVar[int]
    RESET_COUNT_FIELD_NUMBER: _ClassVar[int]
    REPLAN_COUNT_FIELD_NUMBER: _ClassVar[int]
    RUN_FIELD_NUMBER: _ClassVar[int]
    RUN_STARTED_FIELD_NUMBER: _ClassVar[int]
    SETTINGS_FIELD_NUMBER: _ClassVar[int]
    LAST_REQUEST_FIELD_NUMBER: _ClassVar[int]
    REFUSAL_FIELD_NUMBER: _ClassVar[int]
    ERROR_FIELD_NUMBER: _ClassVar[int]
    CLEARANCE_FIELD_NUMBER: _ClassVar[int]
    TURNS_FIELD_NUMBER: _ClassVar[int]
    REASON_CODE_FIELD_NUMBER: _ClassVar[int]
    CLEARANCE_MARGIN_FIELD_NUMBER: _ClassVar[int]
    PACE_FIELD_NUMBER: _ClassVar[int]
    ANGLE_ERROR_FIELD_NUMBER: _ClassVar[int]
    TENSION_FIELD_NUMBER: _ClassVar[int]
    RESTORE_COUNT_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    revision: int
    state: RunState
    reason: str
    goal: Goal
    goal_revision: int
    reset_count: int
    replan_count: int
    run: str
    run_started: int
    settings: _containers.ScalarMap[str, str]
    last_request: str
    refusal: str
    error: float
    clearance: float
    turns: float
    reason_code: TaskState.Reason
    clearance_margin: float
    pace: float
    angle_error: float
    tension: float
    restore_count: int
    def __init__(self, stamp: _Optional[int] = ..., revision: _Optional[int] = ..., state: _Optional[_Union[RunState, str]] = ..., reason: _Optional[str] = ..., goal: _Optional[_Union[Goal, _Mapping]] = ..., goal_revision: _Optional[int] = ..., reset_count: _Optional[int] = ..., replan_count: _Optional[int] = ..., run: _Optional[str] = ..., run_started: _Optional[int] = ..., settings: _Optional[_Mapping[str, str]] = ..., last_request: _Optional[str] = ..., refusal: _Optional[str] = ..., error: _Optional[float] = ..., clearance: _Optional[float] = ..., turns: _Optional[float] = ..., reason_code: _Optional[_Union[TaskState.Reason, str]] = ..., clearance_margin: _Optional[float] = ..., pace: _Optional[float] = ..., angle_error: _Optional[float] = ..., tension: _Optional[float] = ..., restore_count: _Optional[int] = ...) -> None: ...

class TaskRequest(_message.Message):
    __slots__ = ("id", "stamp", "action", "goal", "key", "value", "move")
    class Action(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        SET_GOAL: _ClassVar[TaskRequest.Action]
        START: _ClassVar[TaskRequest.Action]
        PAUSE: _ClassVar[TaskRequest.Action]
        STOP: _ClassVar[TaskRequest.Action]
        RESET: _ClassVar[TaskRequest.Action]
        SET: _ClassVar[TaskRequest.Action]
        RESTORE: _ClassVar[TaskRequest.Action]
    SET_GOAL: TaskRequest.Action
    START: TaskRequest.Action
    PAUSE: TaskRequest.Action
    STOP: TaskRequest.Action
    RESET: TaskRequest.Action
    SET: TaskRequest.Action
    RESTORE: TaskRequest.Action
    ID_FIELD_NUMBER: _ClassVar[int]
    STAMP_FIELD_NUMBER: _ClassVar[int]
    ACTION_FIELD_NUMBER: _ClassVar[int]
    GOAL_FIELD_NUMBER: _ClassVar[int]
    KEY_FIELD_NUMBER: _ClassVar[int]
    VALUE_FIELD_NUMBER: _ClassVar[int]
    MOVE_FIELD_NUMBER: _ClassVar[int]
    id: str
    stamp: int
    action: TaskRequest.Action
    goal: Goal
    key: str
    value: str
    move: bool
    def __init__(self, id: _Optional[str] = ..., stamp: _Optional[int] = ..., action: _Optional[_Union[TaskRequest.Action, str]] = ..., goal: _Optional[_Union[Goal, _Mapping]] = ..., key: _Optional[str] = ..., value: _Optional[str] = ..., move: _Optional[bool] = ...) -> None: ...

class GoalDraft(_message.Message):
    __slots__ = ("id", "stamp", "left", "right", "turns", "pull", "node")
    ID_FIELD_NUMBER: _ClassVar[int]
    STAMP_FIELD_NUMBER: _ClassVar[int]
    LEFT_FIELD_NUMBER: _ClassVar[int]
    RIGHT_FIELD_NUMBER: _ClassVar[int]
    TURNS_FIELD_NUMBER: _ClassVar[int]
    PULL_FIELD_NUMBER: _ClassVar[int]
    NODE_FIELD_NUMBER: _ClassVar[int]
    id: str
    stamp: int
    left: Grip
    right: Grip
    turns: float
    pull: _containers.RepeatedScalarFieldContainer[float]
    node: int
    def __init__(self, id: _Optional[str] = ..., stamp: _Optional[int] = ..., left: _Optional[_Union[Grip, _Mapping]] = ..., right: _Optional[_Union[Grip, _Mapping]] = ..., turns: _Optional[float] = ..., pull: _Optional[_Iterable[float]] = ..., node: _Optional[int] = ...) -> None: ...

class GoalPreview(_message.Message):
    __slots__ = ("draft", "stamp", "reachable", "reason", "goal")
    DRAFT_FIELD_NUMBER: _ClassVar[int]
    STAMP_FIELD_NUMBER: _ClassVar[int]
    REACHABLE_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    GOAL_FIELD_NUMBER: _ClassVar[int]
    draft: str
    stamp: int
    reachable: bool
    reason: str
    goal: Goal
    def __init__(self, draft: _Optional[str] = ..., stamp: _Optional[int] = ..., reachable: _Optional[bool] = ..., reason: _Optional[str] = ..., goal: _Optional[_Union[Goal, _Mapping]] = ...) -> None: ...

class SavedGoal(_message.Message):
    __slots__ = ("name", "scenario", "goal")
    NAME_FIELD_NUMBER: _ClassVar[int]
    SCENARIO_FIELD_NUMBER: _ClassVar[int]
    GOAL_FIELD_NUMBER: _ClassVar[int]
    name: str
    scenario: str
    goal: Goal
    def __init__(self, name: _Optional[str] = ..., scenario: _Optional[str] = ..., goal: _Optional[_Union[Goal, _Mapping]] = ...) -> None: ...

class GoalList(_message.Message):
    __slots__ = ("stamp", "goals", "last_request", "refusal")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    GOALS_FIELD_NUMBER: _ClassVar[int]
    LAST_REQUEST_FIELD_NUMBER: _ClassVar[int]
    REFUSAL_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    goals: _containers.RepeatedCompositeFieldContainer[SavedGoal]
    last_request: str
    refusal: str
    def __init__(self, stamp: _Optional[int] = ..., goals: _Optional[_Iterable[_Union[SavedGoal, _Mapping]]] = ..., last_request: _Optional[str] = ..., refusal: _Optional[str] = ...) -> None: ...

class GoalListRequest(_message.Message):
    __slots__ = ("id", "stamp", "action", "name", "goal")
    class Action(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        UNSPECIFIED: _ClassVar[GoalListRequest.Action]
        SAVE: _ClassVar[GoalListRequest.Action]
        DELETE: _ClassVar[GoalListRequest.Action]
    UNSPECIFIED: GoalListRequest.Action
    SAVE: GoalListRequest.Action
    DELETE: GoalListRequest.Action
    ID_FIELD_NUMBER: _ClassVar[int]
    STAMP_FIELD_NUMBER: _ClassVar[int]
    ACTION_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    GOAL_FIELD_NUMBER: _ClassVar[int]
    id: str
    stamp: int
    action: GoalListRequest.Action
    name: str
    goal: Goal
    def __init__(self, id: _Optional[str] = ..., stamp: _Optional[int] = ..., action: _Optional[_Union[GoalListRequest.Action, str]] = ..., name: _Optional[str] = ..., goal: _Optional[_Union[Goal, _Mapping]] = ...) -> None: ...
