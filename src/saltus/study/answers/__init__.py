"""What every question of a study comes to: a Dataset, in rows, drawn. A file each; a new one is
found here.
"""

import functools
import importlib
import pkgutil
from collections.abc import Mapping

from saltus.study.answers.question import REGISTER, RegisteredTable


@functools.cache
def questions() -> Mapping[str, RegisteredTable]:
    """Every table of study files that asks something, in the order in which they are answered."""
    for file in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{file.name}")
    return dict(sorted(REGISTER.items(), key=lambda entry: entry[1].rank))
