"""Who is notified of results and failures, and how."""

import re
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from per_obspy.config.section import RelativePath, Section

#: Kinds of messages.
Kind = Literal["first", "changed", "failure"]

#: Credentials inside an address, which other users of the machine see among its processes.
_CREDENTIALS = re.compile(r"://[^/\s]*@|(token|password|passwd|secret|api_?key)=", re.IGNORECASE)


def _without_secret(argument: str) -> str:
    """Return an argument of a command that holds no address with a password or token."""
    if _CREDENTIALS.search(argument):
        raise ValueError(
            "an argument holds a password or token, which every process list shows: let the "
            "command read it from its environment"
        )
    if "\0" in argument:
        raise ValueError("an argument holds a NUL character")
    return argument


Argument = Annotated[str, AfterValidator(_without_secret)]


class Notify(Section):
    """Messages about first results, changed class counts and failures (docs/operation.md)."""

    on: tuple[Kind, ...] = Field(
        ("first", "changed", "failure"),
        description=(
            "occasions of messages: first (first result), changed (number of pairs in a "
            "class changed), failure"
        ),
    )
    command: tuple[Argument, ...] = Field(
        (),
        description=(
            "program and arguments, started without a shell; the message is its standard "
            "input, and PER_OBSPY_KIND, PER_OBSPY_TITLE, PER_OBSPY_FOLDER and "
            "PER_OBSPY_REPORT are in its environment"
        ),
    )
    apprise_urls_variable: str | None = Field(
        None,
        pattern="^[A-Za-z_][A-Za-z0-9_]*$",
        description=(
            "name of the environment variable with Apprise URLs, separated by blanks; needs "
            "per_obspy[notify]"
        ),
    )
    apprise_urls_file: RelativePath | None = Field(
        None,
        description=(
            "file with one Apprise URL per line, which only its owner may read (chmod 600); needs "
            "per_obspy[notify]"
        ),
    )
    timeout: float = Field(
        30.0, gt=0, le=600, description="longest time of a command or delivery, s"
    )

    @property
    def is_silent(self) -> bool:
        """Whether no way to notify is configured."""
        ways = (self.command, self.apprise_urls_variable, self.apprise_urls_file)
        return not self.on or not any(ways)

    @model_validator(mode="after")
    def _one_list_of_urls(self) -> Self:
        if self.apprise_urls_variable and self.apprise_urls_file:
            raise ValueError("give either apprise_urls_variable or apprise_urls_file")
        if self.command and not self.command[0].strip():
            raise ValueError("command: its first word, the program, is empty")
        return self
