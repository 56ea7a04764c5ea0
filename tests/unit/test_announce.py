"""What is said to somebody who waits."""

import io
import os
import sys
import time

import pytest

from saltus import announce


@pytest.fixture
def impatient(monkeypatch):
    monkeypatch.setattr(announce, "PATIENCE", 0.01)
    monkeypatch.setattr(announce, "EVERY", 0.01)


def wait_for(said):
    begun = time.monotonic()
    while not said() and time.monotonic() - begun < 20:
        time.sleep(0.01)


def test_long_work_says_once_what_it_is(impatient):
    lines = []
    with (
        announce.announcing_to(lines.append),
        announce.working(lambda: "compiling rig (2 walls)"),
        announce.working(lambda: "a part"),
    ):
        wait_for(lambda: lines)
    assert lines == ["compiling rig (2 walls), 0 s so far"]


def test_work_that_ends_soon_or_silently_says_nothing(impatient, capfd):
    with announce.silent(), announce.working(lambda: "compiling"):
        time.sleep(0.1)
    announce.PATIENCE = 60.0
    with announce.working(lambda: "compiling"):
        pass
    assert capfd.readouterr().err == ""


def test_on_a_terminal_the_line_is_gone_afterwards_even_when_stopped(impatient, monkeypatch):
    terminal = io.StringIO()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(sys, "__stderr__", terminal)
    monkeypatch.setattr(os, "isatty", lambda _: True)

    def stopped():
        with announce.working(lambda: "tracing rig"):
            wait_for(terminal.getvalue)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    assert "saltus: tracing rig, 0 s so far" in terminal.getvalue()
    assert terminal.getvalue().endswith("\r\x1b[K")
    assert "\n" not in terminal.getvalue()
