from __future__ import annotations

import pytest

from lariat.configuration import ConfigurationError
from lariat.control.run import live_settings
from lariat.controllers import OPTIMIZER_KEYS, live_keys
from lariat.scenario.sections import Control


@pytest.mark.parametrize("method", OPTIMIZER_KEYS)
def test_settings_of_a_section_are_the_section(method: str) -> None:
    control = Control(method=method, adapt=True, pace=0.5)
    texts = live_settings.texts(control, live_keys(control))
    assert live_settings.applied(Control(method=method), texts) == control
    assert {"adapt", "clearance", "pace"} < set(texts)


def test_settings_replace_values_of_the_section_and_of_the_paper() -> None:
    settings = {"speed_weight": "1", "paper.horizon": "3"}
    control = live_settings.applied(Control(), settings)
    assert (control.speed_weight, control.paper.horizon) == (1.0, 3)
    assert control.acceleration_weight == Control().acceleration_weight


@pytest.mark.parametrize(
    ("key", "text"), [("pace", "2"), ("horizon", "2.5"), ("speed_weight", "fast"), ("adapt", "1")]
)
def test_value_that_the_scenario_would_refuse_is_refused(key: str, text: str) -> None:
    with pytest.raises(ConfigurationError, match=rf"control\.{key} = "):
        live_settings.checked(key, text)
