"""The explorer: a page in the browser that asks a system, and the server that answers it, on this
machine alone.
"""

from __future__ import annotations

import sys
import threading
import webbrowser
from collections.abc import Iterable, Mapping
from contextlib import suppress
from types import ModuleType
from typing import TYPE_CHECKING, Any

from saltus.errors import ParameterError, SaltusError

if TYPE_CHECKING:
    from saltus.explore.desk import Desk
    from saltus.explore.server import Server
    from saltus.explore.session import AnswersQuestions
    from saltus.flow.methods import Method
    from saltus.system import System

#: Pages that may show the explorer in a frame: notebooks that are served on this machine.
NOTEBOOKS = ("http://localhost:*", "http://127.0.0.1:*")


class Explorer:
    """An explorer that is open. In a notebook it is shown below the cell.

    Attributes
    ----------
    url : str
        The page's address, with the token that lets it in.
    """

    def __init__(self, server: Server, desk: AnswersQuestions) -> None:
        self._server, self._desk = server, desk
        self.url = server.url

    @property
    def view(self) -> Mapping[str, Any]:
        """The newest page's view: the fields of its questions, by panel."""
        sessions = self._server.sessions
        return sessions[-1].view if sessions else {}

    def study(self) -> str:
        """The study file of what the newest page shows, as text. Raises ParameterError if no page
        shows anything.
        """
        from saltus.explore.desk import Desk
        from saltus.explore.save import study_text
        from saltus.explore.shown import shown

        if not self.view or not isinstance(self._desk, Desk):
            raise ParameterError(f"no page shows anything yet: open {self.url}.")
        return study_text(shown(self._desk, self.view)[0], "view")

    def close(self) -> None:
        """End the pages' work and the server."""
        self._server.stop()

    def wait(self, until_closed: bool = False) -> None:
        """Wait for the end: Ctrl-C, or a minute after the last page went."""
        try:
            self._server.wait(until_closed)
        finally:
            self.close()

    def __repr__(self) -> str:
        return f"Explorer at {self.url}"

    def _repr_html_(self) -> str:
        return (
            f'<iframe src="{self.url}&amp;frame=1" width="100%" height="700" '
            f'title="saltus explore" style="border: 0"></iframe>'
        )


def explore(
    system: System,
    *,
    method: Method | None = None,
    browser: bool | None = None,
    threads: int | None = None,
) -> Explorer:
    """Open the explorer of a system: basins, motions, orbits and responses on one page.

    It listens on this machine alone, and returns at once.

    Parameters
    ----------
    system : System
        Equations, contacts and values.
    method : Method
        Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states on where
        it serves.
    browser : bool
        Whether the page is opened in the browser; default: unless a notebook shows it.
    threads : int, optional
        Threads of a map; default all processors.

    Returns
    -------
    Explorer
        With ``url``, ``view`` and ``close()``.

    Raises
    ------
    ParameterError
        If an argument can't be used, or the packages of the extra ``explore`` aren't there.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    >>> page = sl.explore(rig, browser=False)
    >>> page.url.startswith("http://127.0.0.1:")
    True
    >>> page.close()
    """
    from saltus.analysis.inputs.starts import check_system
    from saltus.explore.desk import Desk
    from saltus.explore.opening import opening_of
    from saltus.flow.methods import check_method
    from saltus.flow.progress import in_notebook

    check_system(system)
    desk = Desk(opening_of(system, check_method(method, system)), threads)
    return opened(desk, browser=not in_notebook() if browser is None else browser)


def opened(
    desk: AnswersQuestions,
    models: Any = None,
    browser: bool = False,
    framed_by: Iterable[str] = NOTEBOOKS,
) -> Explorer:
    """An explorer of a desk: its server listens when this returns. Raises ParameterError if the
    packages of the extra ``explore`` aren't there.
    """
    from saltus.explore.desk import Desk

    try:
        from saltus.explore.server import Server
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in ("starlette", "uvicorn", "websockets"):
            raise
        raise ParameterError(
            f"the explorer needs {error.name}: pip install 'saltus[explore]'."
        ) from None
    server = Server(desk, models, framed_by)
    server.start()
    if browser:
        webbrowser.open(server.url)
    if isinstance(desk, Desk):
        threading.Thread(target=_warm, args=(desk,), daemon=True).start()
    return Explorer(server, desk)


def _warm(desk: Desk) -> None:
    with suppress(SaltusError):  # whoever asks for a map is told
        desk.warm()


class _CallableRoom(ModuleType):
    """Let ``saltus.explore`` be the function, although importing this folder binds that name to the
    module.
    """

    __call__ = staticmethod(explore)


sys.modules[__name__].__class__ = _CallableRoom
