from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from dashboard.action_queue import ActionQueue
from dashboard.editors.obstacle_editor import (
    SOLIDS,
    ObstacleEditor,
    duplicate,
    extents,
    new_obstacle,
)
from dashboard.outbox import Outbox
from dashboard.web.private_viser import PrivateViser
from lariat.geometry import obstacles
from lariat.scenario import load
from lariat.shapes import SolidName

SCENARIO = load("three-cylinders")


@pytest.fixture
def editor() -> Iterator[ObstacleEditor]:
    private = PrivateViser("test")
    yield ObstacleEditor(
        private.server, SCENARIO, ActionQueue(), Outbox("dashboard-ab"), lambda _: None
    )
    private.close()


@pytest.mark.parametrize("shape", SOLIDS)
def test_new_obstacle_fills_the_height_that_was_asked_for(shape: SolidName) -> None:
    body = new_obstacle(shape, np.array([0.06, 0.06, 0.1]), (0.1, 0.2, 0.3))
    half = 0.03 if shape == "sphere" else 0.05
    above = np.array([[0.1, 0.2, 0.3 + half]])
    assert obstacles.signed_distance(above, body)[0] == pytest.approx(0.0, abs=1e-9)
    # The widest part of a cone is its base.
    aside = np.array([[0.13, 0.2, 0.25 if shape == "cone" else 0.3]])
    assert obstacles.signed_distance(aside, body)[0] == pytest.approx(0.0, abs=1e-9)


def test_new_obstacle_takes_a_name_that_is_free() -> None:
    size, at = np.array([0.1, 0.1, 0.1]), (0.0, 0.0, 0.0)
    first = new_obstacle("box", size, at)
    assert new_obstacle("box", size, at, {first.name: first}).name != first.name


@pytest.mark.parametrize("shape", SOLIDS)
def test_duplicate_stands_free_beside_its_original(shape: SolidName) -> None:
    body = new_obstacle(shape, np.array([0.06, 0.06, 0.1]), (0.1, 0.2, 0.3))
    copy = duplicate(body, {body.name})
    again = duplicate(copy, {body.name, copy.name})
    assert len({body.name, copy.name, again.name}) == 3
    assert copy.position == pytest.approx((0.1, 0.2 - 0.06 - 0.02, 0.3))


@pytest.mark.parametrize("shape", SOLIDS)
def test_extents_are_those_from_which_the_shape_is_made(shape: SolidName) -> None:
    body = new_obstacle(shape, np.array([0.06, 0.06, 0.1]), (0.1, 0.2, 0.3))
    again = new_obstacle(shape, extents(body), (0.1, 0.2, 0.3))
    assert again.radius == pytest.approx(body.radius)
    assert again.height == pytest.approx(body.height)
    assert again.size == pytest.approx(body.size)


def test_added_obstacle_is_selected_once_the_scene_has_it(editor: ObstacleEditor) -> None:
    low, middle = (o for o in SCENARIO.bodies if o.name in ("low", "middle"))
    editor.update([low, middle])
    editor.select("low")
    # The scenario's own stay and keep their size.
    assert not editor._size_field.visible
    assert not editor._remove.visible
    editor._request_duplicate()
    editor.update([low, middle])
    assert editor._selection.value == "low"
    copy = duplicate(low, {"low", "middle"})
    editor.update([low, middle, copy])
    assert editor._selection.value == copy.name
    assert editor._size_field.visible
    assert editor._remove.visible
    # Only once: afterwards the selection is the person's.
    editor.select("middle")
    editor.update([low, middle, copy])
    assert editor._selection.value == "middle"
