"""Files of a report, and files that could not be written."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from per_obspy.errors import PerError
from per_obspy.files import remove_file


class Report(NamedTuple):
    """
    Files that the report has written.

    Attributes
    ----------
    outputs : list of Path
        Its files.
    faults : list of str
        Figures and layers that could not be made, each with the reason.
    """

    outputs: list[Path]
    faults: list[str]

    @contextmanager
    def tried(self, *paths: Path) -> Iterator[None]:
        """Note the files that a block writes, or one line on the fault that prevents them."""
        try:
            yield
        except (PerError, OSError, MemoryError):
            raise
        except Exception as error:  # noqa: BLE001 - whatever a library has against a picture
            # Pictures of an earlier table are none of this one
            for path in paths:
                remove_file(path)
            reason = " ".join(str(error).split())
            self.faults.append(f"{paths[0]}: cannot be drawn: {type(error).__name__} {reason:.200}")
        else:
            self.outputs.extend(paths)
