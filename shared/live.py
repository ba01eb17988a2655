"""Runs one service in real time on the bus: what `python -m services.NAME` does.

The service is stepped at its rate on an absolute schedule. A late step is counted and the missed
ones are left out: a backlog would only make the next one later.

Besides the contract of `shared.service` a service may have
* `tap(raw: shared.bus.Raw)`: is given every message of the bus before each step,
* `close()`: is called before a clean exit,
* `note: str`: what it does or lacks at the moment, shown in its health,
* `longest_step: float`: how long a step may last [s] where that is more than its period. No health
  comes during a step: whoever watches must wait so much longer before calling the service frozen.
"""

from __future__ import annotations

import gc
import importlib
import logging
import os
import secrets
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any

import tyro

from shared import bus as buses
from shared import memory, topics
from shared.bus import Bus, BusError, BusOptions
from shared.clock import Clock, SystemClock
from shared.configuration import ConfigurationError
from shared.health import HealthMeter
from shared.logs import BusHandler, to_standard_error
from shared.messages import Trace
from shared.scenario import Scenario, load
from shared.service import SECOND, Mailbox, Service
from shared.version import version

log = logging.getLogger(__name__)

EXIT_BAD_INPUT = 2
EXIT_EXCEPTION = 70
_COLLECT_PERIOD = 5 * SECOND


@dataclass(frozen=True)
class LiveOptions(BusOptions):
    """What every service takes on its command line."""

    scenario: Path = Path("three-cylinders")
    """A scenario's TOML file, or the short name of a shipped one."""
    restarted: bool = False
    """This replaces a process that died: nothing is armed without a person."""
    heartbeat: Path | None = None
    """File to touch every second, for whoever watches this process from outside."""


class Stopped(BaseException):
    """SIGINT or SIGTERM came."""


