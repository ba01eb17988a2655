from __future__ import annotations

from pathlib import Path

from shared import messages, topics
from shared.messages.generate import generate

HERE = Path(messages.__file__).parent


def test_checked_in_code_is_what_the_protos_generate(tmp_path: Path) -> None:
    generate(tmp_path)
    fresh = {p.name: p.read_text() for p in (tmp_path / "shared/messages").iterdir()}
    assert len(fresh) == 2 * len(list(HERE.glob("*.proto")))
    assert fresh == {name: (HERE / name).read_text() for name in fresh}


def test_every_row_of_the_table_is_found_by_its_key_and_by_no_other() -> None:
    for topic in topics.TOPICS:
        key = topic.at("sim").key if "{" in topic.key else topic.key
        assert topics.find(key).type is topic.type
        assert [t.key for t in topics.TOPICS if t.matches(key)] == [topic.key]


def test_stamps_survive_the_way_through_a_timestamp() -> None:
    for stamp in (0, 1, 1_795_248_450_631_315_501):
        assert messages.from_timestamp(messages.timestamp(stamp)) == stamp
    log = topics.LOG.type(timestamp=messages.timestamp(5_000_000_007))
    assert messages.stamp_of(log) == 5_000_000_007
    assert messages.stamp_of(messages.NodeChain(stamp=3)) == 3
