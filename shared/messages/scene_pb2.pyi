from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Obstacle(_message.Message):
    __slots__ = ("name", "shape", "position", "orientation", "radius", "height", "size", "normal", "support", "friction")
    NAME_FIELD_NUMBER: _ClassVar[int]
    SHAPE_FIELD_NUMBER: _ClassVar[int]
    POSITION_FIELD_NUMBER: _ClassVar[int]
    ORIENTATION_FIELD_NUMBER: _ClassVar[int]
    RADIUS_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_FIELD_NUMBER: _ClassVar[int]
    SIZE_FIELD_NUMBER: _ClassVar[int]
    NORMAL_FIELD_NUMBER: _ClassVar[int]
    SUPPORT_FIELD_NUMBER: _ClassVar[int]
    FRICTION_FIELD_NUMBER: _ClassVar[int]
    name: str
    shape: str
    position: _containers.RepeatedScalarFieldContainer[float]
    orientation: _containers.RepeatedScalarFieldContainer[float]
    radius: float
    height: float
    size: _containers.RepeatedScalarFieldContainer[float]
    normal: _containers.RepeatedScalarFieldContainer[float]
    support: bool
    friction: float
    def __init__(self, name: _Optional[str] = ..., shape: _Optional[str] = ..., position: _Optional[_Iterable[float]] = ..., orientation: _Optional[_Iterable[float]] = ..., radius: _Optional[float] = ..., height: _Optional[float] = ..., size: _Optional[_Iterable[float]] = ..., normal: _Optional[_Iterable[float]] = ..., support: _Optional[bool] = ..., friction: _Optional[float] = ...) -> None: ...

class Scene(_message.Message):
    __slots__ = ("stamp", "revision", "obstacles", "last_request", "refusal")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    REVISION_FIELD_NUMBER: _ClassVar[int]
    OBSTACLES_FIELD_NUMBER: _ClassVar[int]
    LAST_REQUEST_FIELD_NUMBER: _ClassVar[int]
    REFUSAL_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    revision: int
    obstacles: _containers.RepeatedCompositeFieldContainer[Obstacle]
    last_request: str
    refusal: str
    def __init__(self, stamp: _Optional[int] = ..., revision: _Optional[int] = ..., obstacles: _Optional[_Iterable[_Union[Obstacle, _Mapping]]] = ..., last_request: _Optional[str] = ..., refusal: _Optional[str] = ...) -> None: ...

class SceneRequest(_message.Message):
    __slots__ = ("id", "stamp", "action", "obstacle")
    class Action(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        ADD: _ClassVar[SceneRequest.Action]
        MOVE: _ClassVar[SceneRequest.Action]
        REMOVE: _ClassVar[SceneRequest.Action]
        RESIZE: _ClassVar[SceneRequest.Action]
    ADD: SceneRequest.Action
    MOVE: SceneRequest.Action
    REMOVE: SceneRequest.Action
    RESIZE: SceneRequest.Action
    ID_FIELD_NUMBER: _ClassVar[int]
    STAMP_FIELD_NUMBER: _ClassVar[int]
    ACTION_FIELD_NUMBER: _ClassVar[int]
    OBSTACLE_FIELD_NUMBER: _ClassVar[int]
    id: str
    stamp: int
    action: SceneRequest.Action
    obstacle: Obstacle
    def __init__(self, id: _Optional[str] = ..., stamp: _Optional[int] = ..., action: _Optional[_Union[SceneRequest.Action, str]] = ..., obstacle: _Optional[_Union[Obstacle, _Mapping]] = ...) -> None: ...

class ObstacleMotion(_message.Message):
    __slots__ = ("name", "position", "velocity", "times", "waypoints")
    NAME_FIELD_NUMBER: _ClassVar[int]
    POSITION_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_FIELD_NUMBER: _ClassVar[int]
    TIMES_FIELD_NUMBER: _ClassVar[int]
    WAYPOINTS_FIELD_NUMBER: _ClassVar[int]
    name: str
    position: _containers.RepeatedScalarFieldContainer[float]
    velocity: _containers.RepeatedScalarFieldContainer[float]
    times: _containers.RepeatedScalarFieldContainer[int]
    waypoints: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, name: _Optional[str] = ..., position: _Optional[_Iterable[float]] = ..., velocity: _Optional[_Iterable[float]] = ..., times: _Optional[_Iterable[int]] = ..., waypoints: _Optional[_Iterable[float]] = ...) -> None: ...

class SceneMotion(_message.Message):
    __slots__ = ("stamp", "run_started", "motions")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    RUN_STARTED_FIELD_NUMBER: _ClassVar[int]
    MOTIONS_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    run_started: int
    motions: _containers.RepeatedCompositeFieldContainer[ObstacleMotion]
    def __init__(self, stamp: _Optional[int] = ..., run_started: _Optional[int] = ..., motions: _Optional[_Iterable[_Union[ObstacleMotion, _Mapping]]] = ...) -> None: ...
