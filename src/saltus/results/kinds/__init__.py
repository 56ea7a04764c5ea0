"""Kinds of result, one file each: variables, account, rows, and ``KIND``, which holds them."""

from importlib import import_module

from saltus.results.dataset.schema import KINDS, NAMES

KINDS.update({name: import_module(f"{__name__}.{name}").KIND for name in NAMES})
