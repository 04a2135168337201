"""
Find which neighbouring buildings hit each other in an earthquake, and how to prevent it.

Everything is SI: m, s, m/s², kg; damping as a fraction of critical; angles in degrees clockwise
from north. The public names are listed in ``__init__.pyi``; each is imported when it is first used.
"""

import lazy_loader

_public_name, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    """Return a public name, imported when it is first used, or the version."""
    if name == "__version__":
        from importlib.metadata import version

        return version("per_obspy")
    return _public_name(name)
