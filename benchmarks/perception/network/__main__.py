"""Training of the network of `lariat see`: `python -m benchmarks.perception.network`.

Takes an hour on one core. The weights go to the file that `lariat see` reads. With `--start` the
weights of an earlier file are trained on; its normalisations are merged into the convolutions, and
stay so. The present weights were trained from random ones for an hour, and on from each other by

    python -m benchmarks.perception.network new.onnx --steps 6000 --seed 700000 --start ropes.onnx

by `--steps 3000 --seed 800000`, `--steps 2500 --seed 820000` and `--steps 1500 --seed 860000`
(a.onnx), then with `--photographs FOLDER` by `--steps 3000 --seed 910000` (37 minutes, b.onnx) and
`--steps 2000 --seed 920000` (21 minutes, c.onnx). `--steps 0 --start a.onnx a.onnx b.onnx c.onnx`
made the mean, which sees of cables nearly what b and c see, and of other things no more than a.
Flat light was added to the pictures before the third training on, straight cables and turned
squares before a.onnx, exposures after it. The photographs were 18 of the 35 of
docs/results/perception.md; a.onnx and b.onnx looked up where cables have no mask, and b.onnx where
masks lie beside their cables.
"""

from __future__ import annotations

import copy
import importlib.util
import itertools
import sys
import time
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
import torch
import tyro

from benchmarks.perception.network.model import RopeNet, fix_normalisations, read_weights
from benchmarks.perception.network.photographs import training_photographs
from benchmarks.perception.network.pictures import (
    CROPS_PER_PICTURE,
    UNLABELLED,
    random_crop,
    training_crops,
)

LEARNING_RATE = 3e-3
"""Largest learning rate of AdamW, reached after a tenth of the steps and lowered to zero [-]."""
FURTHER_LEARNING_RATE = 1e-3
"""The same where the weights of an earlier file are trained on [-]."""
BATCH_SIZE = 16
"""Number of squares of a step [-]."""
VIEWS = 4
"""Number of times that a square is seen, on average [-]."""
POOL_SIZE = 2048
"""Number of squares that are kept to be seen again [-]."""
PHOTOGRAPH_SHARE = 1.0 / 3.0
"""Share of the squares that are of photographs, where there are any [-]."""
EXPOSURES, TINTS, GAMMAS = (0.5, 1.4), (0.85, 1.18), (0.7, 1.4)
"""Ranges of the factors of all colours and of each, and of the exponent [-]."""
DICE_WEIGHT = 0.5
"""Weight of one minus the soft Dice coefficient beside the cross entropy [-]."""
REPORT_STEPS = 50
"""Number of steps between two reports; the weights are written every tenth report."""


