from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class RunSummary(_message.Message):
    __slots__ = ("id", "files", "scenario", "run", "started", "duration", "reached", "reason", "error", "max_node_error", "min_clearance", "replans", "method", "version", "note", "star", "over", "bytes")
    ID_FIELD_NUMBER: _ClassVar[int]
    FILES_FIELD_NUMBER: _ClassVar[int]
    SCENARIO_FIELD_NUMBER: _ClassVar[int]
    RUN_FIELD_NUMBER: _ClassVar[int]
    STARTED_FIELD_NUMBER: _ClassVar[int]
    DURATION_FIELD_NUMBER: _ClassVar[int]
    REACHED_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    ERROR_FIELD_NUMBER: _ClassVar[int]
    MAX_NODE_ERROR_FIELD_NUMBER: _ClassVar[int]
    MIN_CLEARANCE_FIELD_NUMBER: _ClassVar[int]
    REPLANS_FIELD_NUMBER: _ClassVar[int]
    METHOD_FIELD_NUMBER: _ClassVar[int]
    VERSION_FIELD_NUMBER: _ClassVar[int]
    NOTE_FIELD_NUMBER: _ClassVar[int]
    STAR_FIELD_NUMBER: _ClassVar[int]
    OVER_FIELD_NUMBER: _ClassVar[int]
    BYTES_FIELD_NUMBER: _ClassVar[int]
    id: str
    files: _containers.RepeatedScalarFieldContainer[str]
    scenario: str
    run: str
    started: int
    duration: float
    reached: bool
    reason: str
    error: float
    max_node_error: float
    min_clearance: float
    replans: int
    method: str
    version: str
    note: str
    star: bool
    over: bool
    bytes: int
    def __init__(self, id: _Optional[str] = ..., files: _Optional[_Iterable[str]] = ..., scenario: _Optional[str] = ..., run: _Optional[str] = ..., started: _Optional[int] = ..., duration: _Optional[float] = ..., reached: _Optional[bool] = ..., reason: _Optional[str] = ..., error: _Optional[float] = ..., max_node_error: _Optional[float] = ..., min_clearance: _Optional[float] = ..., replans: _Optional[int] = ..., method: _Optional[str] = ..., version: _Optional[str] = ..., note: _Optional[str] = ..., star: _Optional[bool] = ..., over: _Optional[bool] = ..., bytes: _Optional[int] = ...) -> None: ...

class RunList(_message.Message):
    __slots__ = ("stamp", "runs", "last_request", "refusal")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    RUNS_FIELD_NUMBER: _ClassVar[int]
    LAST_REQUEST_FIELD_NUMBER: _ClassVar[int]
    REFUSAL_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    runs: _containers.RepeatedCompositeFieldContainer[RunSummary]
    last_request: str
    refusal: str
    def __init__(self, stamp: _Optional[int] = ..., runs: _Optional[_Iterable[_Union[RunSummary, _Mapping]]] = ..., last_request: _Optional[str] = ..., refusal: _Optional[str] = ...) -> None: ...

