"""
Delivery of one message by Apprise: ``python -m per_obspy.watch.apprise_delivery``.

Standard input holds the number of URLs, the URLs, the title, each on a line, and the text. Prints
no word: addresses hold secrets.
"""

import logging
import sys

from per_obspy.watch.notification import UNDELIVERED


def main() -> int:
    """Deliver the message of the standard input, and return the exit code."""
    import apprise

    logging.getLogger("apprise").addHandler(logging.NullHandler())
    count, *lines = sys.stdin.read().split("\n")
    urls, (title, *text) = lines[: int(count)], lines[int(count) :]
    services = apprise.Apprise()
    # Every URL gets its message, also after one that is wrong
    known = [services.add(url) for url in urls]
    is_sent = bool(len(services)) and services.notify(title=title, body="\n".join(text))
    return 0 if is_sent and all(known) else UNDELIVERED


if __name__ == "__main__":
    sys.exit(main())
