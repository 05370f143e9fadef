"""Adam on unit axes."""

from collections.abc import Callable

import numpy as np

from ..linalg import row_dots
from ..progress import Progress

MAX_STEPS = 1000

_RATE = 0.1  # first step, radians
_DECAYS = 0.9, 0.99
_PATIENCE = 10  # steps without progress before the rate is halved
_PROGRESS = 1e-3  # least relative fall of the energy that counts as progress
_LAST_RATE = _RATE / 100


def minimise(
    value_and_gradient: Callable[[np.ndarray], tuple[float, np.ndarray]],
    start: np.ndarray,
    constraints=None,
    progress=None,
    max_steps: int = MAX_STEPS,
) -> tuple[np.ndarray, list[float]]:
    """Minimise a function of unit axes (section 4.2 of the paper).

    value_and_gradient : (n,3) axes -> value, gradient (n,3)
    start              : (n,3) unit axes
    constraints        : (indices (k,), axes (k,3)) or None; these axes are never touched
    Returns the axes (n,3) of the lowest value met, and the value before each step.

    Axes are normalised after each step and the gradient is projected to their tangent planes before it. Departures
    from plain Adam: the second moment is one number for each axis, so that turning the points turns the steps; the
    rate is halved where the value stops falling, and the search ends when it has become small.
    """
    progress = Progress.of(progress)
    held, given = ([], np.empty((0, 3))) if constraints is None else constraints
    axes = start.copy()
    axes[held] = given
    mean, square = np.zeros_like(axes), np.zeros((len(axes), 1))
    best, lowest, mark, rate, waited, history = axes, np.inf, np.inf, _RATE, 0, []

    for step in range(1, max_steps + 1):
        progress(step / max_steps)
        value, gradient = value_and_gradient(axes)
        history.append(value)
        if value < lowest:
            best, lowest = axes, value
        if value < mark * (1 - _PROGRESS):
            mark, waited = value, 0
        else:
            waited += 1
        if waited == _PATIENCE:
            rate, waited = rate / 2, 0
        if rate < _LAST_RATE or value == 0:
            break

        gradient = gradient - row_dots(gradient, axes)[:, None] * axes
        mean = _DECAYS[0] * mean + (1 - _DECAYS[0]) * gradient
        square = _DECAYS[1] * square + (1 - _DECAYS[1]) * row_dots(gradient, gradient)[:, None]
        scale = np.sqrt(square / (1 - _DECAYS[1] ** step)) + np.finfo(np.float64).tiny
        axes = axes - rate / (1 - _DECAYS[0] ** step) * mean / scale
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        axes[held] = given
    return best, history
