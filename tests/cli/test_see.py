"""`lariat see` reads a picture, and a picture with depth, from files."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from cli.__main__ import main
from lariat.geometry import polylines, poses
from lariat.perception.image.p_wrong import DOUBTFUL
from tests.lariat.perception.lines.test_segmentation import GREY, ORANGE, taken
from tests.services.perception.scenes import CAMERA, curve

FIELD = Path(__file__).parents[3] / "shared" / "data" / "field"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    frame = taken(ORANGE, GREY, seed=2)
    i = CAMERA.intrinsics
    cv2.imwrite(str(tmp_path / "rope.png"), frame.color[..., ::-1])
    cv2.imwrite(str(tmp_path / "depth.png"), frame.depth)
    known = {"fx": i.fx, "fy": i.fy, "cx": i.cx, "cy": i.cy}
    (tmp_path / "k.json").write_text(json.dumps(known))
    return tmp_path


def test_lines_are_drawn_over_the_picture(folder: Path, capsys: pytest.CaptureFixture) -> None:
    assert (
        main(["see", str(folder / "rope.png"), "--output", str(folder / "seen.png"), "--json"]) == 0
    )
    answer = json.loads(capsys.readouterr().out)
    seen = cv2.imread(str(folder / "seen.png"))
    assert seen is not None
    for column, row in np.rint(answer["ropes"][0]["lines"][0][5:-5:10]).astype(int):
        assert seen[row, column].tolist() == [255, 0, 255]


def test_a_doubtful_answer_says_so(folder: Path, capsys: pytest.CaptureFixture) -> None:
    picture = cv2.imread(str(folder / "rope.png"))
    assert picture is not None
    # Orange and the table are equally bright: what is found is the table's grain.
    cv2.imwrite(str(folder / "faint.png"), cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY))
    code = main(["see", str(folder / "faint.png"), "--json"])
    answer = json.loads(capsys.readouterr().out)
    assert code == (0 if answer["ropes"] else 1)
    assert "--color" in answer["notes"][0]
    if answer["ropes"]:
        assert answer["p_wrong"] > DOUBTFUL


def test_no_rope_is_an_answer(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    cv2.imwrite(str(tmp_path / "grey.png"), np.full((240, 320), 120, np.uint8))
    assert main(["see", str(tmp_path / "grey.png"), "--json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert answer["ropes"] == []
    assert "no rope" in answer["notes"][0]


def test_threshold_of_doubt_is_the_users(folder: Path, capsys: pytest.CaptureFixture) -> None:
    said = []
    for threshold in ("0.999", "0.000001"):
        main(["see", str(folder / "rope.png"), "--doubtful", threshold, "--json"])
        answer = json.loads(capsys.readouterr().out)
        said.append((answer["ropes"][0]["doubtful"], bool(answer["notes"])))
    assert said == [(False, False), (True, True)]
    assert main(["see", str(folder / "rope.png"), "--doubtful", "30"]) == 2


def with_depth(folder: Path, *more: str) -> list[str]:
    options = ["--depth", str(folder / "depth.png"), "--camera", str(folder / "k.json")]
    options += ["--length", "0.45", "--diameter", "0.008", "--json"]
    return ["see", str(folder / "rope.png"), *options, *more]


def test_unit_of_the_depth_is_found_from_the_length_and_said(
    folder: Path, capsys: pytest.CaptureFixture
) -> None:
    depth = cv2.imread(str(folder / "depth.png"), cv2.IMREAD_UNCHANGED)
    assert depth is not None
    cv2.imwrite(str(folder / "depth.png"), depth * np.uint16(10))
    assert main(with_depth(folder)) == 0
    found = json.loads(capsys.readouterr().out)
    assert any("0.1 mm" in note for note in found["notes"])
    assert main(with_depth(folder, "--depth-scale", "0.0001")) == 0
    told = json.loads(capsys.readouterr().out)
    assert not any("0.1 mm" in note for note in told["notes"])
    assert np.allclose(found["nodes"], told["nodes"])
    assert polylines.length(np.array(told["nodes"])) == pytest.approx(0.45, rel=0.05)


def test_nodes_whose_length_contradicts_the_told_one_are_no_answer(
    folder: Path, capsys: pytest.CaptureFixture
) -> None:
    assert main(with_depth(folder, "--depth-scale", "0.002")) == 1
    answer = json.loads(capsys.readouterr().out)
    assert "nodes" not in answer
    assert "--depth-scale" in answer["lost"]


def test_depth_and_camera_of_another_size_are_refused(
    folder: Path, capsys: pytest.CaptureFixture
) -> None:
    i = CAMERA.intrinsics
    other = {"fx": i.fx, "fy": i.fy, "ppx": i.cx, "ppy": i.cy, "width": 848, "height": 480}
    (folder / "k.json").write_text(json.dumps(other))
    assert main(with_depth(folder)) == 2
    assert "848 x 480" in capsys.readouterr().err
    cv2.imwrite(str(folder / "depth.png"), np.full((480, 848), 600, np.uint16))
    assert main(with_depth(folder)) == 2
    assert "align" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("factor", "key", "told"),
    [(1.5, "", "principal"), (2.0, "", "principal"), (0.5, "", "principal"), (0.1, "f", "degrees")],
)
def test_intrinsics_of_another_picture_are_said(
    factor: float, key: str, told: str, folder: Path, capsys: pytest.CaptureFixture
) -> None:
    known = json.loads((folder / "k.json").read_text())
    scaled = {k: v * factor if k.startswith(key) else v for k, v in known.items()}
    (folder / "k.json").write_text(json.dumps(scaled))
    main(with_depth(folder))
    assert any(told in note for note in json.loads(capsys.readouterr().out)["notes"])


def test_a_diameter_that_the_picture_contradicts_is_said(
    folder: Path, capsys: pytest.CaptureFixture
) -> None:
    notes = []
    for diameter in ("0.008", "0.004", "0.016"):
        main(with_depth(folder, "--diameter", diameter))
        notes.append(json.loads(capsys.readouterr().out)["notes"])
    assert [any("--diameter" in note for note in each) for each in notes] == [False, True, True]


@pytest.mark.parametrize(("option", "value"), [("--length", "450"), ("--diameter", "8")])
def test_lengths_in_millimetres_are_refused(
    option: str, value: str, folder: Path, capsys: pytest.CaptureFixture
) -> None:
    assert main(with_depth(folder, option, value)) == 2
    assert option in capsys.readouterr().err


def test_labels_are_written_for_every_rope(folder: Path, capsys: pytest.CaptureFixture) -> None:
    assert (
        main(["see", str(folder / "rope.png"), "--labels", str(folder / "labels.png"), "--json"])
        == 0
    )
    answer = json.loads(capsys.readouterr().out)
    labels = cv2.imread(str(folder / "labels.png"), cv2.IMREAD_UNCHANGED)
    assert labels is not None
    assert set(np.unique(labels)) == {0, *range(1, len(answer["ropes"]) + 1)}
    axis = np.rint(answer["ropes"][0]["lines"][0]).astype(int)
    assert np.mean(labels[axis[:, 1], axis[:, 0]] == 1) > 0.95


def test_nodes_with_depth_are_in_the_cameras_frame(
    folder: Path, capsys: pytest.CaptureFixture
) -> None:
    options = ["--depth", str(folder / "depth.png"), "--camera", str(folder / "k.json")]
    options += ["--length", "0.45", "--diameter", "0.008", "--nodes", "30"]
    assert main(["see", str(folder / "rope.png"), *options, "--json"]) == 0
    nodes = np.array(json.loads(capsys.readouterr().out)["nodes"])
    T = CAMERA.T_world_camera
    world = T.position + poses.rotate(T.orientation, nodes)
    # Nobody says which end is the left one.
    truth = min(curve(2), curve(2)[::-1], key=lambda c: np.linalg.norm(c[0] - world[0]))
    assert np.mean(np.linalg.norm(world - truth, axis=1)) < 4e-3


def test_depth_alone_is_refused(folder: Path) -> None:
    assert main(["see", str(folder / "rope.png"), "--depth", str(folder / "depth.png")]) == 2


def test_pictures_of_any_kind_are_read(folder: Path, capsys: pytest.CaptureFixture) -> None:
    picture = cv2.imread(str(folder / "rope.png"))
    assert picture is not None
    # Twelve bits in sixteen, grey: blue light alone tells an orange rope from a grey table.
    grey = picture[..., 0]
    cv2.imwrite(str(folder / "grey.png"), grey.astype(np.uint16) * 16)
    assert main(["see", str(folder / "grey.png"), "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["ropes"][0]["lines"][0]) > 100
    assert main(["see", str(folder / "k.json")]) == 2
    cv2.imwrite(str(folder / "small.png"), picture[:9, :9])
    assert main(["see", str(folder / "small.png")]) == 2
    assert "9 x 9 pixels" in capsys.readouterr().err


def test_people_get_a_table(folder: Path, capsys: pytest.CaptureFixture) -> None:
    assert main(["see", str(folder / "rope.png")]) == 0
    shown = capsys.readouterr().out
    assert "crossings" in shown
    assert len(shown.splitlines()) < 20
    options = ["--depth", "depth.png", "--camera", "k.json"]
    options[1::2] = [str(folder / name) for name in options[1::2]]
    dimensions = ["--length", "0.5", "--diameter", "0.008"]
    assert main(["see", str(folder / "rope.png"), *options, *dimensions]) == 0
    assert "40 nodes" in capsys.readouterr().out


@pytest.mark.skipif(not FIELD.is_dir(), reason="pictures of others are not part of the repository")
@pytest.mark.parametrize(
    ("words", "colors"),
    [((), {"orange": 2, "blue": 1}), (("--color", "240", "110", "50"), {"orange": 2})],
)
def test_flat_ropes_of_one_colour_are_two_that_cross_once(
    words: tuple[str, ...], colors: dict[str, int], capsys: pytest.CaptureFixture
) -> None:
    assert main(["see", str(FIELD / "two_orange.png"), *words, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    seen = [rope["color"] for rope in answer["ropes"]]
    names = ["orange" if red > blue else "blue" for red, _, blue in seen]
    assert {name: names.count(name) for name in names} == colors
    (crossing,) = answer["crossings"]
    assert np.linalg.norm(np.subtract(crossing["at"], (131, 100))) < 8.0
    assert {names[k] for k in crossing["ropes"]} == {"orange"}
    assert answer["p_wrong"] < DOUBTFUL
