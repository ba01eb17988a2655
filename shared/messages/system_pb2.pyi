from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Health(_message.Message):
    __slots__ = ("service", "stamp", "boot", "process", "version", "period_ms", "step_p50_ms", "step_p99_ms", "step_max_ms", "steps", "overruns", "drops", "input_age_ms", "note", "longest_step_ms", "refused")
    class InputAgeMsEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: float
        def __init__(self, key: _Optional[str] = ..., value: _Optional[float] = ...) -> None: ...
    SERVICE_FIELD_NUMBER: _ClassVar[int]
    STAMP_FIELD_NUMBER: _ClassVar[int]
    BOOT_FIELD_NUMBER: _ClassVar[int]
    PROCESS_FIELD_NUMBER: _ClassVar[int]
    VERSION_FIELD_NUMBER: _ClassVar[int]
    PERIOD_MS_FIELD_NUMBER: _ClassVar[int]
    STEP_P50_MS_FIELD_NUMBER: _ClassVar[int]
    STEP_P99_MS_FIELD_NUMBER: _ClassVar[int]
    STEP_MAX_MS_FIELD_NUMBER: _ClassVar[int]
    STEPS_FIELD_NUMBER: _ClassVar[int]
    OVERRUNS_FIELD_NUMBER: _ClassVar[int]
    DROPS_FIELD_NUMBER: _ClassVar[int]
    INPUT_AGE_MS_FIELD_NUMBER: _ClassVar[int]
    NOTE_FIELD_NUMBER: _ClassVar[int]
    LONGEST_STEP_MS_FIELD_NUMBER: _ClassVar[int]
    REFUSED_FIELD_NUMBER: _ClassVar[int]
    service: str
    stamp: int
    boot: str
    process: int
    version: str
    period_ms: float
    step_p50_ms: float
    step_p99_ms: float
    step_max_ms: float
    steps: int
    overruns: int
    drops: int
    input_age_ms: _containers.ScalarMap[str, float]
    note: str
    longest_step_ms: float
    refused: int
    def __init__(self, service: _Optional[str] = ..., stamp: _Optional[int] = ..., boot: _Optional[str] = ..., process: _Optional[int] = ..., version: _Optional[str] = ..., period_ms: _Optional[float] = ..., step_p50_ms: _Optional[float] = ..., step_p99_ms: _Optional[float] = ..., step_max_ms: _Optional[float] = ..., steps: _Optional[int] = ..., overruns: _Optional[int] = ..., drops: _Optional[int] = ..., input_age_ms: _Optional[_Mapping[str, float]] = ..., note: _Optional[str] = ..., longest_step_ms: _Optional[float] = ..., refused: _Optional[int] = ...) -> None: ...

class TraceInput(_message.Message):
    __slots__ = ("topic", "publisher", "sequence", "received")
    TOPIC_FIELD_NUMBER: _ClassVar[int]
    PUBLISHER_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    RECEIVED_FIELD_NUMBER: _ClassVar[int]
    topic: str
    publisher: str
    sequence: int
    received: int
    def __init__(self, topic: _Optional[str] = ..., publisher: _Optional[str] = ..., sequence: _Optional[int] = ..., received: _Optional[int] = ...) -> None: ...

class Trace(_message.Message):
    __slots__ = ("service", "step", "now", "inputs")
    SERVICE_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    NOW_FIELD_NUMBER: _ClassVar[int]
    INPUTS_FIELD_NUMBER: _ClassVar[int]
    service: str
    step: int
    now: int
    inputs: _containers.RepeatedCompositeFieldContainer[TraceInput]
    def __init__(self, service: _Optional[str] = ..., step: _Optional[int] = ..., now: _Optional[int] = ..., inputs: _Optional[_Iterable[_Union[TraceInput, _Mapping]]] = ...) -> None: ...

class RecordState(_message.Message):
    __slots__ = ("stamp", "recording", "file", "bytes", "messages", "drops", "run", "recordings_size", "free_space")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    RECORDING_FIELD_NUMBER: _ClassVar[int]
    FILE_FIELD_NUMBER: _ClassVar[int]
    BYTES_FIELD_NUMBER: _ClassVar[int]
    MESSAGES_FIELD_NUMBER: _ClassVar[int]
    DROPS_FIELD_NUMBER: _ClassVar[int]
    RUN_FIELD_NUMBER: _ClassVar[int]
    RECORDINGS_SIZE_FIELD_NUMBER: _ClassVar[int]
    FREE_SPACE_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    recording: bool
    file: str
    bytes: int
    messages: int
    drops: int
    run: str
    recordings_size: int
    free_space: int
    def __init__(self, stamp: _Optional[int] = ..., recording: _Optional[bool] = ..., file: _Optional[str] = ..., bytes: _Optional[int] = ..., messages: _Optional[int] = ..., drops: _Optional[int] = ..., run: _Optional[str] = ..., recordings_size: _Optional[int] = ..., free_space: _Optional[int] = ...) -> None: ...

