"""Network that tells the pixels of ropes from all others: a U-Net (Ronneberger et al. 2015).

Four scales; the finest is half of the picture's. It has 0.43 million weights.
"""

from __future__ import annotations

import importlib
from itertools import pairwise
from pathlib import Path

import torch
from torch import nn

CHANNELS = (16, 32, 64, 96)
"""Channels at each scale, finest first [-]."""


class RopeNet(nn.Module):
    """Log odds that a pixel shows a rope."""

    def __init__(self) -> None:
        super().__init__()
        inputs = (3, *CHANNELS[:-1])
        self.down = nn.ModuleList(
            nn.Sequential(_block(a, b, stride=2), _block(b, b))
            for a, b in zip(inputs, CHANNELS, strict=True)
        )
        self.bottom = _block(CHANNELS[-1], CHANNELS[-1], dilation=2)
        pairs = list(pairwise(CHANNELS))[::-1]
        self.up = nn.ModuleList(nn.ConvTranspose2d(b, a, 2, 2) for a, b in pairs)
        self.merge = nn.ModuleList(_block(2 * a, a) for a, _ in pairs)
        self.head = nn.ConvTranspose2d(CHANNELS[0], 1, 2, 2)

    def forward(self, pictures: torch.Tensor) -> torch.Tensor:
        """Return the log odds of every pixel, shape (b, 1, h, w)."""
        scales: list[torch.Tensor] = []
        here = pictures
        for block in self.down:
            here = block(here)
            scales.append(here)
        here = self.bottom(scales.pop())
        for up, merge in zip(self.up, self.merge, strict=True):
            here = merge(torch.cat([up(here), scales.pop()], dim=1))
        return self.head(here)


def read_weights(network: RopeNet, path: Path) -> None:
    """Give a network the weights of an ONNX file of the same shape, in place.

    The file has the normalisations merged into the convolutions: the network's become a bias.

    Raises:
        ValueError: The file has another number of layers.
    """
    # The training needs this package; nothing else does.
    onnx = importlib.import_module("onnx")
    graph = onnx.load(str(path)).graph
    arrays = {
        a.name: torch.from_numpy(onnx.numpy_helper.to_array(a).copy()) for a in graph.initializer
    }
    # Both list the convolutions of a kind in the order of the calculation.
    plain = [n.input[1:] for n in graph.node if n.op_type == "Conv"]
    transposed = [n.input[1:] for n in graph.node if n.op_type == "ConvTranspose"]
    blocks = [m for part in (network.down, network.bottom, network.merge) for m in _blocks(part)]
    rises = [*network.up, network.head]
    if len(blocks) != len(plain) or len(rises) != len(transposed):
        raise ValueError(
            f"{path} has {len(plain)} and {len(transposed)} convolutions, not {len(blocks)} and "
            f"{len(rises)}; give a file that this training has written"
        )
    with torch.no_grad():
        for (convolution, normalisation, _), (weight, bias) in zip(blocks, plain, strict=True):
            assert isinstance(normalisation, nn.BatchNorm2d)
            convolution.weight.copy_(arrays[weight])
            normalisation.bias.copy_(arrays[bias])
            normalisation.weight.fill_((1.0 + normalisation.eps) ** 0.5)
        for rise, (weight, bias) in zip(rises, transposed, strict=True):
            rise.weight.copy_(arrays[weight])
            rise.bias.copy_(arrays[bias])


def fix_normalisations(network: RopeNet) -> None:
    """Keep mean and variance of the normalisations as they are, in place."""
    for module in network.modules():
        if isinstance(module, nn.BatchNorm2d):
            module.eval()


def _blocks(part: nn.Module) -> list[nn.Sequential]:
    """Blocks of convolution and normalisation in a part, in order."""
    return [m for m in part.modules() if isinstance(m, nn.Sequential) and len(m) == 3]


def _block(inputs: int, outputs: int, stride: int = 1, dilation: int = 1) -> nn.Sequential:
    convolution = nn.Conv2d(inputs, outputs, 3, stride, dilation, dilation, bias=False)
    return nn.Sequential(convolution, nn.BatchNorm2d(outputs), nn.ReLU())
