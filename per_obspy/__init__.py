"""
Find which neighbouring buildings hit each other in an earthquake, and what would prevent it.

Everything is SI: m, s, m/s², kg; damping as a fraction of critical; angles in degrees clockwise
from north. The public names stand in ``__init__.pyi``; each is imported when it is first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
