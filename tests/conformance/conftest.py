"""The contract is held by both exact methods: files that use ``exact_method`` are run by each."""

from __future__ import annotations

import pytest

from saltus.flow import methods


def pytest_generate_tests(metafunc):
    """Cases that don't name a method are run by each of the two."""
    if "exact_method" in metafunc.fixturenames and "method" not in metafunc.fixturenames:
        metafunc.parametrize("exact_method", ["Taylor", "Modal"], indirect=True)


@pytest.fixture
def exact_method(request, monkeypatch):
    """The name of the method that moves what a case simulates, where it doesn't name one itself. A
    case ends where a system isn't one of the modal flow.
    """
    name = getattr(request, "param", "Taylor")
    if name == "Modal":
        monkeypatch.setattr(methods, "default_method", _by_modes)
    return name


def _by_modes(system):
    """The modal flow, if it serves a system: else the case is skipped, and the reason told."""
    if methods.Modal().serving(system.origin) != methods.Modal():
        pytest.skip(methods.note_on(methods.Modal(), system))
    return methods.Modal()
