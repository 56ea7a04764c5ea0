"""The fence: files and texts that come from outside are looked at here before anything else reads
them.

Every reader of studies, tables and results asks the same questions in the same place: is it a
regular file, is it of a sensible size, is it text, does it hold what could hurt a terminal or a
parser. The answer is a :class:`RefusedError`; its text goes on after the file's name.
"""

from __future__ import annotations

import errno
import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

from saltus.sentences import shown

#: Largest study, and largest table that it names [bytes].
STUDY_BYTES, TABLE_BYTES = 1_000_000, 10_000_000
#: Most bytes of a file of JSON in a store.
STORED_BYTES = 100_000_000
#: Most parts of a dotted key of TOML, and most levels of tables and lists: parsers take the square
#: of it, or run out of stack.
PARTS, LEVELS = 100, 20
#: Most characters of a key.
KEY = 100
#: Largest whole numbers allowed: of periods, whose times keep some digits; of objects in memory.
MOST_PERIODS, MOST_COUNT = 10**12, 2**31 - 1

#: Characters that a terminal or a file would obey, not show: control characters but tab and line
#: ends, and those that turn the direction of text.
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
_TOKENS = re.compile(
    r"""("(?:[^"\\\n]|\\[^\n])*"|'[^'\n]*'|[^.,=\[\]{}\n"'#]+)|(\#[^\n]*|[,=\[\]{}\n])|(\.)|."""
)
#: A cell that is a number, with a unit or without: no spreadsheet takes it for a formula.
_NUMBER = re.compile(r"[+-]?(\d[\d.]*(e[+-]?\d+)?|inf|nan)?( [\w%°/^·*()µΩ-]+)?", re.IGNORECASE)


class RefusedError(ValueError):
    """Something from outside isn't let in; the text says why, as the rest of a sentence about it.

    Attributes
    ----------
    errno : int or None
        What the operating system said; None if the file can be opened, but isn't one that is let
        in.
    """

    def __init__(self, why: str, errno: int | None = None) -> None:
        super().__init__(why)
        self.errno = errno


# -- files -----------------------------------------------------------------------------------------
def regular(path: Path) -> None:
    """Refuse anything but a regular file: a folder, a pipe that would block for ever, a device that
    never ends.
    """
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError) as error:
        raise RefusedError(
            f"can't be read: {getattr(error, 'strerror', None) or error}.",
            getattr(error, "errno", None),
        ) from None
    if stat.S_ISDIR(mode):
        raise RefusedError("can't be read: it is a folder, not a file.", errno.EISDIR)
    if not stat.S_ISREG(mode):
        raise RefusedError("can't be read: it is a pipe, a device or a socket, not a file.")


def content(path: Path, most: int) -> bytes:
    """The bytes of a regular file of at most ``most`` bytes.

    Raises
    ------
    RefusedError
        If it is larger, something else than a regular file, or can't be read.
    """
    # asked first, since opening some devices does something; and again of what was opened
    regular(path)
    try:
        with open(
            os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)),
            "rb",
        ) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise RefusedError("can't be read: it is no regular file.")
            data = file.read(most + 1)
    except OSError as error:
        raise RefusedError(f"can't be read: {error.strerror or error}.", error.errno) from None
    if len(data) > most:
        raise RefusedError(
            f"can't be read: it is larger than {most / 1e6:g} MB, which nothing of this kind is."
        )
    return data


# -- texts -----------------------------------------------------------------------------------------
def text(data: bytes) -> str:
    """UTF-8 text, with or without the mark that Windows puts before it. Raises RefusedError for
    control characters.
    """
    try:
        found = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise RefusedError("can't be read: it isn't UTF-8 text.") from None
    control = _CONTROL.search(found)
    if control:
        line = found.count("\n", 0, control.start()) + 1
        raise RefusedError(
            f"can't be read: line {line} holds the control character U+{ord(control[0]):04X}."
        )
    return found


def has_control(value: str) -> bool:
    """True if a text holds characters that a terminal would obey."""
    return bool(_CONTROL.search(value))


def printable(value: str) -> str:
    """A text without them."""
    return _CONTROL.sub("", value)


def csv_cell(value: Any) -> Any:
    """A cell that no spreadsheet takes for a formula: one that begins like a formula gets an
    apostrophe.
    """
    if (
        isinstance(value, str)
        and value[:1] in ("=", "+", "-", "@", "\t", "\r")
        and not _NUMBER.fullmatch(value)
    ):
        return f"'{value}"
    return value


# -- TOML ------------------------------------------------------------------------------------------
def toml(source: str) -> dict[str, Any]:
    """The data of a TOML text: text without control characters, keys and whole numbers of a
    sensible size, not too many levels.

    Raises
    ------
    RefusedError
        If it holds something else.
    tomllib.TOMLDecodeError
        If it isn't TOML.
    """
    _short_keys(source)
    try:
        data = tomllib.loads(source)
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        raise RefusedError(f"has lists or tables nested deeper than {LEVELS} levels.") from None
    except ValueError:
        raise RefusedError("holds a whole number with more digits than any quantity has.") from None
    _plain(data)
    return data


def _short_keys(source: str) -> None:
    """Refuse a key of very many parts, a.a.a.a..., over which the parser takes minutes."""
    parts = 0
    for _, ends, dot in _TOKENS.findall(source):
        parts = 0 if ends else parts + bool(dot)
        if parts > PARTS:
            raise RefusedError(f"holds a key of more than {PARTS} parts.")


def _plain(data: dict[str, Any]) -> None:
    waiting: list[tuple[str, Any, int]] = [("", data, 0)]
    while waiting:
        key, value, level = waiting.pop()
        if level > LEVELS:
            raise RefusedError(f"has lists or tables nested deeper than {LEVELS} levels.")
        if isinstance(value, dict):
            for name, inner in value.items():
                if has_control(name) or len(name) > KEY:
                    raise RefusedError(
                        f"holds the key {shown(name, 40)}: keys are words of "
                        f"at most {KEY} characters."
                    )
                waiting.append((name, inner, level + 1))
        elif isinstance(value, list):
            waiting += [(key, inner, level + 1) for inner in value]
        elif isinstance(value, str) and has_control(value):
            raise RefusedError(f"holds a control character in {key!r}. Write plain text.")
        elif isinstance(value, int) and abs(value) >= 2**63:
            raise RefusedError(
                f"holds a whole number in {key!r} of 2^63 or more. Write a large value as 1e30."
            )
