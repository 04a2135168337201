"""
Write the versions of an environment that the extras need, as constraints of pip.

One command writes them anew after a whole run of the tests: ``make constraints``. The container and
CI install these versions; users' installations are bound by ``pyproject.toml`` alone.
"""

import sys
import tomllib
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PROJECT = Path(__file__).parents[2] / "pyproject.toml"

#: Extras that neither the container nor CI installs.
LEFT_OUT = ("benchmark",)


def tested_versions() -> dict[str, str]:
    """Return the installed version of every distribution that the project needs, by its name."""
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    waiting = [*project["dependencies"]]
    for name in extras.keys() - LEFT_OUT:
        waiting += extras[name]
    versions, seen = dict[str, str](), set[tuple[str, frozenset[str]]]()
    while waiting:
        requirement = Requirement(waiting.pop())
        name = canonicalize_name(requirement.name)
        need = (name, frozenset(requirement.extras))
        if name == "per-obspy" or need in seen:
            continue
        seen.add(need)
        try:
            found = distribution(name)
        except PackageNotFoundError:
            print(f"{name}: not installed, left open", file=sys.stderr)
            continue
        versions[name] = found.version
        # Requirements of this system, and of the extras that are asked for
        for text in found.requires or ():
            marker = Requirement(text).marker
            names = ("", *requirement.extras)
            if marker is None or any(marker.evaluate({"extra": extra}) for extra in names):
                waiting.append(text)
    return versions


if __name__ == "__main__":
    print("# Versions with which container and CI are tested, by `make constraints`.")
    print(f"# Linux, Python {sys.version_info[0]}.{sys.version_info[1]} and newer.")
    for name, version in sorted(tested_versions().items()):
        print(f"{name}=={version}")
