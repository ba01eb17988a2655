"""The bus of a cell with certificates, through a real router."""

from __future__ import annotations

import importlib
import inspect
import json
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from shared import bus as buses
from shared import topics
from shared.bus import Bus, BusOptions, Unreachable
from shared.messages import ArmCommand
from shared.runtime.free_port import free_port
from shared.topics import Topic
from stack.credentials.access_control import (
    SERVICES,
    USERS,
    owners,
    published_keys,
)
from stack.credentials.cell_credentials import make_credentials

NAMESPACE = "cell"

Join = Callable[..., Bus]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("credentials")
    make_credentials(folder, ("localhost", "127.0.0.1"), NAMESPACE, days=90)
    return folder


@pytest.fixture
def endpoint() -> str:
    return f"tls/127.0.0.1:{free_port()}"


@pytest.fixture
def join(folder: Path, endpoint: str) -> Iterator[Join]:
    """Connect users to a router that demands certificates."""
    with ExitStack() as stack:

        def connect(user: str, settings: Path | None = None) -> Bus:
            file = settings or folder / user / "bus.json"
            options = BusOptions(NAMESPACE, (endpoint,), (), "client", file)
            return stack.enter_context(buses.open(options, user, timeout=2.0))

        router = BusOptions(NAMESPACE, (), (endpoint,), "router", folder / "router" / "bus.json")
        stack.enter_context(buses.open(router, "router"))
        yield connect


def test_router_passes_on_what_a_user_owns_and_nothing_else(join: Join) -> None:
    everything = join("recorder").subscribe_all()
    attempts: list[tuple[str, Topic]] = [
        ("dashboard", topics.ARM_SETPOINTS),
        ("perception", topics.ARM_COMMAND),
        ("sim", topics.TASK_STATE),
        ("lariat", topics.HEALTH.at("robot_gateway")),
        ("controller", topics.ARM_SETPOINTS),
        ("dashboard", topics.ARM_COMMAND),
        ("controller", topics.TASK_STATE),
        ("robot_gateway", topics.HEALTH.at("robot_gateway")),
    ]
    valid = {topics.ARM_COMMAND.key: ArmCommand(action=ArmCommand.DISARM)}
    users = {user: join(user) for user, _ in attempts}
    publishers = [(user, users[user].publisher(topic)) for user, topic in attempts]
    for (_, publisher), (_, topic) in zip(publishers, attempts, strict=True):
        for _ in range(10):
            publisher.put(valid.get(topic.key) or topic.type())
            time.sleep(0.02)
    time.sleep(0.2)
    passed = {(raw.publisher, raw.key) for raw in everything.take()}
    assert passed == {(user, topic.key) for user, topic in attempts if user in owners_of(topic)}


def owners_of(topic: Topic) -> set[str]:
    return {user for user in USERS if topic.key in published_keys(user)}


def test_user_without_a_certificate_of_this_cell_is_kept_out(
    join: Join, tmp_path: Path, folder: Path
) -> None:
    make_credentials(tmp_path, ("127.0.0.1",), NAMESPACE, days=90)
    stranger = json.loads((tmp_path / "controller" / "bus.json").read_text())
    trusting = json.loads((folder / "controller" / "bus.json").read_text())
    key = "transport/link/tls/root_ca_certificate_base64"
    stranger[key] = trusting[key]
    (tmp_path / "stranger.json").write_text(json.dumps(stranger))
    with pytest.raises(Unreachable, match="credentials"):
        join("controller", tmp_path / "stranger.json")


def test_readers_know_that_a_publisher_is_there_and_alive(join: Join) -> None:
    gateway, dashboard = join("robot_gateway"), join("dashboard")
    gateway.declare_alive("robot_gateway")
    subscription = gateway.subscribe_all()
    publisher = dashboard.publisher(topics.ARM_COMMAND)
    deadline = time.monotonic() + 5.0
    while not publisher.has_subscribers and time.monotonic() < deadline:
        time.sleep(0.02)
    assert publisher.has_subscribers
    publisher.put(ArmCommand(action=ArmCommand.DISARM))
    time.sleep(0.2)
    assert [raw.key for raw in subscription.take()] == [topics.ARM_COMMAND.key]
    assert dashboard.alive() == {"robot_gateway"}


@pytest.mark.parametrize("name", SERVICES)
def test_user_may_publish_what_its_service_writes(name: str) -> None:
    package = "dashboard" if name == "dashboard" else f"services.{name}"
    module = importlib.import_module(f"{package}.service")
    (service,) = [c for _, c in inspect.getmembers(module, _is_service) if c.name == name]
    for topic in service.writes:
        assert name in owners(topics.find(topic.key)), topic.key


def _is_service(member: object) -> bool:
    return inspect.isclass(member) and all(hasattr(member, n) for n in ("step", "rate", "writes"))


def test_only_controller_commands_the_arms_and_only_people_request() -> None:
    assert owners_of(topics.ARM_SETPOINTS) == {"controller"}
    assert owners_of(topics.ARM_COMMAND) == {"dashboard", "lariat"}
    assert owners_of(topics.TASK_REQUEST) == {"dashboard", "lariat", "ros2"}
    assert owners_of(topics.SCENE_REQUEST) == {"dashboard", "lariat", "ros2"}
    for service in SERVICES:
        assert owners_of(topics.HEALTH.at(service)) == {service}


def test_credentials_are_for_their_owner_alone_and_made_once(folder: Path) -> None:
    for path in folder.rglob("*"):
        mode = stat.S_IMODE(path.stat().st_mode)
        assert mode == (0o700 if path.is_dir() else 0o600), path
    again = make_credentials(folder, ("localhost", "127.0.0.1"), NAMESPACE, days=90)
    assert again == []
    assert make_credentials(folder, ("localhost", "127.0.0.1"), NAMESPACE, days=20) == []


def test_credentials_that_are_about_to_expire_are_renewed(tmp_path: Path) -> None:
    assert len(make_credentials(tmp_path, ("router",), NAMESPACE, days=20)) == 1 + len(USERS)
    assert len(make_credentials(tmp_path, ("router",), NAMESPACE, days=90)) == 1 + len(USERS)
