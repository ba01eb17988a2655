"""RGB-D frames of one calibrated camera: decoding, lens distortion, depth bias, faults."""