class ProcessState(_message.Message):
    __slots__ = ("service", "state", "restarts", "exit_code")
    SERVICE_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    RESTARTS_FIELD_NUMBER: _ClassVar[int]
    EXIT_CODE_FIELD_NUMBER: _ClassVar[int]
    service: str
    state: str
    restarts: int
    exit_code: int
    def __init__(self, service: _Optional[str] = ..., state: _Optional[str] = ..., restarts: _Optional[int] = ..., exit_code: _Optional[int] = ...) -> None: ...

class ScenarioEntry(_message.Message):
    __slots__ = ("name", "description", "own", "real_arms")
    NAME_FIELD_NUMBER: _ClassVar[int]
    DESCRIPTION_FIELD_NUMBER: _ClassVar[int]
    OWN_FIELD_NUMBER: _ClassVar[int]
    REAL_ARMS_FIELD_NUMBER: _ClassVar[int]
    name: str
    description: str
    own: bool
    real_arms: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, name: _Optional[str] = ..., description: _Optional[str] = ..., own: _Optional[bool] = ..., real_arms: _Optional[_Iterable[str]] = ...) -> None: ...

class StackState(_message.Message):
    __slots__ = ("stamp", "processes", "scenario", "scenarios", "activity", "last_request", "refusal")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    PROCESSES_FIELD_NUMBER: _ClassVar[int]
    SCENARIO_FIELD_NUMBER: _ClassVar[int]
    SCENARIOS_FIELD_NUMBER: _ClassVar[int]
    ACTIVITY_FIELD_NUMBER: _ClassVar[int]
    LAST_REQUEST_FIELD_NUMBER: _ClassVar[int]
    REFUSAL_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    processes: _containers.RepeatedCompositeFieldContainer[ProcessState]
    scenario: str
    scenarios: _containers.RepeatedCompositeFieldContainer[ScenarioEntry]
    activity: str
    last_request: str
    refusal: str
    def __init__(self, stamp: _Optional[int] = ..., processes: _Optional[_Iterable[_Union[ProcessState, _Mapping]]] = ..., scenario: _Optional[str] = ..., scenarios: _Optional[_Iterable[_Union[ScenarioEntry, _Mapping]]] = ..., activity: _Optional[str] = ..., last_request: _Optional[str] = ..., refusal: _Optional[str] = ...) -> None: ...

class StackRequest(_message.Message):
    __slots__ = ("id", "stamp", "action", "scenario", "settings", "content", "name", "confirmed", "variations", "first_seed", "seed_count", "stop_when_reached", "record")
    class Action(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        UNSPECIFIED: _ClassVar[StackRequest.Action]
        START: _ClassVar[StackRequest.Action]
        SAVE: _ClassVar[StackRequest.Action]
        DELETE: _ClassVar[StackRequest.Action]
        RUN_CAMPAIGN: _ClassVar[StackRequest.Action]
        CANCEL_CAMPAIGN: _ClassVar[StackRequest.Action]
    UNSPECIFIED: StackRequest.Action
    START: StackRequest.Action
    SAVE: StackRequest.Action
    DELETE: StackRequest.Action
    RUN_CAMPAIGN: StackRequest.Action
    CANCEL_CAMPAIGN: StackRequest.Action
    ID_FIELD_NUMBER: _ClassVar[int]
    STAMP_FIELD_NUMBER: _ClassVar[int]
    ACTION_FIELD_NUMBER: _ClassVar[int]
    SCENARIO_FIELD_NUMBER: _ClassVar[int]
    SETTINGS_FIELD_NUMBER: _ClassVar[int]
    CONTENT_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    CONFIRMED_FIELD_NUMBER: _ClassVar[int]
    VARIATIONS_FIELD_NUMBER: _ClassVar[int]
    FIRST_SEED_FIELD_NUMBER: _ClassVar[int]
    SEED_COUNT_FIELD_NUMBER: _ClassVar[int]
    STOP_WHEN_REACHED_FIELD_NUMBER: _ClassVar[int]
    RECORD_FIELD_NUMBER: _ClassVar[int]
    id: str
    stamp: int
    action: StackRequest.Action
    scenario: str
    settings: _containers.RepeatedScalarFieldContainer[str]
    content: bytes
    name: str
    confirmed: _containers.RepeatedScalarFieldContainer[str]
    variations: _containers.RepeatedCompositeFieldContainer[Variation]
    first_seed: int
    seed_count: int
    stop_when_reached: bool
    record: bool
    def __init__(self, id: _Optional[str] = ..., stamp: _Optional[int] = ..., action: _Optional[_Union[StackRequest.Action, str]] = ..., scenario: _Optional[str] = ..., settings: _Optional[_Iterable[str]] = ..., content: _Optional[bytes] = ..., name: _Optional[str] = ..., confirmed: _Optional[_Iterable[str]] = ..., variations: _Optional[_Iterable[_Union[Variation, _Mapping]]] = ..., first_seed: _Optional[int] = ..., seed_count: _Optional[int] = ..., stop_when_reached: _Optional[bool] = ..., record: _Optional[bool] = ...) -> None: ...

class Variation(_message.Message):
    __slots__ = ("key", "values")
    KEY_FIELD_NUMBER: _ClassVar[int]
    VALUES_FIELD_NUMBER: _ClassVar[int]
    key: str
    values: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, key: _Optional[str] = ..., values: _Optional[_Iterable[str]] = ...) -> None: ...

