"""Near bands that tests make up."""

import numpy as np

from core.field.steps import NearBand


def near_band(shape, node, step, past_rim=None, sample=None) -> NearBand:
    """Of a grid of `shape`: nodes (b,) with the steps to them (b,3), none past a rim and all with the first sample
    nearest, if nothing else is said."""
    past_rim = np.zeros(len(node), bool) if past_rim is None else past_rim
    return NearBand(shape, node, step, past_rim, np.zeros(len(node), np.int32) if sample is None else sample)
