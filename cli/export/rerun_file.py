"""Recording as a file of Rerun with a blueprint, the arrangement of its views.

Rerun's own converter reads the recording; the libraries are those of the extra `viewers`.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from cli.export.drawn_messages import drawn_messages
from shared import topics
from shared.cell_description import WORLD_FRAME
from shared.recording import Recording, Writer

APPLICATION = "lariat"
"""Name under which Rerun keeps the blueprint."""


def write(recording: Recording, path: Path) -> str:
    """Write the recording to a file, and the blueprint beside it; return one line about them."""
    # Imported late: only this format needs it.
    import rerun.blueprint as views

    with tempfile.TemporaryDirectory() as folder:
        drawn = Path(folder, recording.path.name)
        keys = _write_drawn(recording, drawn)
        words = ("mcap", "convert", str(drawn), "-o", str(path), "--application-id", APPLICATION)
        done = subprocess.run(
            [sys.executable, "-m", "rerun", *words], capture_output=True, text=True, check=False
        )
    if done.returncode:
        raise OSError(f"Rerun's converter failed: {done.stderr.strip()[-500:]}")
    clouds = [f"/{key}" for key in sorted(keys) if topics.VIEW_POINTS.matches(key)]
    cameras = sorted(k.split("/")[1] for k in keys if topics.CAMERA_COLOR.matches(k))
    scene = views.Spatial3DView(
        name="Cell",
        origin="/",
        contents=["/cell/visual_geometries/**", f"/{topics.VIEW_TRANSFORMS.key}", *clouds],
        spatial_information=views.SpatialInformation(target_frame=WORLD_FRAME),
    )
    pictures = [
        views.Spatial2DView(name=name, origin=f"/{topics.CAMERA_COLOR.at(name).key}")
        for name in cameras
    ]
    logs = views.TextLogView(name="Log", origin="/log")
    side = views.Vertical(*pictures, logs)
    blueprint = views.Blueprint(views.Horizontal(scene, side, column_shares=[3, 2]))
    arrangement = path.with_suffix(".rbl")
    blueprint.save(APPLICATION, str(arrangement))
    return f"{path}, {arrangement}: open both with `rerun {path} {arrangement}`"


def _write_drawn(recording: Recording, path: Path) -> set[str]:
    """Write the recording with the drawing of its cell to a file; return its topics' keys."""
    sequences: dict[str, int] = {}
    writer: Writer | None = None
    with tempfile.TemporaryDirectory() as folder:
        scenario = recording.scenario(Path(folder))
        for drawn in drawn_messages(recording):
            writer = writer or Writer(path, scenario, drawn.log_time)
            sequences[drawn.key] = sequences.get(drawn.key, -1) + 1
            writer.write(
                topics.find(drawn.key),
                drawn.message.SerializeToString(),
                "export",
                sequences[drawn.key],
                drawn.log_time,
                drawn.publish_time,
            )
    if writer is None:
        raise ValueError("it holds no message")
    writer.close()
    return set(sequences)
