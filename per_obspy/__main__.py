"""``python -m per_obspy`` is ``per-obspy``."""

from per_obspy.cli.application import main

if __name__ == "__main__":
    main()
