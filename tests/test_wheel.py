"""The library's wheel holds `lariat` alone and works in an empty environment."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from lariat.kernel_cache.key import cache_folder
from tests.examples.facts import IN_THE_WHEEL, check, code_of

ROOT = Path(__file__).parents[1]
COMPILED_ANEW = "camera-bodies"
"""Kernel that the environment has to compile by itself."""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder)]
    command.append(str(ROOT))
    subprocess.run(command, check=True, capture_output=True)
    (path,) = folder.glob("*.whl")
    return path


def test_it_holds_the_library_alone(wheel: Path):
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"lariat"}
    assert "lariat/py.typed" in names


def test_the_rooms_work_without_torch_and_clone_in_a_folder_with_names_of_the_stack(
    wheel: Path, tmp_path: Path
):
    environment = tmp_path / "environment"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(environment)], check=True)
    python = environment / "bin" / "python"
    install = [sys.executable, "-m", "pip", "--python", str(python), "install", "--no-compile"]
    install += ["--quiet", "--disable-pip-version-check"]
    rooms = f"{wheel}[perception,planning,simulation]"
    subprocess.run([*install, rooms, "matplotlib"], check=True)
    # Those of the clone are made of the same sources; one is compiled anew.
    kept = shutil.ignore_patterns(f"{COMPILED_ANEW}-*.kernel")
    shutil.copytree(cache_folder(), tmp_path / ".cache" / "lariat", ignore=kept)
    here = tmp_path / "here"
    for name in ("shared", "services", "stack"):
        (here / name).mkdir(parents=True)
        (here / name / "__init__.py").write_text("raise RuntimeError('shadowed')\n")
    folder = ROOT / "examples"
    for name in IN_THE_WHEEL:
        (example,) = (
            p for p in (*folder.glob("*.py"), *folder.glob("*/*.ipynb")) if p.name.startswith(name)
        )
        program = here / f"{example.stem}.py"
        text = code_of(example) if example.suffix == ".ipynb" else example.read_text()
        program.write_text(text)
        run = subprocess.run(
            [python, program.name],
            check=True,
            stdout=subprocess.PIPE,
            text=True,
            cwd=here,
            env=environment_of(tmp_path),
        )
        check(name, run.stdout)
    assert len(list((tmp_path / ".cache" / "lariat").glob(f"{COMPILED_ANEW}-*.kernel"))) == 1
    assert subprocess.run([python, "-c", "import torch"], capture_output=True).returncode == 1
    command = [environment / "bin" / "lariat", "up"]
    done = subprocess.run(
        command, capture_output=True, text=True, cwd=tmp_path, env=environment_of(tmp_path)
    )
    assert (done.returncode, "runs in a clone" in done.stderr) == (2, True)


def environment_of(folder: Path) -> dict[str, str]:
    """Environment variables of a user who has neither the clone on the path nor a display."""
    return {"PATH": os.defpath, "HOME": str(folder), "MPLBACKEND": "Agg"}
