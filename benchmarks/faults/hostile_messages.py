"""Hostile messages and files as strategies of hypothesis."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import cache, partial

from google.protobuf import message_factory
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st

from lariat.scenario import load
from lariat.trajectory import SECOND
from shared.bus.message_check import RawMessage
from shared.topics import Topic
from shared.version import MESSAGE_VERSION
from stack import services
from stack.simulation.simulated_time import START, Delivery, SimulatedStack

DRAWING = partial(
    settings,
    # A process keeps a state: an example that is made smaller meets another one.
    phases=[Phase.generate],
    database=None,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
"""Settings of hypothesis with which messages are drawn."""
Messages = Sequence[tuple[Topic, RawMessage]]
"""Hostile messages with their topics."""

LAWFUL_TIME = SECOND
"""Simulated time of the ordinary run whose messages are changed [ns]."""
MAX_LAWFUL_SIZE = 2**14
"""Largest message of it that is changed [bytes]: whole images would be all of a flood."""
MAX_MESSAGES = 16
"""Most messages of a draw."""
PLACEHOLDERS = ("overhead", "sim", "controller", "x")
"""Names that fill the placeholder of a topic."""
PUBLISHERS = ("stranger", "controller-0", "sim-0", "")
"""Names in which messages are sent; no process of a stack has one of them."""
LENGTHS = (0, 1, 2, 3, 4, 6, 7, 9, 12, 30, 90, 120, 300, 6003)
"""Lengths of repeated fields."""
WORDS = (b"nan", b"inf", b"-1", b"1e308", b"9" * 400, b"[]", b"{}", b'""', b"true", b"'")
"""Texts that replace a value."""
DEEP_SETTING = "rope" + ".a" * 1800 + "=1"
"""Setting whose key has more parts than a recursion takes."""
TEXTS = (
    "left",
    "right",
    "table",
    "../../etc/passwd",
    "x" * 240,
    "x" * 5000,
    "\x1b[2J",
    DEEP_SETTING,
    "seed=" + "[" * 3000,
)
"""Texts of messages."""
INTEGERS = {
    FieldDescriptor.CPPTYPE_INT32: (-(2**31), 2**31 - 1),
    FieldDescriptor.CPPTYPE_ENUM: (-(2**31), 2**31 - 1),
    FieldDescriptor.CPPTYPE_UINT32: (0, 2**32 - 1),
    FieldDescriptor.CPPTYPE_INT64: (-(2**63), 2**63 - 1),
    FieldDescriptor.CPPTYPE_UINT64: (0, 2**64 - 1),
}
"""Smallest and largest value of the kinds of integer fields."""


def spoiled(valid: bytes) -> st.SearchStrategy[bytes]:
    """Valid bytes with one to three parts cut out, put in or written over."""
    values = [k + 1 for k, byte in enumerate(valid) if byte in b"=,"]
    places = st.integers(0, len(valid)) | st.sampled_from(values or [0])
    numbers = st.floats().map(partial(struct.pack, "<d"))
    parts = st.binary(max_size=64) | st.sampled_from(WORDS) | numbers
    edits = st.tuples(places, st.integers(0, 64), parts, st.booleans())
    return st.lists(edits, min_size=1, max_size=3).map(partial(_edited, valid))


def _edited(valid: bytes, edits: Sequence[tuple[int, int, bytes, bool]]) -> bytes:
    content = bytearray(valid)
    for at, cut, part, over in edits:
        content[at : at + (len(part) if over else cut)] = part
    return bytes(content)


@cache
def messages(kind: type[Message], fields: int | None = None) -> st.SearchStrategy[Message]:
    """Messages with values that are extreme, no numbers, or of a wrong length.

    `fields` is the number of fields that are set; None: any number.
    """
    values = {f.name: _values(f) for f in kind.DESCRIPTOR.fields if not _is_map(f)}
    if fields is None or fields >= len(values):
        return st.fixed_dictionaries({}, optional=values).map(lambda given: kind(**given))
    names = st.sampled_from(sorted(values)) if values else st.nothing()
    return names.flatmap(lambda name: values[name].map(lambda value: kind(**{name: value})))


def _is_map(field: FieldDescriptor) -> bool:
    return field.message_type is not None and field.message_type.GetOptions().map_entry


def _values(field: FieldDescriptor) -> st.SearchStrategy[object]:
    match field.cpp_type:
        case FieldDescriptor.CPPTYPE_MESSAGE:
            kind = message_factory.GetMessageClass(field.message_type)
            value = st.deferred(lambda: messages(kind))
        case FieldDescriptor.CPPTYPE_DOUBLE:
            value = st.floats() | st.floats(-1.0, 1.0)
        case FieldDescriptor.CPPTYPE_FLOAT:
            value = st.floats(width=32)
        case FieldDescriptor.CPPTYPE_BOOL:
            value = st.booleans()
        case FieldDescriptor.CPPTYPE_STRING if field.type == FieldDescriptor.TYPE_BYTES:
            value = st.binary(max_size=200)
        case FieldDescriptor.CPPTYPE_STRING:
            value = st.text(max_size=40) | st.sampled_from(TEXTS)
        case kind:
            value = st.integers(*INTEGERS[kind]) | st.integers(0, 8)
    if not field.is_repeated:
        return value
    if field.message_type is not None:
        return st.lists(value, max_size=4)
    same = st.builds(lambda one, count: [one] * count, value, st.sampled_from(LENGTHS))
    return st.lists(value, max_size=8) | same


@cache
def ordinary_run(scenario: str) -> list[Delivery]:
    """Return the messages of an ordinary run in simulated time."""
    deliveries: list[Delivery] = []
    members = [services.build(name, load(scenario), f"{name}-0") for name in services.NAMES]
    stack = SimulatedStack(members, [deliveries.append])
    stack.warm_up()
    stack.advance_to(START + LAWFUL_TIME)
    return deliveries


def hostile(topics: Sequence[Topic], scenario: str) -> st.SearchStrategy[Messages]:
    """Messages as they cross the bus: random, spoiled, with other values, valid, mislabelled."""
    lawful: dict[str, list[bytes]] = {}
    for delivery in ordinary_run(scenario):
        if len(delivery.payload) <= MAX_LAWFUL_SIZE:
            lawful.setdefault(delivery.key, []).append(delivery.payload)

    def of_topic(topic: Topic) -> st.SearchStrategy[tuple[Topic, RawMessage]]:
        if "{" in topic.key:
            return st.sampled_from(PLACEHOLDERS).map(topic.at).flatmap(of_topic)
        kind = topic.type.DESCRIPTOR.full_name
        return st.builds(
            RawMessage,
            key=st.just(topic.key),
            type=st.sampled_from([kind] * 20 + ["", "lariat.Nothing"]),
            payload=_payloads(topic.type, tuple(lawful.get(topic.key, ()))),
            publisher=st.sampled_from(PUBLISHERS),
            sequence=st.sampled_from((0, 1, 10**17, 10**18 - 1)) | st.integers(0, 1000),
            received=st.just(START),
            version=st.sampled_from([MESSAGE_VERSION] * 20 + [0, 99, 10**17]),
            published=st.just(0),
        ).map(lambda raw: (topic, raw))

    drawn = st.sampled_from(topics).flatmap(of_topic)
    return st.lists(drawn, min_size=1, max_size=MAX_MESSAGES)


@cache
def _payloads(kind: type[Message], lawful: tuple[bytes, ...]) -> st.SearchStrategy[bytes]:
    anything = messages(kind).map(lambda message: message.SerializeToString())
    if not lawful:
        return st.binary(max_size=1000) | anything
    valid = st.sampled_from(lawful)
    changed = st.builds(partial(_changed, kind), valid, messages(kind, 1))
    return st.binary(max_size=1000) | anything | valid | valid.flatmap(spoiled) | changed


def _changed(kind: type[Message], valid: bytes, change: Message) -> bytes:
    """Payload with the fields of another message in place of its own."""
    message = kind.FromString(valid)
    for field, _ in change.ListFields():
        message.ClearField(field.name)
    message.MergeFrom(change)
    return message.SerializeToString()
