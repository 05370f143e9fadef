"""The Blender side: a sidebar tab, an operator, and the way from objects to points and from results to objects."""

from .requirements import scipy_problem

_registered = None


def register():
    """Show the extension, or, as the method needs SciPy at import, only an explanation where that is missing."""
    global _registered
    if scipy_problem():
        from . import unavailable as _registered
    else:
        from . import interface as _registered
    _registered.register()


def unregister():
    _registered.unregister()
