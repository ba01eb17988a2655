from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class CommissioningStep(_message.Message):
    __slots__ = ("title", "outcome", "detail", "when")
    TITLE_FIELD_NUMBER: _ClassVar[int]
    OUTCOME_FIELD_NUMBER: _ClassVar[int]
    DETAIL_FIELD_NUMBER: _ClassVar[int]
    WHEN_FIELD_NUMBER: _ClassVar[int]
    title: str
    outcome: str
    detail: str
    when: str
    def __init__(self, title: _Optional[str] = ..., outcome: _Optional[str] = ..., detail: _Optional[str] = ..., when: _Optional[str] = ...) -> None: ...

class CommissioningState(_message.Message):
    __slots__ = ("stamp", "steps", "current", "line", "question", "question_id", "ended")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    STEPS_FIELD_NUMBER: _ClassVar[int]
    CURRENT_FIELD_NUMBER: _ClassVar[int]
    LINE_FIELD_NUMBER: _ClassVar[int]
    QUESTION_FIELD_NUMBER: _ClassVar[int]
    QUESTION_ID_FIELD_NUMBER: _ClassVar[int]
    ENDED_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    steps: _containers.RepeatedCompositeFieldContainer[CommissioningStep]
    current: int
    line: str
    question: str
    question_id: str
    ended: bool
    def __init__(self, stamp: _Optional[int] = ..., steps: _Optional[_Iterable[_Union[CommissioningStep, _Mapping]]] = ..., current: _Optional[int] = ..., line: _Optional[str] = ..., question: _Optional[str] = ..., question_id: _Optional[str] = ..., ended: _Optional[bool] = ...) -> None: ...

class CommissioningAnswer(_message.Message):
    __slots__ = ("id", "stamp", "question_id", "yes")
    ID_FIELD_NUMBER: _ClassVar[int]
    STAMP_FIELD_NUMBER: _ClassVar[int]
    QUESTION_ID_FIELD_NUMBER: _ClassVar[int]
    YES_FIELD_NUMBER: _ClassVar[int]
    id: str
    stamp: int
    question_id: str
    yes: bool
    def __init__(self, id: _Optional[str] = ..., stamp: _Optional[int] = ..., question_id: _Optional[str] = ..., yes: _Optional[bool] = ...) -> None: ...
