"""Store: a map computed chunk by chunk, by one process or many, killed and resumed at any time,
with one outcome.

::

    store.json      identity, shape, what is kept                   written once, at creation
    chunks/7.chunk  all arrays of chunk 7                           a checksum inside
    artifacts/      small values that all chunks share              a checksum inside
    locks/, parts/  who is writing; drafts that a kill left behind  no part of the outcome

Chunks and artifacts hold their number or name and the hash of ``store.json``: in another place, or
another store, they count as damaged. No file holds a time, a host or an order, so a finished store
is the same bit by bit however it came about.
"""

from __future__ import annotations

import base64
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

import numpy as np

from saltus import fence
from saltus.errors import ParameterError, shown
from saltus.results.store.chunks import TRAILER, Chunks
from saltus.results.store.draft_folder import remove_old_drafts, write_folder
from saltus.results.store.durable import (
    StoreError,
    read,
    size,
    tail,
    write_whole,
)
from saltus.results.store.head import (
    CHUNKS,
    HEAD,
    fingerprint,
    head_of,
    mend_head,
    numbered,
    read_head,
)
from saltus.results.store.identity import agree, texts
from saltus.results.store.lock import WHOLE, exclusive, holders, locked
from saltus.whole_files import flush, refused_as, seal, unseal

__all__ = ["Store", "StoreError", "StoreStatus"]

_FOLDERS = (CHUNKS, "artifacts", "locks", "parts")


@dataclass(frozen=True)
class StoreStatus:
    """Progress of a store.

    Attributes
    ----------
    path : Path
    identity, note : dict
        As given at creation.
    done, total : int
        Chunks.
    damaged : int
        Chunks among ``done`` whose files aren't what was committed.
    bytes : int
        Size on the disk.
    last_written : datetime or None
        Time at which the last chunk was committed (UTC); None before the first.
    writers : tuple of str
        Holders of locks, each with the time since when.
    """

    path: Path
    identity: dict[str, str]
    note: dict[str, Any]
    done: int
    total: int
    damaged: int
    bytes: int
    last_written: datetime | None
    writers: tuple[str, ...]


