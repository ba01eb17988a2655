from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class NodeChain(_message.Message):
    __slots__ = ("stamp", "positions", "sigma", "observed", "lost", "p_wrong", "tension")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    POSITIONS_FIELD_NUMBER: _ClassVar[int]
    SIGMA_FIELD_NUMBER: _ClassVar[int]
    OBSERVED_FIELD_NUMBER: _ClassVar[int]
    LOST_FIELD_NUMBER: _ClassVar[int]
    P_WRONG_FIELD_NUMBER: _ClassVar[int]
    TENSION_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    positions: _containers.RepeatedScalarFieldContainer[float]
    sigma: _containers.RepeatedScalarFieldContainer[float]
    observed: _containers.RepeatedScalarFieldContainer[bool]
    lost: str
    p_wrong: float
    tension: float
    def __init__(self, stamp: _Optional[int] = ..., positions: _Optional[_Iterable[float]] = ..., sigma: _Optional[_Iterable[float]] = ..., observed: _Optional[_Iterable[bool]] = ..., lost: _Optional[str] = ..., p_wrong: _Optional[float] = ..., tension: _Optional[float] = ...) -> None: ...

class RopeLine(_message.Message):
    __slots__ = ("positions", "seen")
    POSITIONS_FIELD_NUMBER: _ClassVar[int]
    SEEN_FIELD_NUMBER: _ClassVar[int]
    positions: _containers.RepeatedScalarFieldContainer[float]
    seen: bool
    def __init__(self, positions: _Optional[_Iterable[float]] = ..., seen: _Optional[bool] = ...) -> None: ...

class OtherRope(_message.Message):
    __slots__ = ("id", "lines", "diameter", "p_wrong")
    ID_FIELD_NUMBER: _ClassVar[int]
    LINES_FIELD_NUMBER: _ClassVar[int]
    DIAMETER_FIELD_NUMBER: _ClassVar[int]
    P_WRONG_FIELD_NUMBER: _ClassVar[int]
    id: int
    lines: _containers.RepeatedCompositeFieldContainer[RopeLine]
    diameter: float
    p_wrong: float
    def __init__(self, id: _Optional[int] = ..., lines: _Optional[_Iterable[_Union[RopeLine, _Mapping]]] = ..., diameter: _Optional[float] = ..., p_wrong: _Optional[float] = ...) -> None: ...

class OtherRopes(_message.Message):
    __slots__ = ("stamp", "revision", "ropes")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    REVISION_FIELD_NUMBER: _ClassVar[int]
    ROPES_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    revision: int
    ropes: _containers.RepeatedCompositeFieldContainer[OtherRope]
    def __init__(self, stamp: _Optional[int] = ..., revision: _Optional[int] = ..., ropes: _Optional[_Iterable[_Union[OtherRope, _Mapping]]] = ...) -> None: ...
