from pathlib import Path

from shared.topics import TOPICS

README = (Path(__file__).parents[1] / "README.md").read_text()


def test_the_topic_table_of_the_readme_is_the_one_of_the_code():
    rows = [line for line in README.splitlines() if line.startswith("| `") and "/" in line]
    written = [tuple(cell.strip() for cell in row.strip("|").split("|")) for row in rows]
    assert [row for row in written if row[1].count(".") == 1] == [
        (f"`{t.key}`", t.type.DESCRIPTOR.full_name, t.owner) for t in TOPICS
    ]
