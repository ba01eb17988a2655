from __future__ import annotations

import re

from lariat.scenario.reference import reference


def test_reference_states_values_default_and_meaning_of_keys():
    text = reference()
    assert "* `diameter`: 0.0005…0.1 m; **required**. Diameter of its cross-section.\n" in text
    assert '* `firmware`: `"v3"`, `"v4"`; `v3`. Firmware of the emulated arm;' in text
    # Only keys that stand for those of another section have no words of their own.
    section = text.partition("## `[rope]`")[2].partition("\n## ")[0]
    assert all(re.search(r"\. \S", line) for line in section.splitlines() if line[:1] == "*")
