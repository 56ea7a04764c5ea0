"""Answers to the questions of a study: a Dataset, its rows, its pictures. Each question has a file
here; a new file is found by itself.
"""

import functools
import importlib
import pkgutil
from collections.abc import Mapping

from saltus.study.answers.question import REGISTER, RegisteredTable


@functools.cache
def questions() -> Mapping[str, RegisteredTable]:
    """Tables of the questions that a study file may ask, in the order in which they are
    answered.
    """
    for file in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{file.name}")
    return dict(sorted(REGISTER.items(), key=lambda entry: entry[1].rank))
