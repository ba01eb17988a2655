"""Network that tells the pixels of ropes from all others: a U-Net (Ronneberger et al. 2015).

Four scales; the finest is half of the picture's. It has 0.43 million weights.
"""

from __future__ import annotations

from itertools import pairwise

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
        """Return the log odds of every pixel, shape (b, 1, h, w).

        Args:
            pictures: Red, green, blue, 0..1, shape (b, 3, h, w); h and w are multiples of 16.
        """
        scales: list[torch.Tensor] = []
        here = pictures
        for block in self.down:
            here = block(here)
            scales.append(here)
        here = self.bottom(scales.pop())
        for up, merge in zip(self.up, self.merge, strict=True):
            here = merge(torch.cat([up(here), scales.pop()], dim=1))
        return self.head(here)


def _block(inputs: int, outputs: int, stride: int = 1, dilation: int = 1) -> nn.Sequential:
    convolution = nn.Conv2d(inputs, outputs, 3, stride, dilation, dilation, bias=False)
    return nn.Sequential(convolution, nn.BatchNorm2d(outputs), nn.ReLU())
