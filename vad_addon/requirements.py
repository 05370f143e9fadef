"""What Blender itself does not ship."""

import importlib.util
import sys


def scipy_problem() -> str:
    """Why SciPy cannot be used and what to do about it, one line; empty where it imports."""
    try:
        import scipy.spatial  # noqa: F401
    except ImportError:
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        return (
            f"SciPy does not import in Blender's Python {version}. Install the VAD zip made for your platform, which "
            f'carries it, or run "{sys.executable}" -m pip install scipy; then restart Blender'
        )
    return ""


def torch_hint() -> str:
    """What to do to have torch, one line; empty where it is installed."""
    if importlib.util.find_spec("torch"):
        return ""
    return (
        "Torch is not in Blender's Python, so NumPy stands in, without a GPU. Only the solver energy gains from it. To "
        f'have it, run "{sys.executable}" -m pip install torch as somebody who may write there; then restart Blender'
    )
