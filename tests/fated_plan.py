"""A plan for tests of workers: in a file that a process of theirs can import."""

import os
import signal
from types import SimpleNamespace


class Plan:
    """A plan whose chunks are numbers, or what befalls a worker."""

    def __init__(self, fate=""):
        self.fate = fate

    def map(self, _):
        return SimpleNamespace(launch=lambda *_: None)

    def starts(self, cells):
        return cells

    def cells_of(self, chunk):
        return [chunk]

    def chunk(self, index, found, _map=None):
        if self.fate == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        if self.fate == "fails":
            raise ZeroDivisionError("a chunk without cells")
        return index * found
