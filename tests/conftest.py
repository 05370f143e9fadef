"""Property tests draw the same examples on every run, however slow the machine; so do those that draw at random."""

import numpy as np
import pytest
from hypothesis import settings

settings.register_profile("steady", derandomize=True, deadline=None)
settings.load_profile("steady")


@pytest.fixture
def random():
    return np.random.default_rng(0)
