"""Scenario that a request asks for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from lariat.configuration import ConfigurationError, Extensible
from lariat.scenario import MAX_SCENARIO_SIZE, SIDES, Scenario, load, parse
from lariat.scenario.settings import with_settings
from shared.messages import StackRequest
from stack.scenario_manager.library import real_arms


def requested_scenario(request: StackRequest, base: Path) -> Scenario:
    """Return the scenario of a request: a file with changes, or an uploaded text.

    Ends, limits and obstacles of a cell with real arms are those of the file; obstacles may be
    added. A request comes from a browser, so that it cannot name a class to import, or a robot's
    file to read: only what Lariat includes, installed packages offer, or the file itself names.
    """
    scenario = own = load(base)
    if request.content:
        if len(request.content) > MAX_SCENARIO_SIZE:
            raise ConfigurationError(f"the file is larger than {MAX_SCENARIO_SIZE >> 20} MiB")
        try:
            text = request.content.decode()
        except UnicodeDecodeError:
            raise ConfigurationError("the file is no text; give a scenario in TOML") from None
        scenario = parse(text, base.parent, source="the file")
    if request.settings:
        scenario = with_settings(scenario, request.settings)
    own_names = {name for _, name, _ in _choices(own)}
    for key, name, kind in _choices(scenario):
        offered = {*kind.included, *(point.name for point in entry_points(group=kind.group))}
        if name not in offered | own_names:
            raise ConfigurationError(
                f"{key} = {name!r} names a class, which the page may not; start the stack with a "
                "scenario file that names it"
            )
    if real_arms(scenario):
        _check_real_cell(scenario, own)
    robots = {own.end(side).urdf for side in SIDES} | {""}
    for side in SIDES:
        if (urdf := scenario.end(side).urdf) not in robots:
            raise ConfigurationError(
                f"ends.{side}.urdf = {urdf!r} names a file of this machine, which the page may "
                "not; start the stack with a scenario file that names it"
            )
    return scenario


def _check_real_cell(scenario: Scenario, own: Scenario) -> None:
    """Refuse changes of what keeps people and real arms safe: they are made in the file."""
    kept = set(own.obstacles) <= set(scenario.obstacles) and scenario.table == own.table
    for key, same in (
        ("ends", scenario.ends == own.ends),
        ("limits", scenario.limits == own.limits),
        ("obstacles", kept),
        ("clips", scenario.clips == own.clips),
    ):
        if not same:
            raise ConfigurationError(
                f"{key} of a cell with real arms cannot be changed from the page; edit the file "
                "and start the stack with it"
            )


def _choices(section: Any, path: str = "") -> Iterator[tuple[str, str, Extensible]]:
    """Yield key, value and kind of every choice to which packages may add."""
    hints = get_type_hints(type(section), include_extras=True)
    for item in fields(section):
        key, value = f"{path}{item.name}", getattr(section, item.name)
        if is_dataclass(value) and not isinstance(value, type):
            yield from _choices(value, f"{key}.")
        hint = hints[item.name]
        kind = get_args(hint)[1] if get_origin(hint) is Annotated else None
        if isinstance(kind, Extensible):
            yield key, str(value), kind
