"""saltus: the toolkit for vibration with contacts - freeplay, backlash, stops, impacts, friction.

>>> import saltus as sl
>>> rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
>>> run = sl.simulate(rig, start=(0.0, 0.0), periods=2)
>>> run.sizes["contact"] > 0
True

Names are imported when they are first used, so that `import saltus` and `saltus --help` are quick.
"""

from __future__ import annotations

import importlib
import re
import sys
from typing import Any

__version__ = "0.2.0"

#: Public name: module that holds it. They stand in the stub, which type checkers read too.
with open(f"{__file__}i", encoding="utf-8") as _stub:
    _NAMES = re.findall(r"^from (\S+) import \(?\s*(\w+) as", _stub.read(), re.MULTILINE)
_HOMES = {name: home for home, name in _NAMES}
__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    from saltus.interrupt import ctrl_c_waits

    if name.startswith("_"):  # inspect, doctest and pytest ask for many of these
        raise AttributeError(name, name=name, obj=sys.modules[__name__])
    if name not in _HOMES:
        from saltus.system.elsewhere import instead

        message = f"saltus has no {name!r}. {instead(name, __all__)}"
        raise AttributeError(message, name=name, obj=sys.modules[__name__])
    with ctrl_c_waits():
        if _HOMES[name] == __name__:
            return importlib.import_module(f"{__name__}.{name}")
        value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
