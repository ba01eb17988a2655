"""Runner of one service in real time on the bus: `python -m services.NAME`.

The service is stepped at its rate on an absolute schedule. When a step overruns its period, the
steps that it missed are skipped and the overrun is counted: a backlog would delay the next steps.
A message of a topic that the service names in `wakes` begins the next step at once
(`shared.runtime.pace`).

In addition to the members of `shared.runtime.service.Service`, a service may have
* `tap(raw: shared.bus.RawMessage)`: called before each step with every message of the bus; a signal
  waits for the end of such a service's step, and what has arrived by then is tapped before `close`,
* `close()`: called before the process exits,
* `greeting: str`: line to print on standard error once it is ready, for what must not be in the
  log: that is published and recorded,
* `wakes: Sequence[Topic]`: topics of its inbox whose messages do not wait for the next step,
* `reflex: shared.runtime.service.Reflex`: takes and publishes messages between the steps, and while
  the service warms up,
* `door: shared.door.Door`: guards the handling of what others send; its refusals are counted,
* `note: str`: current activity or problem, shown in its health,
* `longest_step: float`: longest duration of a step [s], if longer than its period. No health is
  published during a step; the launcher waits this much longer before it reports a frozen service.
"""

from __future__ import annotations

import gc
import importlib
import logging
import os
import secrets
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any

import tyro

from lariat.configuration import ConfigurationError
from lariat.kernel_cache.source import NoCompilerError
from lariat.scenario import Scenario, load
from lariat.trajectory import SECOND
from shared import bus as buses
from shared import topics
from shared.bus import Bus, BusError, BusOptions, RawSubscription, Subscription
from shared.messages import Health, Trace
from shared.runtime.clock import Clock, SystemClock
from shared.runtime.closed_pipe import ending_with_the_reader
from shared.runtime.health import HealthMeter
from shared.runtime.logs import BusHandler, log_to_standard_error
from shared.runtime.memory import reserve_memory
from shared.runtime.pace import Pace
from shared.runtime.service import Mailbox, Reflex, Service
from shared.runtime.stall_watch import StallWatch
from shared.version import version

log = logging.getLogger(__name__)

EXIT_BAD_INPUT = 2
"""Exit code after bad input, which one line on standard error names."""
EXIT_EXCEPTION = 70
"""Exit code after an exception, whose traceback is in the log (EX_SOFTWARE of sysexits.h)."""
REPORT_PERIOD = SECOND
"""Time between two health messages [ns]."""
DRAIN_PAUSE, DRAIN_TIMEOUT = 0.05, 1.0
"""Time without a message after which none is expected, and longest wait for that [s]."""
GARBAGE_COLLECTION_PERIOD = 5 * SECOND
"""Time between two garbage collections, which run between steps [ns]."""

HINT = "run in the clone: pip install -e '.[all]'"
"""How a library that is missing is installed."""


@dataclass(frozen=True)
class LiveOptions(BusOptions):
    """Options on the command line of every service."""

    scenario: Path = Path("three-cylinders")
    """A scenario's TOML file, or the short name of a shipped one."""
    restarted: bool = False
    """Whether it replaces a process that died; if so, arms are armed by a person only."""
    heartbeat: Path | None = None
    """File to touch every second, for a monitor outside of the bus."""


class Stopped(BaseException):
    """SIGINT or SIGTERM was received."""


