from pathlib import Path

from lariat.scenario.reference import reference

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "scenario.md"


def test_the_page_on_scenario_files_is_up_to_date():
    assert PAGE.read_text() == reference(), (
        "run: .venv/bin/python -m lariat.scenario.reference > docs/reference/scenario.md"
    )
