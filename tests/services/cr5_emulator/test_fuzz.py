"""Whatever is written to the emulated arm, it stands, and answers the next command."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.services.cr5_emulator import wire_v3, wire_v4
from tests.services.cr5_emulator.bench import Bench, read

CALLS = {
    "v3": [c for c, _ in (*wire_v3.DASHBOARD, *wire_v3.MOTION)],
    "v4": [c for c, _ in (*wire_v4.SETTINGS, *wire_v4.MOTION)],
}
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
STRANGE = ["", "0", "-1", "1e308", "-1e308", "1e-320", "nan", "inf", "9" * 400, "{1,2}", "\u0663"]


@st.composite
def mutated(draw: st.DrawFn, firmware: str) -> str:
    """A command of the client with numbers changed, or letters cut out and put in."""
    text = draw(st.sampled_from(CALLS[firmware]))
    for _ in range(draw(st.integers(0, 3))):
        places = [m.span() for m in NUMBER.finditer(text)]
        if places and draw(st.booleans()):
            start, end = draw(st.sampled_from(places))
            value = draw(st.one_of(st.sampled_from(STRANGE), st.floats().map(str)))
        else:
            start = draw(st.integers(0, len(text)))
            end = start + draw(st.integers(0, 2))
            value = draw(st.text(alphabet="(){}[],=\"';\n x7", max_size=2))
        text = text[:start] + value + text[end:]
    return text


@pytest.mark.parametrize("firmware", ["v3", "v4"])
@settings(max_examples=120, deadline=None)
@given(data=st.data())
def test_spoiled_commands_are_answered_and_nothing_falls(
    firmware: str, data: st.DataObject
) -> None:
    bench = Bench(firmware)
    bench.enable()
    for text in data.draw(st.lists(mutated(firmware), min_size=1, max_size=5)):
        connection = bench.motion if data.draw(st.booleans()) else bench.commands
        connection.feed(text.encode())
        bench.run(0.04)
        assert not connection.closed
    # Whatever is open is closed, and whatever waits is waited for.
    bench.commands.feed(b")))")
    bench.run(0.008)
    read(bench.commands)
    bench.commands.feed(b"RobotMode()")
    bench.run(0.008)
    assert re.search(r"0,\{\d+\},RobotMode\(\);$", read(bench.commands))