class RunListRequest(_message.Message):
    __slots__ = ("id", "stamp", "action", "runs", "note", "star", "time")
    class Action(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        UNSPECIFIED: _ClassVar[RunListRequest.Action]
        ANNOTATE: _ClassVar[RunListRequest.Action]
        DELETE: _ClassVar[RunListRequest.Action]
        SEND_CURVES: _ClassVar[RunListRequest.Action]
        SEND_MOTION: _ClassVar[RunListRequest.Action]
        SEND_PICTURE: _ClassVar[RunListRequest.Action]
        MAKE_VIDEO: _ClassVar[RunListRequest.Action]
        CANCEL_VIDEO: _ClassVar[RunListRequest.Action]
    UNSPECIFIED: RunListRequest.Action
    ANNOTATE: RunListRequest.Action
    DELETE: RunListRequest.Action
    SEND_CURVES: RunListRequest.Action
    SEND_MOTION: RunListRequest.Action
    SEND_PICTURE: RunListRequest.Action
    MAKE_VIDEO: RunListRequest.Action
    CANCEL_VIDEO: RunListRequest.Action
    ID_FIELD_NUMBER: _ClassVar[int]
    STAMP_FIELD_NUMBER: _ClassVar[int]
    ACTION_FIELD_NUMBER: _ClassVar[int]
    RUNS_FIELD_NUMBER: _ClassVar[int]
    NOTE_FIELD_NUMBER: _ClassVar[int]
    STAR_FIELD_NUMBER: _ClassVar[int]
    TIME_FIELD_NUMBER: _ClassVar[int]
    id: str
    stamp: int
    action: RunListRequest.Action
    runs: _containers.RepeatedScalarFieldContainer[str]
    note: str
    star: bool
    time: float
    def __init__(self, id: _Optional[str] = ..., stamp: _Optional[int] = ..., action: _Optional[_Union[RunListRequest.Action, str]] = ..., runs: _Optional[_Iterable[str]] = ..., note: _Optional[str] = ..., star: _Optional[bool] = ..., time: _Optional[float] = ...) -> None: ...

class RunCurves(_message.Message):
    __slots__ = ("stamp", "run", "time", "error", "clearance")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    RUN_FIELD_NUMBER: _ClassVar[int]
    TIME_FIELD_NUMBER: _ClassVar[int]
    ERROR_FIELD_NUMBER: _ClassVar[int]
    CLEARANCE_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    run: str
    time: _containers.RepeatedScalarFieldContainer[float]
    error: _containers.RepeatedScalarFieldContainer[float]
    clearance: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, stamp: _Optional[int] = ..., run: _Optional[str] = ..., time: _Optional[_Iterable[float]] = ..., error: _Optional[_Iterable[float]] = ..., clearance: _Optional[_Iterable[float]] = ...) -> None: ...

class RunMark(_message.Message):
    __slots__ = ("time", "text")
    TIME_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    time: float
    text: str
    def __init__(self, time: _Optional[float] = ..., text: _Optional[str] = ...) -> None: ...

class RunMotion(_message.Message):
    __slots__ = ("stamp", "run", "node_count", "time", "nodes", "goal", "marks")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    RUN_FIELD_NUMBER: _ClassVar[int]
    NODE_COUNT_FIELD_NUMBER: _ClassVar[int]
    TIME_FIELD_NUMBER: _ClassVar[int]
    NODES_FIELD_NUMBER: _ClassVar[int]
    GOAL_FIELD_NUMBER: _ClassVar[int]
    MARKS_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    run: str
    node_count: int
    time: _containers.RepeatedScalarFieldContainer[float]
    nodes: _containers.RepeatedScalarFieldContainer[float]
    goal: _containers.RepeatedScalarFieldContainer[float]
    marks: _containers.RepeatedCompositeFieldContainer[RunMark]
    def __init__(self, stamp: _Optional[int] = ..., run: _Optional[str] = ..., node_count: _Optional[int] = ..., time: _Optional[_Iterable[float]] = ..., nodes: _Optional[_Iterable[float]] = ..., goal: _Optional[_Iterable[float]] = ..., marks: _Optional[_Iterable[_Union[RunMark, _Mapping]]] = ...) -> None: ...

class RunPicture(_message.Message):
    __slots__ = ("stamp", "run", "time", "data")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    RUN_FIELD_NUMBER: _ClassVar[int]
    TIME_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    run: str
    time: float
    data: bytes
    def __init__(self, stamp: _Optional[int] = ..., run: _Optional[str] = ..., time: _Optional[float] = ..., data: _Optional[bytes] = ...) -> None: ...

class RunVideo(_message.Message):
    __slots__ = ("stamp", "run", "progress", "failure", "data")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    RUN_FIELD_NUMBER: _ClassVar[int]
    PROGRESS_FIELD_NUMBER: _ClassVar[int]
    FAILURE_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    run: str
    progress: float
    failure: str
    data: bytes
    def __init__(self, stamp: _Optional[int] = ..., run: _Optional[str] = ..., progress: _Optional[float] = ..., failure: _Optional[str] = ..., data: _Optional[bytes] = ...) -> None: ...

class RunFile(_message.Message):
    __slots__ = ("summary", "curves")
    SUMMARY_FIELD_NUMBER: _ClassVar[int]
    CURVES_FIELD_NUMBER: _ClassVar[int]
    summary: RunSummary
    curves: RunCurves
    def __init__(self, summary: _Optional[_Union[RunSummary, _Mapping]] = ..., curves: _Optional[_Union[RunCurves, _Mapping]] = ...) -> None: ...