def main(module: str, extra: type | None = None) -> None:
    """Run the service of a package until a signal, with options from the command line.

    The package is imported here, so that a missing library is reported in one line.

    Args:
        module: The package, e.g. "services.sim"; its module `service` has
            `build(scenario, session)`.
        extra: Frozen dataclass of further command-line options, passed on as
            `build(scenario, session, options)`.

    Raises:
        SystemExit: With `EXIT_BAD_INPUT` or `EXIT_EXCEPTION`.
    """
    log_to_standard_error()
    name = module.rpartition(".")[2]
    with ending_with_the_reader():
        live, *more = _arguments(module, extra)
    session = f"{name}-{secrets.token_hex(4)}"
    try:
        build: Callable[..., Service] = importlib.import_module(f"{module}.service").build
        service = build(_scenario(live), session, *more)
        # Before this line a signal may end the process at once: there is nothing to clean up.
        with stopping_on_signals() as stop:
            options = {f.name: getattr(live, f.name) for f in fields(BusOptions)}
            clock = SystemClock()
            with buses.open(BusOptions(**options), session, clock) as bus:
                run(service, bus, clock, session, live.heartbeat, stop)
    except ImportError as error:
        sys.exit(_missing(module, name, error))
    except (ConfigurationError, BusError, NoCompilerError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        sys.exit(EXIT_BAD_INPUT)
    except Stopped:
        log.info("stopped")
    except Exception:
        log.exception("failed to start")
        sys.exit(EXIT_EXCEPTION)


def run(
    service: Service,
    bus: Bus,
    clock: Clock,
    session: str,
    heartbeat: Path | None = None,
    stop: StopSignal | None = None,
) -> None:
    """Warm a service up, and step it until a signal.

    Args:
        service: The service.
        bus: Connection to the bus.
        clock: Clock of the steps.
        session: Id of this start of the process.
        heartbeat: File to touch with every health message.
        stop: Signal that ends the service.

    Raises:
        Stopped: A signal was received; the service has been closed if it was warmed up.
        SystemExit: A step failed; its traceback is in the log.
    """
    handler = BusHandler(bus.publisher(topics.LOG.at(service.name)), service.name)
    runner = Runner(service, bus, clock, session, heartbeat, stop or StopSignal())
    service.warm_up()
    runner.subscribe()
    try:
        logging.getLogger().addHandler(handler)
        bus.declare_alive(service.name)
        reserve_memory()
        # Objects that exist at this point stay: garbage collection need not visit them.
        gc.collect()
        gc.freeze()
        gc.disable()
        log.info("ready")
        if greeting := getattr(service, "greeting", ""):
            print(greeting, file=sys.stderr, flush=True)
        runner.report()
        runner.watch()
        _keep_pace(runner, round(SECOND / service.rate))
    except Stopped:
        runner.drain()
        raise
    except Exception:
        log.exception("step %d failed", runner.meter.steps)
        sys.exit(EXIT_EXCEPTION)
    finally:
        gc.enable()
        runner.close()
        if close := getattr(service, "close", None):
            close()
        logging.getLogger().removeHandler(handler)


def _keep_pace(runner: Runner, period: int) -> None:
    reported = collected = time.monotonic_ns()
    pace, woken = Pace(period, reported), False
    while True:
        began = time.monotonic_ns()
        runner.step()
        now = time.monotonic_ns()
        if now - reported >= REPORT_PERIOD:
            reported = now
            runner.report()
        if now - collected >= GARBAGE_COLLECTION_PERIOD:
            collected = now
            gc.collect()
        deadline = pace.deadline(began, time.monotonic_ns(), woken=woken)
        woken = runner.woken(1e-9 * (deadline - time.monotonic_ns()))
        if woken:
            now = time.monotonic_ns()
            time.sleep(1e-9 * (pace.earliest(now) - now))


class Runner:
    """Runner that connects one service to its subscriptions and publishers."""

    def __init__(
        self,
        service: Service,
        bus: Bus,
        clock: Clock,
        session: str,
        heartbeat: Path | None,
        stop: StopSignal,
    ) -> None:
        self._service = service
        self._stop = stop
        self._heartbeat = heartbeat
        self._clock = clock
        self._mailbox = Mailbox(service.reads)
        self._newest: dict[str, int] = {}
        self._arrived = threading.Event()
        self._bus = bus
        self._subscriptions: list[Subscription] = []
        self._publishers = {t.key: bus.publisher(t) for t in service.writes}
        self._reflex: Reflex | None = getattr(service, "reflex", None)
        if self._reflex is not None:
            self._reflex.connect(self._send_at_once)
            # One that came while nobody waited is replaced by the next one.
            topic = replace(self._reflex.reads, buffering="latest")
            self._reflex_input = bus.subscribe(topic, arrived=self._react)
        self._tap = getattr(service, "tap", None)
        self._everything: RawSubscription | None = None
        self._trace = bus.publisher(topics.TRACE.at(service.name))
        self._health = bus.publisher(topics.HEALTH.at(service.name))
        self._session = session
        self.meter = HealthMeter(1.0 / service.rate)
        self._stall_watch: StallWatch | None = None

    def subscribe(self) -> None:
        """Take messages for the first step from now on: a service that warms up misses them."""
        service, wakes = self._service, {topic.key for topic in getattr(self._service, "wakes", ())}
        self._subscriptions = [
            self._bus.subscribe(
                topic,
                topic not in service.writes,
                self._arrived.set if topic.key in wakes else None,
            )
            for topic in service.reads
        ]
        self._everything = self._bus.subscribe_all() if self._tap else None

    def _send_at_once(self, message: Any) -> None:
        """Publish a message of the reflex; called in any thread."""
        assert self._reflex is not None
        message.stamp = self._clock.now()
        self._publishers[self._reflex.writes.key].put(message)

    def _react(self) -> None:
        """Pass a message that has just arrived to the reflex; called in the bus's thread."""
        if self._reflex is not None and self._reflex.waits:
            for _, item in self._reflex_input.take():
                self._reflex.take(item.message)

    def watch(self) -> None:
        """Report steps of this thread that do not end, from now on."""
        limit = 2.0 * getattr(self._service, "longest_step", 0.0)
        self._stall_watch = StallWatch(limit, self._report_stall)

    def close(self) -> None:
        """End the watch over the steps."""
        if self._stall_watch:
            self._stall_watch.close()

    def _report_stall(self, problem: str) -> None:
        """Publish that a step does not end: in the log, and as the note of a health message."""
        log.warning("%s", problem, extra={"fold": "stalled step"})
        meter = self.meter
        health = Health(
            period_ms=1e3 / self._service.rate, steps=meter.steps, overruns=meter.overruns
        )
        self._publish_health(health, problem)

    def woken(self, timeout: float) -> bool:
        """Wait for a message that begins a step; return whether one came in time.

        Args:
            timeout: Longest wait [s].
        """
        return self._arrived.wait(timeout)

    def step(self) -> None:
        """Step the service once, and publish its output and the trace of the step."""
        # What arrives from here on may be missed by this step.
        self._arrived.clear()
        if self._stall_watch:
            self._stall_watch.step_begins()
        # What a step has taken from the bus would be lost with it.
        with self._stop.waiting() if self._tap else nullcontext():
            self._step()
        if self._stall_watch:
            self._stall_watch.step_ended()

    def _step(self) -> None:
        start = time.perf_counter_ns()
        for subscription in self._subscriptions:
            for key, item in subscription.take():
                self._mailbox.deliver(key, item)
                self._newest[key] = item.received
        self._tap_all()
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

    def drain(self) -> None:
        """Tap what has arrived since the last step, until no more comes."""
        deadline = time.monotonic() + DRAIN_TIMEOUT
        while self._tap and time.monotonic() < deadline:
            # The network's threads may wait for the processor.
            time.sleep(DRAIN_PAUSE)
            if not self._tap_all():
                return

    def _tap_all(self) -> int:
        """Tap the messages that have arrived; return their number."""
        count = 0
        if self._tap and self._everything:
            for raw in self._everything.take():
                self._tap(raw)
                count += 1
        return count

    def report(self) -> None:
        """Publish the service's health and touch the heartbeat file."""
        if self._heartbeat:
            self._heartbeat.touch()
        now = self._clock.now()
        health = self.meter.report({key: now - stamp for key, stamp in self._newest.items()})
        self._publish_health(health, getattr(self._service, "note", ""))

    def _publish_health(self, health: Health, note: str) -> None:
        """Publish a health message, filled in with what the process knows of itself."""
        now = self._clock.now()
        health.service = self._service.name
        health.stamp = now
        health.boot = self._session
        health.process = os.getpid()
        health.version = version()
        health.drops = self._mailbox.drops + sum(s.lost for s in self._subscriptions)
        health.refused = sum(s.refused for s in self._subscriptions)
        if door := getattr(self._service, "door", None):
            health.refused += door.refused
        if self._everything:
            health.drops += self._everything.lost
            health.refused += self._everything.refused
        health.note = note
        health.longest_step_ms = 1e3 * getattr(self._service, "longest_step", 0.0)
        self._health.put(health)


class StopSignal:
    """SIGINT or SIGTERM, which raises `Stopped` at once, or after what must not be interrupted."""

    def __init__(self) -> None:
        self._delayed = self._received = False

    def receive(self) -> None:
        """Raise `Stopped`, now or at the end of the `with` block that it waits for."""
        self._received = True
        if not self._delayed:
            raise Stopped

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """Have the signal wait for the end of a `with` block."""
        self._delayed = True
        try:
            yield
        finally:
            self._delayed = False
        if self._received:
            raise Stopped


@contextmanager
def stopping_on_signals() -> Iterator[StopSignal]:
    """Raise `Stopped` in a `with` block, once, on SIGINT or SIGTERM."""
    stop = StopSignal()

    def receive(number: int, frame: object) -> None:
        # A second signal must not interrupt the shutdown.
        for each in handled:
            signal.signal(each, signal.SIG_IGN)
        stop.receive()

    handled = (signal.SIGINT, signal.SIGTERM)
    former = [signal.signal(number, receive) for number in handled]
    try:
        yield stop
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


def _missing(module: str, name: str, error: ImportError) -> int:
    """Report an import that failed; the exit code."""
    library = (error.name or str(error)).partition(".")[0]
    if library in ("services", "shared", "dashboard", "lariat", "stack", "benchmarks", "cli"):
        log.exception("%s cannot be imported", module)
        return EXIT_EXCEPTION
    print(f"{name}: {library} is not installed; {HINT}", file=sys.stderr)
    return EXIT_BAD_INPUT