def batches(
    seed: int, photographs: Path | None = None
) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
    """Yield squares (b, 3, s, s), 0..1, and their masks (b, 1, s, s).

    A square returns `VIEWS` times on average, turned, mirrored and exposed otherwise: a picture
    takes longer to render than to learn from.
    """
    random = np.random.default_rng((4, seed))
    pool: deque[tuple[np.ndarray, np.ndarray]] = deque(maxlen=POOL_SIZE)
    taken = [] if photographs is None else training_photographs(photographs)
    for step in itertools.count():
        if step % max(1, CROPS_PER_PICTURE * VIEWS // BATCH_SIZE) == 0:
            pool.extend(training_crops(seed))
            seed += 1
        count = round(PHOTOGRAPH_SHARE * BATCH_SIZE) if taken else 0
        chosen = [pool[k] for k in random.integers(len(pool), size=BATCH_SIZE - count)]
        of_photographs = random.integers(max(1, len(taken)), size=count)
        chosen += [random_crop(random, *taken[k]) for k in of_photographs]
        colors = torch.from_numpy(np.stack([color for color, _ in chosen])).permute(0, 3, 1, 2)
        masks = torch.from_numpy(np.stack([mask for _, mask in chosen]))[:, None]
        turns, mirrored = int(random.integers(4)), random.random() < 0.5
        pair = [torch.rot90(t, turns, (2, 3)).float() for t in (colors, masks)]
        colors, masks = (t.flip(3) if mirrored else t for t in pair)
        yield _exposed(random, colors / 255.0), masks


def main(
    out: Annotated[Path, tyro.conf.Positional],
    steps: int = 3000,
    seed: int = 0,
    start: tuple[Path, ...] = (),
    photographs: Path | None = None,
) -> None:
    """Train the network that finds ropes in single pictures.

    Args:
        out: ONNX file to write.
        steps: Number of steps; a step sees sixteen squares of 192 x 192 pixels. With zero steps,
            the weights of `start` are written.
        seed: Seed of the first picture and of the weights.
        start: ONNX files of earlier trainings, from the mean of whose weights to go on; random
            weights by default.
        photographs: Folder of labelled photographs to learn from too, as that of `lariat bench
            perception instances`: every second one by name, the first included.
    """
    if importlib.util.find_spec("onnx") is None:
        sys.exit("PyTorch writes ONNX files with a package that is missing: pip install onnx")
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    network, rate = RopeNet(), LEARNING_RATE
    if start:
        states = []
        for path in start:
            read_weights(network, path)
            states.append(copy.deepcopy(network.state_dict()))
        network.load_state_dict({k: sum(s[k] for s in states) / len(states) for k in states[0]})
        rate = FURTHER_LEARNING_RATE
    if steps == 0:
        write_onnx(network, out)
        return
    # A fifth faster on a processor.
    network.to(memory_format=torch.channels_last)
    optimizer = torch.optim.AdamW(network.parameters(), rate, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, rate, total_steps=steps, pct_start=0.1
    )
    started, losses, dices = time.monotonic(), [], []
    for step, (colors, masks) in enumerate(batches(seed, photographs), start=1):
        network.train()
        if start:
            fix_normalisations(network)
        odds = network(colors.contiguous(memory_format=torch.channels_last))
        loss, dice = _loss(odds, masks)
        optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        schedule.step()
        losses.append(float(loss.detach()))
        dices.append(float(dice.detach()))
        if step % REPORT_STEPS == 0:
            minutes = (time.monotonic() - started) / 60.0
            print(
                f"step {step} of {steps}, {minutes:.0f} min: loss {np.mean(losses):.4f}, "
                f"Dice {np.mean(dices):.4f}",
                flush=True,
            )
            losses, dices = [], []
        if step % (10 * REPORT_STEPS) == 0 or step == steps:
            write_onnx(network, out)
        if step == steps:
            return


def write_onnx(network: RopeNet, path: Path) -> None:
    """Write a network as an ONNX file, its normalisations merged into the convolutions."""
    network.eval()
    torch.onnx.export(
        network,
        (torch.zeros(1, 3, 256, 256),),
        str(path),
        dynamo=False,
        opset_version=13,
        input_names=["pictures"],
        output_names=["log_odds"],
        dynamic_axes={"pictures": {2: "height", 3: "width"}, "log_odds": {2: "height", 3: "width"}},
    )


def _exposed(random: np.random.Generator, colors: torch.Tensor) -> torch.Tensor:
    """Squares, each with an exposure, white balance and gamma of its own."""
    count = len(colors)
    exposures, tints, gammas = (
        torch.from_numpy(np.exp(random.uniform(*np.log(bounds), (count, channels, 1, 1)))).float()
        for bounds, channels in ((EXPOSURES, 1), (TINTS, 3), (GAMMAS, 1))
    )
    return (colors * exposures * tints).clamp(1e-3, 1.0) ** gammas


def _loss(odds: torch.Tensor, masks: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Loss, and the soft Dice coefficient of the whole batch."""
    known = masks < UNLABELLED
    odds, masks = odds[known], masks[known]
    entropy = torch.nn.functional.binary_cross_entropy_with_logits(odds, masks)
    shown = torch.sigmoid(odds)
    dice = 2.0 * (shown * masks).sum() / (shown.sum() + masks.sum() + 1.0)
    return entropy + DICE_WEIGHT * (1.0 - dice), dice


if __name__ == "__main__":
    tyro.cli(main)
