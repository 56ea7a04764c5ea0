"""One entry of the cache: a file that is read at once, through one handle, and used only if its
owner and its checksum are right.

What stands in it is code. So it counts only if it is a regular file of this user (or of the
administrator) that nobody else may write to; that is asked of the opened file, so nothing can be
exchanged between the question and the reading.
"""

from __future__ import annotations

import contextlib
import json
import os
import stat
import uuid
from pathlib import Path

from saltus.whole_files import put, sha256

#: First word of an entry; it differs for other formats.
FORMAT = "saltus-kernel/1"
#: Prefix of the names of unfinished entries.
DRAFT = ".building-"
#: Largest entry [bytes]: some hundred times the size for the largest equations.
MOST = 1 << 28
#: Permission bits with which others than the owner may write.
_GROUP, _OTHERS = stat.S_IWGRP, stat.S_IWOTH


class NotOurs(Exception):  # noqa: N818  (a finding about a file, not an error)
    """A file or folder that others could have written; its text says why."""


class Damaged(Exception):  # noqa: N818
    """An entry that was changed after it was written."""


def check_ours(seen: os.stat_result) -> None:
    """Raise NotOurs unless this user or the administrator owns it and nobody else may
    write to it.
    """
    if not hasattr(os, "geteuid"):  # Windows: a user's folders are closed to others by default
        return
    me = os.geteuid()
    if seen.st_uid not in (me, 0):
        raise NotOurs("belongs to another user")
    if seen.st_mode & _OTHERS or (seen.st_mode & _GROUP and not _private_group(seen.st_gid, me)):
        raise NotOurs("can be written to by other users")


def _private_group(group: int, user: int) -> bool:
    """True if a group belongs to this user alone. That is the common default, with files writable
    to the group.
    """
    import grp
    import pwd

    try:
        entry, person = grp.getgrgid(group), pwd.getpwuid(user)
    except KeyError:
        return False
    return (
        person.pw_gid == group
        and entry.gr_name == person.pw_name
        and not set(entry.gr_mem) - {person.pw_name}
    )


def check_folder(folder: Path) -> None:
    """Raise NotOurs unless a folder, and the link to it if there is one, belong to this user alone;
    OSError if it doesn't exist.
    """
    link = os.lstat(folder)
    if (
        stat.S_ISLNK(link.st_mode)
        and hasattr(os, "geteuid")
        and link.st_uid not in (os.geteuid(), 0)
    ):
        raise NotOurs("is a link that belongs to another user")
    check_ours(os.stat(folder))


def write(path: Path, title: str, data: bytes) -> None:
    """Write an entry in full, then give it its name, read-only."""
    header = {
        "format": FORMAT,
        "key": path.stem,
        "title": title,
        "sha256": sha256(data),
    }
    draft = path.with_name(f"{DRAFT}{uuid.uuid4().hex}")
    put(path, json.dumps(header).encode() + b"\n" + data, draft, lasting=False, mode=0o400)


def read(path: Path) -> bytes:
    """The bytes of an entry.

    Raises
    ------
    FileNotFoundError
        If there is none.
    NotOurs, Damaged
        If it isn't to be used.
    """
    header, data = _split(_content(path))
    try:
        fields = json.loads(header)
        intact = (
            fields["format"] == FORMAT
            and fields["key"] == path.stem
            and fields["sha256"] == sha256(data)
        )
    except (ValueError, KeyError, TypeError, RecursionError):
        intact = False
    if not intact:
        raise Damaged("is damaged")
    return data


def title_of(path: Path) -> str:
    """The title of an entry, for a list of entries."""
    try:
        return str(json.loads(_split(_content(path))[0])["title"])
    except (OSError, NotOurs, Damaged, ValueError, KeyError, TypeError, RecursionError):
        return "(damaged)"


def _content(path: Path) -> bytes:
    flags = (
        os.O_RDONLY
        | getattr(os, "O_NOFOLLOW", 0)
        | getattr(os, "O_NONBLOCK", 0)
        | getattr(os, "O_BINARY", 0)
    )
    try:
        handle = os.open(path, flags)
    except FileNotFoundError:
        raise
    except OSError as error:  # a link, above all
        raise NotOurs(f"can't be opened as a plain file ({error.strerror})") from None
    seen = os.fstat(handle)
    if not stat.S_ISREG(seen.st_mode):
        os.close(handle)
        raise NotOurs("is no plain file")
    with os.fdopen(handle, "rb") as file:
        check_ours(seen)
        if seen.st_size > MOST:
            raise Damaged("is larger than any kernel")
        return file.read(MOST)


def _split(content: bytes) -> tuple[bytes, bytes]:
    header, newline, data = content.partition(b"\n")
    if not newline:
        raise Damaged("is damaged")
    return header, data


def remove(path: Path) -> None:
    """Delete a file, if possible."""
    with contextlib.suppress(OSError):
        if os.name == "nt":  # read-only files can't be deleted there
            os.chmod(path, 0o600)
        path.unlink()
