"""Thinning of an idle cell's messages: what persons ask for is kept, states once a second."""

from __future__ import annotations

from lariat.trajectory import SECOND
from shared import topics
from shared.bus import RawMessage

IDLE_PERIOD = SECOND
"""Time between two recorded messages of a topic and publisher while the cell is idle [ns]."""
REPEAT_PERIOD = 60 * SECOND
"""Time after which a message that has not changed is recorded again [ns]."""
MAX_STREAMS = 1024
"""Most pairs of topic and publisher whose times are remembered."""
_DRAWINGS = (topics.VIEW_SCENE, topics.VIEW_POINTS, topics.VIEW_TRANSFORMS, topics.VIEW_JOINTS)
_EVENTS = frozenset(
    topic.key
    for topic in topics.TOPICS
    if topic.buffering == "every" and topic not in (topics.ARM_STATE, topics.ARM_SETPOINTS)
)
"""Keys of the topics of requests, commands and logs."""


class Thinning:
    """Choice of the messages of an idle cell that are recorded."""

    def __init__(self) -> None:
        self._recorded: dict[tuple[str, str], tuple[int, int]] = {}

    def keeps(self, message: RawMessage) -> bool:
        """Return whether a message is recorded; call it once for each, in order of arrival."""
        topic = message.topic
        # A trace is of no use without the inputs that it names.
        if topic.large or topics.TRACE.matches(topic.key):
            return False
        if topic.key in _EVENTS or topics.LOG.matches(topic.key):
            return True
        stream = topic.key, message.publisher
        time, content = self._recorded.pop(stream, (-REPEAT_PERIOD, 0))
        age, same = message.received - time, hash(message.payload) == content
        # A drawing says nothing new, but its stamps are.
        drawing = any(t.matches(topic.key) for t in _DRAWINGS)
        keep = age >= (REPEAT_PERIOD if same or drawing else IDLE_PERIOD)
        self._recorded[stream] = (
            (message.received, hash(message.payload)) if keep else (time, content)
        )
        if len(self._recorded) > MAX_STREAMS:
            del self._recorded[next(iter(self._recorded))]
        return keep
