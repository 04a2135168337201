"""Paths that GDAL takes literally, whatever characters they have."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from per_obspy.files import scratch_folder


@contextmanager
def literal_path(path: Path) -> Iterator[Path]:
    """
    Return a path by which GDAL reads or writes exactly this file.

    pyogrio takes some names for archives or addresses (``a!b``, ``zip:x``) and drops line breaks.
    Such a file is reached by a link with a plain name, and so are the files that belong to it.

    Parameters
    ----------
    path : Path
        A file that exists or is to be written.

    Yields
    ------
    Path
        Absolute.
    """
    from pyogrio.util import vsi_path  # loads GDAL

    place = path.absolute()
    if vsi_path(str(place)) == str(place) and not str(place).startswith("/vsi"):
        yield place
        return
    with scratch_folder() as plain:
        # A file that is written is reached by its folder, as its journal lies there too
        if not place.exists():
            (plain / "folder").symlink_to(place.parent, target_is_directory=True)
            yield plain / "folder" / place.name
            return
        for part in place.parent.iterdir():
            if part.stem == place.stem:
                (plain / f"layer{part.suffix}").symlink_to(part)
        yield plain / f"layer{place.suffix}"