class Store:
    """One map on the disk. Made by :meth:`create`, :meth:`open` or :meth:`create_or_resume`;
    reading needs no lock, writing does.

    Attributes
    ----------
    path : Path
    identity, note : dict
    chunks : Chunks
        Shape of the grid, cells in a chunk, arrays.
    """

    def __init__(self, path: Path, head: Mapping[str, Any]) -> None:
        self.path = path
        self.identity: dict[str, str] = head["identity"]
        self.note: dict[str, Any] = head["note"]
        self.chunks = Chunks.checked(tuple(head["shape"]), head["chunk"], head["arrays"])
        self._made_under = fingerprint(head)
        self._shard: tuple[int, int] | None = None
        self._process = 0

    # -- making and opening ------------------------------------------------------------------------
    @classmethod
    def create(
        cls,
        path: str | os.PathLike[str],
        identity: Mapping[str, str],
        *,
        shape: tuple[int, ...],
        chunk: int,
        arrays: Mapping[str, Any] | None,
        note: Mapping[str, Any] | None = None,
    ) -> Store:
        """Make an empty store. It appears under its name complete or not at all.

        Parameters
        ----------
        path : str or path
            A folder that isn't there yet, in one that is.
        identity : mapping of str to str
            Texts on which a process must agree to add chunks: hashes of study and system, versions,
            options.
        shape : tuple of int
            Size of the grid along each dim.
        chunk : int
            Cells of the flattened grid (C order) that are one task.
        arrays : mapping of str to dtype, or None
            Values kept of each cell; None for chunks of arrays of any shape.
        note : mapping, optional
            Anything else worth keeping with it, as plain values; never compared.

        Raises
        ------
        StoreError
            If something stands under the name, the folder around it is missing, or the disk is
            full.
        ParameterError
            If sizes, names or types can't be stored.
        """
        path = Path(path).resolve()
        chunks = Chunks.checked(shape, chunk, arrays)
        head = head_of(texts(identity), note or {}, chunks)
        if not path.parent.is_dir():
            raise StoreError(
                f"{path} can't be made: there is no folder {path.parent}. Make it first."
            )
        if path.exists():
            raise StoreError(
                f"{path} is there already. Resume it if it is a store, or choose "
                f"another path; nothing is overwritten."
            )
        store = cls(path, head)
        write_folder(path, {HEAD: seal(head)}, _FOLDERS)
        return store

    @classmethod
    def open(cls, path: str | os.PathLike[str], identity: Mapping[str, str] | None = None) -> Store:
        """Open a store.

        Parameters
        ----------
        path : str or path
            Its folder.
        identity : mapping of str to str, optional
            If given, it must be the store's.

        Raises
        ------
        StoreError
            If there is no store, its head is damaged, or the identity differs: names each value
            that does.
        """
        path = Path(path).resolve()
        store = cls(path, read_head(path))
        if identity is not None:
            agree(path, store.identity, texts(identity))
        return store

    @classmethod
    def create_or_resume(
        cls,
        path: str | os.PathLike[str],
        identity: Mapping[str, str],
        *,
        shape: tuple[int, ...],
        chunk: int,
        arrays: Mapping[str, Any] | None,
        note: Mapping[str, Any] | None = None,
    ) -> Store:
        """:meth:`create` if there is no store yet, else :meth:`open`; ``shape``, ``chunk`` and
        ``arrays`` must agree too.

        A ``store.json`` that is damaged is written again if the chunks beside it were made from the
        same.
        """
        if not Path(path).exists():
            try:
                return cls.create(
                    path, identity, shape=shape, chunk=chunk, arrays=arrays, note=note
                )
            except StoreError:
                if not Path(path).exists():  # else another process was faster
                    raise
        wanted = Chunks.checked(shape, chunk, arrays)
        mend_head(Path(path).resolve(), head_of(texts(identity), note or {}, wanted))
        store = cls.open(path)
        agree(
            store.path, store.identity | store.chunks.as_text(), texts(identity) | wanted.as_text()
        )
        return store

    # -- one writer --------------------------------------------------------------------------------
    @contextmanager
    def lock(self, shard: tuple[int, int] | None = None) -> Iterator[Store]:
        """Be the only one who writes the store, or one shard of it, within a ``with`` block.

        The operating system keeps the lock: it ends with the process, however that ends. What a
        killed writer left half-done is removed.

        Parameters
        ----------
        shard : tuple of int, optional
            (k, n): the chunks i with i % n == k. Writers of different shards may work at the same
            time.

        Raises
        ------
        StoreError
            If an overlapping lock is held: names host, process and since when.
        """
        shard = _checked(shard)
        self._make_folders()
        with locked(self.path / "locks", shard):
            self._sweep(shard)
            self._shard, self._process = shard, os.getpid()
            try:
                yield self
            finally:
                self._shard = None

    def _make_folders(self) -> None:
        """Make missing folders again: tools that copy folders leave empty ones out. A deleted store
        isn't made again.
        """
        if not (self.path / HEAD).exists():
            raise StoreError(
                f"{self.path} holds no {HEAD} any more. Was it moved or deleted? "
                f"Start again to make it anew."
            )
        advice = "Mend its permissions or the disk."
        with refused_as(StoreError, f"{self.path} can't be written to", advice):
            for name in _FOLDERS:
                (self.path / name).mkdir(parents=True, exist_ok=True)

    def _sweep(self, shard: tuple[int, int]) -> None:
        """Remove the drafts of killed writers that only the holder of this lock may write."""
        remove_old_drafts(self.path)
        for draft in (self.path / "parts").iterdir():
            owner = draft.name.split(".")[0]
            if shard == WHOLE or (owner.isdecimal() and int(owner) % shard[1] == shard[0]):
                draft.unlink(missing_ok=True)

    def _held(self) -> tuple[int, int]:
        if self._shard is None or self._process != os.getpid():
            raise StoreError(
                f"{self.path} isn't locked by this process. Write within `with store.lock():`."
            )
        return self._shard

    # -- chunks ------------------------------------------------------------------------------------
    def commit(self, index: int, values: Mapping[str, np.ndarray]) -> None:
        """Write one chunk, complete or not at all.

        Committing the same values again does nothing.

        Parameters
        ----------
        index : int
            Number of the chunk.
        values : mapping of str to ndarray (cells,)
            Every array of the store, with the cells ``store.chunks.extent(index)``.

        Raises
        ------
        StoreError
            If the lock isn't held, the disk is full, or the chunk was committed with other values.
        ParameterError
            If an array is missing or unknown, or has the wrong size or type.
        """
        k, n = self._held()
        index = int(index)
        if index % n != k:
            raise StoreError(
                f"chunk {index} of {self.path} belongs to shard {index % n} of {n}, "
                f"and the lock is for shard {k}."
            )
        data = self.chunks.encode(index, values, self._made_under)
        earlier = read(self._file(index))
        if earlier == data:
            return
        if earlier is not None:
            raise StoreError(
                f"chunk {index} of {self.path} is done, with other values. Either its file is "
                f"damaged (verify() tells), "
                "or the same cells came out differently on two machines: then compute all chunks "
                "on one kind of machine."
            )
        write_whole(self._file(index), data, self.path / "parts", str(index))

    def done(self) -> np.ndarray:
        """Return which chunks are committed: bool (chunks,). It lists one folder only, so it shows
        progress from any machine.
        """
        done = np.zeros(self.chunks.count, dtype=bool)
        with refused_as(StoreError, f"{self.path} can't be read", "Was it moved or deleted?"):
            there = numbered(self.path)
        done[[index for index in there if index < len(done)]] = True
        return done

    def missing(self, shard: tuple[int, int] | None = None) -> list[int]:
        """Chunks that are not committed, those of one shard (k, n) only if given, in
        rising order.
        """
        k, n = _checked(shard)
        return [int(index) for index in np.flatnonzero(~self.done()) if index % n == k]

    def read(self, index: int) -> dict[str, np.ndarray]:
        """Values of one chunk, by array.

        Raises
        ------
        StoreError
            If it isn't committed, or isn't what was committed.
        """
        self.chunks.extent(index)
        data = self._bytes(index)
        values = self.chunks.decode(index, data, self._made_under) if data is not None else None
        if values is None and not self._file(index).exists():
            raise StoreError(
                f"chunk {index} of {self.path} isn't computed yet. Resume the store to compute it."
            )
        if values is None:
            raise StoreError(
                f"chunk {index} of {self.path} is damaged. verify() marks it as "
                f"missing, so that resuming computes it again."
            )
        return values

    def read_all(self) -> dict[str, np.ndarray]:
        """Values of all cells, by array: (cells,), the grid in C order.

        Raises
        ------
        StoreError
            If a chunk isn't committed or is damaged.
        """
        missing = self.missing()
        if missing:
            raise StoreError(
                f"{self.path} isn't complete: {len(missing)} of {self.chunks.count} chunks are "
                f"missing (first: {missing[0]}). Resume it."
            )
        assert self.chunks.arrays is not None
        values = {
            name: np.empty(self.chunks.cells, dtype) for name, dtype in self.chunks.arrays.items()
        }
        for index in range(self.chunks.count):
            for name, part in self.read(index).items():
                values[name][self.chunks.extent(index)] = part
        return values

    def verify(self) -> list[int]:
        """Check every committed chunk (of the shard whose lock is held) against its checksums;
        damaged ones become missing again.

        Returns
        -------
        list of int
            The damaged chunks.
        """
        k, n = self._held()
        damaged = [index for index in self.damaged() if index % n == k]
        for index in damaged:
            self._file(index).unlink(missing_ok=True)
        if damaged:
            flush(self.path / CHUNKS)
        return damaged

    def damaged(self, *, checksums: bool = True) -> list[int]:
        """Committed chunks whose files have changed; without ``checksums`` only sizes and last
        bytes are checked.
        """
        intact = self._is_intact if checksums else self._seems_intact
        return [int(index) for index in np.flatnonzero(self.done()) if not intact(int(index))]

    def _is_intact(self, index: int) -> bool:
        data = self._bytes(index)
        return data is not None and self.chunks.decode(index, data, self._made_under) is not None

    def _seems_intact(self, index: int) -> bool:
        file = self._file(index)
        return self.chunks.size(index) in (None, size(file)) and self.chunks.fits(
            index, tail(file, TRAILER), self._made_under
        )

    def _bytes(self, index: int) -> bytes | None:
        return read(self._file(index), self.chunks.size(index) or fence.STORED_BYTES)

    def _file(self, index: int) -> Path:
        return self.path / CHUNKS / f"{index}.chunk"

    # -- artifacts ---------------------------------------------------------------------------------
    def put(
        self, name: str, value: Any, *, existing: Literal["same", "keep", "replace"] = "same"
    ) -> Any:
        """Keep a small value that belongs to all chunks, such as the table of attractors.

        Parameters
        ----------
        name : str
            Letters, digits, ``_`` and ``-``.
        value : bytes or plain values
            As JSON has them: None, booleans, numbers, text, lists, dicts with text keys.
        existing : {"same", "keep", "replace"}
            If there is one: it must be the same; the first one stays; the new one takes its place
            (whole lock only). A damaged one counts as none.

        Returns
        -------
        bytes or plain values
            The value that is kept now. With "keep", another shard may have put it first.

        Raises
        ------
        StoreError
            If the lock isn't held, the disk is full, or another value is kept.
        """
        held, file = self._held(), self._artifact(name)
        content = (
            {"base64": base64.b64encode(value).decode()}
            if isinstance(value, bytes)
            else {"value": value}
        )
        data = seal({"name": name, "store": self._made_under, **content})
        # Other shards may put at the same moment.
        with exclusive(self.path / "locks" / "artifacts", patience=10.0):
            earlier = read(file)
            another = self._opened(name, earlier) is not None and earlier != data
            if another and existing == "same":
                raise StoreError(
                    f"{self.path} keeps another {name!r} already. Use that one: get({name!r})."
                )
            if another and existing == "replace" and held != WHOLE:
                raise StoreError(
                    f"{name!r} of {self.path} can only be replaced under the lock of the whole "
                    f"store."
                )
            if earlier != data and (not another or existing == "replace"):
                write_whole(file, data, self.path / "parts", "artifact")
        return self.get(name)

    def get(self, name: str) -> Any:
        """Return what :meth:`put` kept, with lists for tuples. Raises :class:`StoreError` if there
        is none, or it is damaged.
        """
        data = read(self._artifact(name))
        values = self._opened(name, data)
        if values is None:
            state = "has no" if data is None else "has a damaged"
            raise StoreError(
                f"{self.path} {state} {name!r}. Compute it again: put() takes its place."
            )
        return base64.b64decode(values["base64"]) if "base64" in values else values["value"]

    def has(self, name: str) -> bool:
        """True if :meth:`get` would return something: kept, and not damaged."""
        return self._opened(name, read(self._artifact(name))) is not None

    def _opened(self, name: str, data: bytes | None) -> dict[str, Any] | None:
        return unseal(data, name=name, store=self._made_under)

    def _artifact(self, name: str) -> Path:
        if not re.fullmatch(r"[\w-]+", name, re.ASCII):
            raise ParameterError(f"artifact {shown(name)}: use letters, digits, _ and -.")
        return self.path / "artifacts" / f"{name}.json"

    # -- for people --------------------------------------------------------------------------------
    def status(self, *, checksums: bool = False) -> StoreStatus:
        """Return the progress of the store; no lock needed.

        Parameters
        ----------
        checksums : bool
            Read everything to count damaged chunks. Otherwise only files that are gone or too short
            are counted.
        """
        return StoreStatus(
            path=self.path,
            identity=self.identity,
            note=self.note,
            done=int(self.done().sum()),
            total=self.chunks.count,
            damaged=len(self.damaged(checksums=checksums)),
            bytes=sum(size(file) or 0 for file in self.path.rglob("*")),
            last_written=self._last_written(),
            writers=tuple(holders(self.path / "locks")),
        )

    def _last_written(self) -> datetime | None:
        times = []
        for file in numbered(self.path).values():
            with suppress(FileNotFoundError):  # a writer that verifies has just dropped it
                times.append(file.stat().st_mtime)
        return datetime.fromtimestamp(max(times), UTC) if times else None


def _checked(shard: tuple[int, int] | None) -> tuple[int, int]:
    k, n = shard or WHOLE
    if not 0 <= k < n:
        raise ParameterError(f"shard {k} of {n}: they are numbered from 0 to n - 1.")
    return int(k), int(n)
