"""Access control of the bus: each user publishes its own topics and nothing else.

The rules follow from the owners in `shared.topics`. Every user may read every topic. The router
enforces them by the common name of a certificate; what no rule allows is denied.
"""

from __future__ import annotations

from typing import Any

from shared import topics
from shared.bus import key_expression
from shared.topics import Topic

ROUTER = "router"
"""User that routes; it publishes nothing itself."""
OPERATOR = "lariat"
"""User of the command line, and of the launcher."""
SERVICES = (
    "sim",
    "camera",
    "perception",
    "planner",
    "controller",
    "robot_gateway",
    "recorder",
    "ros2",
    "dashboard",
)
"""Users that are processes of a cell."""
USERS = (*SERVICES, OPERATOR)
"""Users that a router admits."""
EVERY_SERVICE = "every service"
"""Owner of the topics of which each service publishes its own key."""

_SUBSCRIBING = ("declare_subscriber", "liveliness_query", "declare_liveliness_subscriber")
"""Messages with which a user asks for publications."""
_RECEIVING = ("put", "declare_subscriber", "liveliness_token", "reply")
"""Messages that a router passes on to a user."""


def published_keys(user: str) -> list[str]:
    """Return the key expressions of the topics that a user publishes."""
    keys = []
    for topic in topics.TOPICS:
        if topic.owner == EVERY_SERVICE:
            if user in SERVICES:
                keys.append(topic.at(user).key)
        elif user in owners(topic):
            keys.append(key_expression(topic.key))
    return keys


def owners(topic: Topic) -> tuple[str, ...]:
    """Return the users that publish a topic."""
    return SERVICES if topic.owner == EVERY_SERVICE else tuple(topic.owner.split(", "))


def access_control(namespace: str) -> dict[str, Any]:
    """Return Zenoh's setting `access_control` for the router of a cell."""
    everything = [f"{namespace}/**"]
    rules = [
        _rule("subscribe", "ingress", _SUBSCRIBING, everything),
        _rule("receive", "egress", _RECEIVING, everything),
    ]
    policies = []
    for user in USERS:
        names = ["subscribe", "receive"]
        keys = [f"{namespace}/{key}" for key in published_keys(user)]
        rules.append(_rule(f"publish-{user}", "ingress", ("put",), keys))
        names.append(f"publish-{user}")
        if user in SERVICES:
            alive = [f"{namespace}/alive/{user}"]
            rules.append(_rule(f"alive-{user}", "ingress", ("liveliness_token",), alive))
            names.append(f"alive-{user}")
        policies.append({"subjects": [user], "rules": names})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": user, "cert_common_names": [user]} for user in USERS],
        "policies": policies,
    }


def _rule(name: str, flow: str, messages: tuple[str, ...], keys: list[str]) -> dict[str, Any]:
    return {
        "id": name,
        "permission": "allow",
        "flows": [flow],
        "messages": list(messages),
        "key_exprs": keys,
    }
