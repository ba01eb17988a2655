"""The rope from frame to frame: the default tracker and the baseline of the seed paper."""
