"""Messages that the page's browser side may send to viser: their types and bounds.

viser acts on more than the page uses: a message may ask it to publish the page through a public
tunnel, set any attribute of an element, or be stored and sent to every browser. Only the types
below, with exactly these fields within these bounds, pass the web server.
"""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

MAX_PART = 1 << 20
"""Largest part of an uploaded file [bytes]."""
MAX_MESSAGE = MAX_PART + (1 << 16)
"""Largest message [bytes]."""

Name = Annotated[str, Meta(max_length=200)]
"""Identifier or text of an element."""
Number = Annotated[float, Meta(ge=-1e9, le=1e9)]
"""Finite number; NaN fulfils no bound."""
Vector = tuple[Number, Number, Number]
Quaternion = tuple[Number, Number, Number, Number]
Pixels = Annotated[int, Meta(ge=0, le=1 << 15)]
"""Size of an image [pixels]."""


class _Message(
    msgspec.Struct, tag_field="type", tag=str, frozen=True, forbid_unknown_fields=True, gc=False
):
    """Message whose field `type` is the name of its class, as in viser."""


class ViewerCameraMessage(_Message, frozen=True):
    """Pose and lens of the browser's camera."""

    wxyz: Quaternion
    position: Vector
    fov: Number
    near: Number
    far: Number
    image_height: Pixels
    image_width: Pixels
    look_at: Vector
    up_direction: Vector


class Value(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """New value of an element; its other properties belong to the server."""

    value: bool | Number | Name | Annotated[list[bool | Number | Name], Meta(max_length=4)] | None


class GuiUpdateMessage(_Message, frozen=True):
    """Click on a button, or change of another element."""

    uuid: Name
    updates: Value


class TransformControlsUpdateMessage(_Message, frozen=True):
    """Pose of a gizmo that is being dragged."""

    name: Name
    wxyz: Quaternion
    position: Vector
    owner: Name = ""


class TransformControlsDragStartMessage(_Message, frozen=True):
    """Begin of a drag."""

    name: Name
    owner: Name = ""


class TransformControlsDragEndMessage(_Message, frozen=True):
    """End of a drag."""

    name: Name
    owner: Name = ""


class SceneNodeClickMessage(_Message, frozen=True):
    """Click on an obstacle."""

    name: Name
    instance_index: int | None
    ray_origin: Vector
    ray_direction: Vector
    screen_pos: tuple[Number, Number]
    modifier: Name | None
    owner: Name = ""


class FileTransferStartUpload(_Message, frozen=True):
    """Announcement of a file."""

    source_component_uuid: Name
    transfer_uuid: Name
    filename: Name
    mime_type: Name
    part_count: Annotated[int, Meta(ge=0, le=8)]
    size_bytes: Annotated[int, Meta(ge=0, le=8 * MAX_PART)]


class FileTransferPart(_Message, frozen=True):
    """Part of a file."""

    source_component_uuid: Name
    transfer_uuid: Name
    part_index: Annotated[int, Meta(ge=0, lt=8)]
    content: Annotated[bytes, Meta(max_length=MAX_PART)]


_decoder = msgspec.msgpack.Decoder(
    ViewerCameraMessage
    | GuiUpdateMessage
    | TransformControlsUpdateMessage
    | TransformControlsDragStartMessage
    | TransformControlsDragEndMessage
    | SceneNodeClickMessage
    | FileTransferStartUpload
    | FileTransferPart
)


def decode(message: bytes) -> msgspec.Struct:
    """Decode a message of a browser."""
    try:
        return _decoder.decode(message)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(str(error)) from None
