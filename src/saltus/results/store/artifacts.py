"""Small values that belong to all chunks of a store: one file each, with its name, the hash of its
store and a checksum inside.
"""

from __future__ import annotations

import base64
import re
from pathlib import Path
from typing import Any, Literal

from saltus.errors import ParameterError, shown
from saltus.results.store.durable import StoreError, read, write_whole
from saltus.results.store.lock import WHOLE, exclusive
from saltus.whole_files import seal, unseal


def put_artifact(
    store: Path,
    made_under: str,
    name: str,
    value: Any,
    *,
    existing: Literal["same", "keep", "replace"] = "same",
    shard: tuple[int, int] = WHOLE,
) -> None:
    """Keep a value: see :meth:`saltus.results.store.store.Store.put`.

    ``made_under`` is the hash of the store's head, ``shard`` the lock that this process holds.
    """
    content = (
        {"base64": base64.b64encode(value).decode()}
        if isinstance(value, bytes)
        else {"value": value}
    )
    data = seal({"name": name, "store": made_under, **content})
    file = _file(store, name)
    # shards may put at the same moment
    with exclusive(store / "locks" / "artifacts", patience=10.0):
        earlier = read(file)
        intact = _opened(earlier, made_under, name) is not None
        if intact and earlier == data:
            return
        if intact and existing == "same":
            raise StoreError(
                f"{store} keeps another {name!r} already. Use that one: get({name!r})."
            )
        if intact and existing == "replace" and shard != WHOLE:
            raise StoreError(
                f"{name!r} of {store} can only be replaced under the lock of the whole store."
            )
        if not intact or existing == "replace":
            write_whole(file, data, store / "parts", "artifact")


def get_artifact(store: Path, made_under: str, name: str) -> Any:
    """The value; :class:`StoreError` if there is none, or it is damaged."""
    data = read(_file(store, name))
    values = _opened(data, made_under, name)
    if values is None:
        state = "has no" if data is None else "has a damaged"
        raise StoreError(f"{store} {state} {name!r}. Compute it again: put() takes its place.")
    return base64.b64decode(values["base64"]) if "base64" in values else values["value"]


def has_artifact(store: Path, made_under: str, name: str) -> bool:
    """Whether there is one that isn't damaged."""
    return _opened(read(_file(store, name)), made_under, name) is not None


def _opened(data: bytes | None, made_under: str, name: str) -> dict[str, Any] | None:
    """What an artifact holds; None if it is damaged, or is another one, or another store's."""
    values = unseal(data or b"")
    return (
        values
        if values is not None and (values.get("name"), values.get("store")) == (name, made_under)
        else None
    )


def _file(store: Path, name: str) -> Path:
    if not re.fullmatch(r"[\w-]+", name, re.ASCII):
        raise ParameterError(f"artifact {shown(name)}: use letters, digits, _ and -.")
    return store / "artifacts" / f"{name}.json"
