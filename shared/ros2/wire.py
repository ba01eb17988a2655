"""Keys, tokens, identifiers and attachments of rmw_zenoh, byte for byte."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import xxhash

from shared.ros2.types import dds_name, type_hash

Kind = Literal["MP", "MS", "SS", "SC"]
"""Kind of an entity: publisher, subscription, service server, service client."""
_ATTACHMENT = struct.Struct("<qqB16s")
_GID_SIZE = 16


@dataclass(frozen=True)
class Qos:
    """Quality of service of a topic."""

    reliable: bool = True
    """Whether samples that were lost are sent again."""
    latched: bool = False
    """Whether those who come later get the last samples (transient local)."""
    depth: int = 10
    """Number of samples that are kept."""

    def encoded(self) -> str:
        """Return it as the last part of a token; fields that equal the defaults are empty."""
        reliability = "" if self.reliable else "2"
        durability = "1" if self.latched else ""
        return f"{reliability}:{durability}:,{self.depth}:,:,:,,"


LATCHED = Qos(latched=True, depth=1)
"""Quality of topics whose last message is for those who come later."""
SENSOR = Qos(reliable=False, depth=5)
"""Quality of images, of which only the newest count."""
SERVICE = Qos()
"""Quality of services."""


@dataclass(frozen=True)
class NodeEntity:
    """Node of the graph."""

    domain: int
    """ROS_DOMAIN_ID."""
    session: str
    """Id of the Zenoh session."""
    id: int
    """Number among the entities of the session."""
    namespace: str
    """Namespace, `/cell`; empty for none."""
    name: str
    """Name."""

    @property
    def token(self) -> str:
        """Liveliness token."""
        return f"{self.root(self.id)}/NN/{self.place}"

    def root(self, entity: int) -> str:
        """Return the first parts of the tokens of an entity of this node."""
        return f"@ros2_lv/{self.domain}/{self.session}/{self.id}/{entity}"

    @property
    def place(self) -> str:
        """Enclave, namespace and name, as tokens have them."""
        return f"%/{mangled(self.namespace) or '%'}/{self.name}"

    def resolved(self, topic: str) -> str:
        """Return the whole name of a topic; one without leading slash lies in the namespace."""
        return topic if topic.startswith("/") else f"{self.namespace}/{topic}"


@dataclass(frozen=True)
class Entity:
    """Publisher, subscription, service server or service client of a node."""

    node: NodeEntity
    id: int
    """Number among the entities of the session."""
    kind: Kind
    topic: str
    """Whole name of the topic or service, `/joint_states`."""
    type: str
    """Its type, `sensor_msgs/msg/JointState`."""
    qos: Qos = SERVICE

    @cached_property
    def key(self) -> str:
        """Key of its data."""
        name = self.topic.strip("/")
        return f"{self.node.domain}/{name}/{dds_name(self.type)}/{type_hash(self.type)}"

    @cached_property
    def token(self) -> str:
        """Liveliness token."""
        parts = (
            self.node.root(self.id),
            self.kind,
            self.node.place,
            mangled(self.topic),
            dds_name(self.type),
            type_hash(self.type),
            self.qos.encoded(),
        )
        return "/".join(parts)

    @cached_property
    def gid(self) -> bytes:
        """Identifier: the XXH3-128 of its token, low 64 bits first."""
        return xxhash.xxh3_128(self.token.encode()).intdigest().to_bytes(_GID_SIZE, "little")


def mangled(name: str) -> str:
    """Return a name as a token has it."""
    return name.replace("/", "%")


class Attachment(NamedTuple):
    """What every sample, request and reply carries beside its payload."""

    sequence: int
    """Number of the sample, from 1."""
    time: int
    """Time of its sending [ns]."""
    gid: bytes
    """Identifier of the publisher, or of the client that asks."""

    def encoded(self) -> bytes:
        """Return its bytes."""
        return _ATTACHMENT.pack(self.sequence, self.time, _GID_SIZE, self.gid)

    @classmethod
    def decoded(cls, content: bytes) -> Attachment:
        """Return the attachment of its bytes."""
        if len(content) != _ATTACHMENT.size or content[16] != _GID_SIZE:
            raise ValueError(f"an attachment of {len(content)} bytes is none of rmw_zenoh")
        sequence, time, _, gid = _ATTACHMENT.unpack(content)
        return cls(sequence, time, gid)
