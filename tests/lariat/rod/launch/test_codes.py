"""The codes of the kernel have the order of the names in other modules."""

from __future__ import annotations

from lariat.rod.launch.codes import EndHold
from lariat.rod.launch.inputs import ENDS


def test_holds_are_coded_in_the_order_of_the_ends() -> None:
    assert tuple(hold.name.lower() for hold in EndHold) == ENDS
