"""A plan for tests of workers: in a file that a process of theirs can import."""

import os
import signal


class Plan:
    """A plan whose chunks are numbers, or what befalls a worker."""

    def __init__(self, fate=""):
        self.fate = fate

    def prepare(self):
        pass

    def chunk(self, index, shared):
        if self.fate == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        if self.fate == "fails":
            raise ZeroDivisionError("a chunk without cells")
        return index * shared
