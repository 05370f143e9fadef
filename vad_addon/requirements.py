"""What Blender itself does not ship."""

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
