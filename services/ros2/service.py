"""ROS 2 node on the bus: publishes the cell's state, and passes commands on if it is allowed to."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from services.ros2.arm_action import ArmAction
from services.ros2.commands import Commands
from services.ros2.options import Ros2Options
from services.ros2.rope_action import RopeAction
from shared import topics
from shared.cell_description import cell_urdf
from shared.door import Door
from shared.frames import Frames
from shared.ros2.node import Node, Publisher
from shared.ros2.outputs import Output
from shared.ros2.table import Table
from shared.ros2.types import ros
from shared.runtime.service import Inbox, Publication
from shared.topics import Topic


@dataclass
class _Shown:
    """Output that is published for a topic of the bus."""

    output: Output
    publisher: Publisher
    due: int = 0
    """Time of its next message, where it has a largest rate [ns]."""


class Ros2Service:
    """Node whose steps publish what is new and take what has come."""

    name = "ros2"
    reads: Sequence[Topic] = ()
    writes: Sequence[Topic] = Commands.writes
    rate = 30.0
    latency = 0.0

    def __init__(self, scenario: Scenario, session: str, options: Ros2Options) -> None:
        self.door = Door()
        self._options = options
        self._frames = Frames(scenario)
        self._table = Table.of(scenario)
        self._urdf = self._table.urdf(cell_urdf(scenario))
        sources = {source.key: source for source, _ in self._table.sources}
        # Frames are computed here: a cell without recorder has no drawing.
        for drawn in (topics.VIEW_TRANSFORMS, topics.VIEW_JOINTS):
            del sources[drawn.key]
        self._sources = tuple(sources.values())
        # A subscription to all processes is cheaper than one to each.
        for wide in (topics.HEALTH, topics.LOG):
            sources = {k: source for k, source in sources.items() if not wide.matches(k)}
            sources[wide.key] = wide
        if options.commands:
            sources |= {topic.key: topic for topic in Commands.reads}
        # Shown and judged at a lower rate than theirs: the newest one of a step is enough.
        for fast in (topics.ARM_SETPOINTS, topics.ARM_STATE):
            sources[fast.key] = replace(fast, buffering="latest")
        self.reads = tuple(sources.values())
        self.writes = Commands.writes if options.commands else ()
        self._session = session
        self._shown: dict[str, list[_Shown]] = {}
        """Outputs by the key of their source."""
        self._node: Node | None = None
        self._takers: list[Commands | RopeAction | ArmAction] = []
        self._fixed_due = True
        """Whether the fixed frames, which are latched, are still to be published."""
        self.note = ""

    def warm_up(self) -> None:
        """Join the graph."""
        options, table = self._options, self._table
        namespace = table.settings.namespace
        node = Node("lariat", namespace, options.domain, options.router, self.door)
        self._node = node
        by_name: dict[str, Publisher] = {}
        for source, output in table.sources:
            name = output.name_for(source.key)
            if name not in by_name:
                by_name[name] = node.publisher(name, output.type, output.qos)
            self._shown.setdefault(source.key, []).append(_Shown(output, by_name[name]))
        # A latched message lives as long as its publisher.
        row = table.description
        self._description = node.publisher(row.name, row.type, row.qos)
        self._description.put(ros(row.type, data=self._urdf))
        if options.commands:
            commands = Commands(node, self._session, table)
            rope = RopeAction(node, commands, table.inputs["shape_rope"].name)
            row, joints = table.inputs["follow_joint_trajectory"], self._frames.joint_names
            # The rope's action asks by way of the commands.
            self._takers = [rope, commands, ArmAction(node, self._session, row.name, joints)]

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Publish what is new to ROS 2, and pass on what it asks for."""
        arms = inbox.fresh(topics.ARM_STATE)
        if arms or self._fixed_due:
            frames = self._frames.transforms(arms and arms.message, now, self._fixed_due)
            self._publish(topics.VIEW_TRANSFORMS, frames, now)
        if arms:
            self._publish(topics.VIEW_JOINTS, self._frames.joints(arms.message, now), now)
        self._fixed_due = False
        for source in self._sources:
            for item in inbox.every(source):
                self._publish(source, item.message, now)
        for taker in self._takers:
            yield from taker.step(inbox, now)

    def close(self) -> None:
        """Leave the graph."""
        if self._node is not None:
            self._node.close()

    def _publish(self, source: Topic, message: object, now: int) -> None:
        for shown in self._shown[source.key]:
            output, publisher = shown.output, shown.publisher
            if not publisher.matched or now < shown.due:
                continue
            with self.door.guard(f"{source.key} for ROS 2"):
                converted = self._table.converted(output, message)
                if converted is None:
                    continue
                publisher.put(converted)
                if output.rate:
                    period = int(SECOND / output.rate)
                    # The mean rate is kept, whatever the steps.
                    shown.due = max(shown.due, now - period) + period


def build(scenario: Scenario, session: str, options: Ros2Options | None = None) -> Ros2Service:
    """Create the ROS 2 node of a scenario."""
    return Ros2Service(scenario, session, options or Ros2Options())