def main(module: str, extra: type | None = None) -> None:
    """Runs the service whose `service.py` lies in a package, and exits.

    The package is imported here, so that a missing library is said in one line.

    Args:
        module: The package, e.g. "services.sim"; its `service` has `build(scenario, session)`.
        extra: A frozen dataclass of further options of the command line, handed to
            `build(scenario, session, options)`.
    """
    to_standard_error()
    name = module.rpartition(".")[2]
    live, *more = _arguments(module, extra)
    session = f"{name}-{secrets.token_hex(4)}"
    try:
        build: Callable[..., Service] = importlib.import_module(f"{module}.service").build
        service = build(_scenario(live), session, *more)
        service.warm_up()
        # Until here a signal may end the process at once: there is nothing to put in order.
        with stopping_on_signals():
            options = {f.name: getattr(live, f.name) for f in fields(BusOptions)}
            clock = SystemClock()
            with buses.open(BusOptions(**options), session, clock) as bus:
                run(service, bus, clock, session, live.heartbeat)
    except ImportError as error:
        sys.exit(_missing(module, name, error))
    except (ConfigurationError, BusError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        sys.exit(EXIT_BAD_INPUT)
    except Stopped:
        log.info("stopped")
    except Exception:
        log.exception("did not start")
        sys.exit(EXIT_EXCEPTION)


def run(
    service: Service, bus: Bus, clock: Clock, session: str, heartbeat: Path | None = None
) -> None:
    """Steps a warm service until a signal comes.

    Raises:
        Stopped: After the service has been closed.
        SystemExit: A step failed; its traceback is in the log.
    """
    handler = BusHandler(bus.publisher(topics.LOG.at(service.name)), service.name)
    logging.getLogger().addHandler(handler)
    runner = Runner(service, bus, clock, session, heartbeat)
    bus.declare_alive(service.name)
    memory.reserve()
    # What exists now stays: a collection must not walk through it in the middle of a step.
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        log.info("ready")
        runner.report()
        _keep_pace(runner, round(SECOND / service.rate))
    except Stopped:
        raise
    except Exception:
        log.exception("step %d failed", runner.meter.steps)
        sys.exit(EXIT_EXCEPTION)
    finally:
        gc.enable()
        if close := getattr(service, "close", None):
            close()
        logging.getLogger().removeHandler(handler)


def _keep_pace(runner: Runner, period: int) -> None:
    deadline = reported = collected = time.monotonic_ns()
    while True:
        runner.step()
        now = time.monotonic_ns()
        if now - reported >= SECOND:
            reported = now
            runner.report()
        if now - collected >= _COLLECT_PERIOD:
            collected = now
            gc.collect()
        now = time.monotonic_ns()
        deadline += period * max(1, -(-(now - deadline) // period))
        time.sleep(1e-9 * (deadline - now))


class Runner:
    """One service between its subscriptions and its publishers."""

    def __init__(
        self, service: Service, bus: Bus, clock: Clock, session: str, heartbeat: Path | None
    ) -> None:
        self._service = service
        self._heartbeat = heartbeat
        self._clock = clock
        self._mailbox = Mailbox(service.reads)
        self._newest: dict[str, int] = {}
        self._subscriptions = [bus.subscribe(topic) for topic in service.reads]
        self._publishers = {t.key: bus.publisher(t) for t in service.writes}
        self._tap = getattr(service, "tap", None)
        self._everything = bus.subscribe_all() if self._tap else None
        self._trace = bus.publisher(topics.TRACE.at(service.name))
        self._health = bus.publisher(topics.HEALTH.at(service.name))
        self._session = session
        self.meter = HealthMeter(1.0 / service.rate)

    def step(self) -> None:
        """Hands the service what came, and the bus what the service says."""
        start = time.perf_counter_ns()
        for subscription in self._subscriptions:
            for key, item in subscription.take():
                self._mailbox.deliver(key, item)
                self._newest[key] = item.received
        if self._tap and self._everything:
            for raw in self._everything.take():
                self._tap(raw)
        inbox = self._mailbox.take()
        now = self._clock.now()
        for topic, message in self._service.step(inbox, now):
            self._publishers[topic.key].put(message)
        self._trace.put(
            Trace(
                service=self._service.name,
                step=self.meter.steps,
                now=now,
                inputs=inbox.consumed,
            )
        )
        self.meter.add(time.perf_counter_ns() - start)

    def report(self) -> None:
        """Publishes the service's health and shows that the process lives."""
        if self._heartbeat:
            self._heartbeat.touch()
        now = self._clock.now()
        health = self.meter.report({key: now - at for key, at in self._newest.items()})
        health.service = self._service.name
        health.stamp = now
        health.boot = self._session
        health.process = os.getpid()
        health.version = version()
        health.drops = self._mailbox.drops + sum(s.lost for s in self._subscriptions)
        if self._everything:
            health.drops += self._everything.lost
        health.note = getattr(self._service, "note", "")
        health.longest_step_ms = 1e3 * getattr(self._service, "longest_step", 0.0)
        self._health.put(health)


@contextmanager
def stopping_on_signals() -> Iterator[None]:
    """Raises `Stopped` in the block, once, when SIGINT or SIGTERM comes."""

    def stop(number: int, frame: object) -> None:
        # The way out must not be interrupted by an impatient second signal.
        for each in handled:
            signal.signal(each, signal.SIG_IGN)
        raise Stopped

    handled = (signal.SIGINT, signal.SIGTERM)
    former = [signal.signal(number, stop) for number in handled]
    try:
        yield
    finally:
        for number, handler in zip(handled, former, strict=True):
            signal.signal(number, handler)


def _arguments(module: str, extra: type | None) -> tuple[Any, ...]:
    if extra is None:
        return (tyro.cli(LiveOptions, prog=f"python -m {module}"),)

    def both(
        live: Annotated[LiveOptions, tyro.conf.arg(name="")],
        more: Annotated[Any, tyro.conf.arg(name="")],
    ) -> tuple[Any, ...]:
        return live, more

    both.__annotations__ = {
        "live": Annotated[LiveOptions, tyro.conf.arg(name="")],
        "more": Annotated[extra, tyro.conf.arg(name="")],
    }
    return tyro.cli(both, prog=f"python -m {module}")


def _scenario(options: LiveOptions) -> Scenario:
    scenario = load(options.scenario)
    if not options.restarted:
        return scenario
    ends = {
        side: replace(getattr(scenario.ends, side), arm_automatically=False)
        for side in vars(scenario.ends)
    }
    return replace(scenario, ends=replace(scenario.ends, **ends))


def _missing(module: str, extra: str, error: ImportError) -> int:
    library = (error.name or str(error)).partition(".")[0]
    if library in ("services", "shared", "dashboard", "lariat", "stack", "benchmarks", "cli"):
        log.exception("%s does not import", module)
        return EXIT_EXCEPTION
    way_out = f"run in the clone: pip install -e . -e './stack[{extra}]'"
    print(f"{extra}: {library} is not installed; {way_out}", file=sys.stderr)
    return EXIT_BAD_INPUT
