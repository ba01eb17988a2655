from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable
from typing import ClassVar as _ClassVar, Optional as _Optional

DESCRIPTOR: _descriptor.FileDescriptor

class NodeChain(_message.Message):
    __slots__ = ("stamp", "positions", "sigma", "observed", "lost")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    POSITIONS_FIELD_NUMBER: _ClassVar[int]
    SIGMA_FIELD_NUMBER: _ClassVar[int]
    OBSERVED_FIELD_NUMBER: _ClassVar[int]
    LOST_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    positions: _containers.RepeatedScalarFieldContainer[float]
    sigma: _containers.RepeatedScalarFieldContainer[float]
    observed: _containers.RepeatedScalarFieldContainer[bool]
    lost: str
    def __init__(self, stamp: _Optional[int] = ..., positions: _Optional[_Iterable[float]] = ..., sigma: _Optional[_Iterable[float]] = ..., observed: _Optional[_Iterable[bool]] = ..., lost: _Optional[str] = ...) -> None: ...
