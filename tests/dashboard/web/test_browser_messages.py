from __future__ import annotations

import dataclasses

import msgspec
import pytest
import viser._messages
from hypothesis import given, settings
from hypothesis import strategies as st

from dashboard.web import browser_messages
from dashboard.web.browser_messages import decode

encode = msgspec.msgpack.encode

CLICK = {"type": "GuiUpdateMessage", "uuid": "a", "updates": {"value": True}}
DRAG = {
    "type": "TransformControlsUpdateMessage",
    "name": "/edit/left",
    "wxyz": [1.0, 0.0, 0.0, 0.0],
    "position": [0.1, 0, 0.3],
}


@pytest.mark.parametrize("message", [CLICK, DRAG])
def test_messages_of_the_page_pass(message: dict) -> None:
    assert type(decode(encode(message))).__name__ == message["type"]


@pytest.mark.parametrize(
    "message",
    [
        {"type": "ShareUrlRequest"},
        {"type": "GuiFormDirtyMessage", "uuid": "a"},
        {"type": "GetRenderResponseMessage", "payload": b""},
        CLICK | {"updates": {"update_cb": []}},
        CLICK | {"updates": {"value": True, "removed": True}},
        CLICK | {"updates": {"value": float("nan")}},
        CLICK | {"updates": {"value": [0.0] * 5}},
        CLICK | {"updates": {"value": "x" * 1000}},
        CLICK | {"more": 1},
        DRAG | {"position": [0.0, float("inf"), 0.0]},
        DRAG | {"position": [0.0, 0.0]},
        DRAG | {"position": "xyz"},
        DRAG | {"wxyz": [1.0, 0.0, 0.0, float("nan")]},
        [],
        None,
    ],
)
def test_what_the_page_does_not_send_is_refused(message: object) -> None:
    with pytest.raises(ValueError, match=r"\S"):
        decode(encode(message))


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=200))
def test_random_bytes_are_refused_without_another_error(message: bytes) -> None:
    with pytest.raises(ValueError, match=r"\S"):
        decode(message)


def test_fields_are_those_of_viser() -> None:
    kinds = msgspec.inspect.type_info(browser_messages._decoder.type)
    assert isinstance(kinds, msgspec.inspect.UnionType)
    structs = [t.cls for t in kinds.types if isinstance(t, msgspec.inspect.StructType)]
    assert len(structs) == 8
    for struct in structs:
        fields = {f.name for f in dataclasses.fields(getattr(viser._messages, struct.__name__))}
        known = set(struct.__struct_fields__)
        assert known <= fields
        assert fields - known <= {"excluded_self_client", "owner", "virtual"}