class CampaignTrial(_message.Message):
    __slots__ = ("seed", "values", "state", "reached", "reached_after", "error", "max_node_error", "min_clearance", "contact_time", "replans", "wall", "reason")
    class State(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        WAITING: _ClassVar[CampaignTrial.State]
        RUNNING: _ClassVar[CampaignTrial.State]
        DONE: _ClassVar[CampaignTrial.State]
        BROKEN: _ClassVar[CampaignTrial.State]
        CANCELED: _ClassVar[CampaignTrial.State]
    WAITING: CampaignTrial.State
    RUNNING: CampaignTrial.State
    DONE: CampaignTrial.State
    BROKEN: CampaignTrial.State
    CANCELED: CampaignTrial.State
    SEED_FIELD_NUMBER: _ClassVar[int]
    VALUES_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    REACHED_FIELD_NUMBER: _ClassVar[int]
    REACHED_AFTER_FIELD_NUMBER: _ClassVar[int]
    ERROR_FIELD_NUMBER: _ClassVar[int]
    MAX_NODE_ERROR_FIELD_NUMBER: _ClassVar[int]
    MIN_CLEARANCE_FIELD_NUMBER: _ClassVar[int]
    CONTACT_TIME_FIELD_NUMBER: _ClassVar[int]
    REPLANS_FIELD_NUMBER: _ClassVar[int]
    WALL_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    seed: int
    values: _containers.RepeatedScalarFieldContainer[str]
    state: CampaignTrial.State
    reached: bool
    reached_after: float
    error: float
    max_node_error: float
    min_clearance: float
    contact_time: float
    replans: int
    wall: float
    reason: str
    def __init__(self, seed: _Optional[int] = ..., values: _Optional[_Iterable[str]] = ..., state: _Optional[_Union[CampaignTrial.State, str]] = ..., reached: _Optional[bool] = ..., reached_after: _Optional[float] = ..., error: _Optional[float] = ..., max_node_error: _Optional[float] = ..., min_clearance: _Optional[float] = ..., contact_time: _Optional[float] = ..., replans: _Optional[int] = ..., wall: _Optional[float] = ..., reason: _Optional[str] = ...) -> None: ...

class CampaignState(_message.Message):
    __slots__ = ("stamp", "name", "scenario", "setting_count", "keys", "trials", "running", "file")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    SCENARIO_FIELD_NUMBER: _ClassVar[int]
    SETTING_COUNT_FIELD_NUMBER: _ClassVar[int]
    KEYS_FIELD_NUMBER: _ClassVar[int]
    TRIALS_FIELD_NUMBER: _ClassVar[int]
    RUNNING_FIELD_NUMBER: _ClassVar[int]
    FILE_FIELD_NUMBER: _ClassVar[int]
    stamp: int
    name: str
    scenario: str
    setting_count: int
    keys: _containers.RepeatedScalarFieldContainer[str]
    trials: _containers.RepeatedCompositeFieldContainer[CampaignTrial]
    running: bool
    file: str
    def __init__(self, stamp: _Optional[int] = ..., name: _Optional[str] = ..., scenario: _Optional[str] = ..., setting_count: _Optional[int] = ..., keys: _Optional[_Iterable[str]] = ..., trials: _Optional[_Iterable[_Union[CampaignTrial, _Mapping]]] = ..., running: _Optional[bool] = ..., file: _Optional[str] = ...) -> None: ...
