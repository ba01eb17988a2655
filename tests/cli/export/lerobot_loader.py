"""Reader of a LeRobot data set by LeRobot's own loader, in LeRobot's environment.

python lerobot_loader.py FOLDER
"""

from __future__ import annotations

import json
import os
import sys

os.environ["HF_HUB_OFFLINE"] = "1"  # Before the import: nothing may be asked of a network.

import lerobot  # pyright: ignore[reportMissingImports]
import torch
from lerobot.datasets.lerobot_dataset import (  # pyright: ignore[reportMissingImports]
    LeRobotDataset,
)

dataset = LeRobotDataset("lariat/export", root=sys.argv[1])
(batch,) = torch.utils.data.DataLoader(dataset, batch_size=len(dataset))
last = dataset[len(dataset) - 1]
image = last.get("observation.images.overhead")
answer = {
    "version": lerobot.__version__,
    "episodes": dataset.num_episodes,
    "frames": len(batch["index"]),
    "action": last["action"].tolist(),
    "image": None if image is None else list(image.shape),
    "task": last["task"],
}
print(json.dumps(answer))
