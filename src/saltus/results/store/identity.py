"""Identity of a kept result: the result answers another question only if nothing differs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from saltus.errors import ParameterError, shown
from saltus.results.store.durable import StoreError


def texts(identity: Mapping[str, str]) -> dict[str, str]:
    """Texts of an identity, sorted.

    Raises
    ------
    ParameterError
        If a value isn't text: 1 and 1.0 would be equal or not, depending on who compares.
    """
    for name, value in identity.items():
        if not isinstance(value, str):
            raise ParameterError(
                f"identity {name!r} is {shown(value)}. Give it as text, so that "
                f"it can be compared without doubt."
            )
    return dict(sorted(identity.items()))


def differing(there: Mapping[str, str], here: Mapping[str, str]) -> list[str]:
    """Names of texts that differ between a kept result and a question, or that only one of them
    has.
    """
    return [name for name in {**there, **here} if there.get(name) != here.get(name)]


def agree(path: Path, there: Mapping[str, str], here: Mapping[str, str]) -> None:
    """Compare the identity of a store with that of a computation that would resume it.

    Raises
    ------
    StoreError
        If a value differs, or only one of them has it: names each, with both values.
    """
    differ = differing(there, here)
    if differ:
        both = [
            (name, _near(there.get(name), here.get(name)), _near(here.get(name), there.get(name)))
            for name in differ
        ]
        raise StoreError(
            f"{path} was made from something else: "
            f"{'; '.join(f'{name} was {old}, is {new}' for name, old, new in both)}. "
            "Nothing was changed. Choose another path, or go back to what made it."
        )


def _near(text: str | None, other: str | None) -> str:
    """Shorten a text to the part where it differs from another."""
    if text is None:
        return "not set"
    same = next(
        (i for i, (a, b) in enumerate(zip(text, other or "", strict=False)) if a != b),
        min(len(text), len(other or "")),
    )
    start = max(0, same - 12)
    return repr(
        ("…" if start else "") + text[start : start + 40] + ("…" if len(text) > start + 40 else "")
    )
