"""Named goals of the recorder: listed, and changed by requests."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from services.recorder.goals.goal_folder import GoalFolder
from shared import topics
from shared.door import Door
from shared.messages import GoalList, GoalListRequest
from shared.runtime.service import Publication


class Goals:
    """Named goals of one folder of recordings."""

    def __init__(self, scenario: Scenario, recordings: Path, door: Door) -> None:
        self._door = door
        self._scenario = scenario.name
        self._folder = GoalFolder(recordings, door)
        self._last_request = self._refusal = ""
        self._publish_time = -SECOND

    def load(self) -> None:
        """Read the goals of the folder."""
        self._folder.load()

    def step(self, requests: Sequence[GoalListRequest], now: int) -> Iterator[Publication]:
        """Carry out requests; publish the list after each and once a second."""
        for request in requests:
            with self._door.guard(topics.GOAL_LIST_REQUEST.key) as outcome:
                match request.action:
                    case GoalListRequest.SAVE:
                        self._folder.save(request.name, self._scenario, request.goal)
                    case GoalListRequest.DELETE:
                        self._folder.delete(request.name)
                    case unknown:
                        raise ValueError(f"there is no action {unknown}")
            self._last_request, self._refusal = request.id, outcome.refusal
        if requests or now - self._publish_time >= SECOND:
            self._publish_time = now
            message = GoalList(stamp=now, last_request=self._last_request, refusal=self._refusal)
            message.goals.extend(self._folder.goals)
            yield Publication(topics.GOAL_LIST, message)
