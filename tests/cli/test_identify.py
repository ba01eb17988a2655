"""`lariat identify` from file to answer."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np
import pytest

from cli.__main__ import main
from tests.lariat.identification.ropes import STIFFNESS, recorded

REAL = Path(__file__).parents[3] / "shared" / "data" / "mocap" / "dlo5.npz"


class Claim(NamedTuple):
    """Header of an array that is not there."""

    shape: tuple[int, ...]

    def write(self, stream: IO[bytes]) -> None:
        claimed = {"descr": "|V8000", "fortran_order": False, "shape": self.shape}
        np.lib.format.write_array_header_1_0(stream, claimed)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    seen = recorded(sequences=1, frames=80, noise=3e-4)
    path = tmp_path_factory.mktemp("identify") / "rope.npz"
    held = np.nonzero(~seen.free)[0]
    np.savez(path, vertices=seen.vertices, dt=seen.dt, prescribed=held)
    return path


def test_answer_has_parameters_error_and_predictions(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, plot = file.with_name("out.npz"), file.with_name("plot.png")
    options = ["--fit-seconds", "0.5", "--predictions", str(out), "--plot", str(plot)]
    assert main(["identify", str(file), *options, "--linear-density", "0.05", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    found = answer["parameters"]["stiffness"]
    assert abs(found["value"] - STIFFNESS) < 0.3 * STIFFNESS
    assert answer["bending_stiffness_N_m2"] == pytest.approx(0.05 * found["value"])
    assert answer["fit_seconds"] == 0.5
    assert answer["predicted_seconds"] == pytest.approx(0.3)
    assert answer["error_cm"] < 0.2
    with np.load(out) as stored, np.load(file) as given:
        assert stored["first_predicted"] == 50
        error = np.abs(stored["vertices"] - given["vertices"])
        assert np.all(error[:, :50] == 0.0)
        assert 100.0 * np.mean(error[:, 50:]) == pytest.approx(answer["error_cm"] * 32 / 30)
    assert plot.stat().st_size > 10_000


def test_other_ropes_motion_is_predicted_by_the_one_that_was_fitted(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = file.with_name("other.npz")
    seen = recorded(sequences=1, frames=60, seed=3)
    held = np.nonzero(~seen.free)[0]
    np.savez(other, vertices=seen.vertices, dt=seen.dt, prescribed=held)
    assert main(["identify", str(other), "--train", str(file), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["fitted_to"] == str(file)
    assert len(answer["error_cm_per_sequence"]) == 1
    assert answer["error_cm"] < 0.2


@pytest.mark.parametrize(
    ("stored", "words"),
    [
        ({"vertices": np.zeros((1, 20, 8, 3)), "dt": 0.01}, "has no 'prescribed'"),
        ({"vertices": np.zeros((20, 8, 3)), "dt": 0.01, "prescribed": [0]}, "got shape (20, 8, 3)"),
        (None, "is a text, not a .npz"),
        (
            {"vertices": Claim((2**17,)), "dt": 0.01, "prescribed": [0]},
            "an array claims shape (131072,), more than 512 MiB",
        ),
    ],
)
def test_bad_file_is_one_line(
    stored: dict[str, object] | None,
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "bad.npz"
    if stored is None:
        path.write_text("vertices")
    else:
        with zipfile.ZipFile(path, "w") as archive:
            for name, value in stored.items():
                with archive.open(f"{name}.npy", "w") as member:
                    if isinstance(value, Claim):
                        value.write(member)
                    else:
                        np.lib.format.write_array(member, np.asarray(value))
    assert main(["identify", str(path)]) == 2
    said = capsys.readouterr().err.strip()
    assert words in said
    assert str(path) in said
    assert "\n" not in said


@pytest.mark.slow
@pytest.mark.skipif(not REAL.exists(), reason="the measured ropes are not beside the repository")
def test_real_rope_is_predicted_from_its_first_two_seconds(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["identify", str(REAL), "--fit-seconds", "2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["error_cm"] < 0.69
