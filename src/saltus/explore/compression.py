"""Maps are compressed on their way to the page, with what was sent before; motions aren't: their
samples hardly shrink, and it would take three times as long as to compute them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from websockets.extensions import Extension
from websockets.extensions.permessage_deflate import ServerPerMessageDeflateFactory
from websockets.frames import Frame
from websockets.typing import ExtensionParameter

from saltus.explore.frames import of_map


class MapsDeflated(Extension):
    """WebSocket extension that compresses the frames of maps alone (RFC 7692 leaves it to the
    sender, message by message).

    Parameters
    ----------
    whole : Extension
        That which compresses every frame.
    """

    name = ServerPerMessageDeflateFactory.name

    def __init__(self, whole: Extension) -> None:
        self._whole = whole

    def decode(self, frame: Frame, *, max_size: int | None = None) -> Frame:
        """A frame of the page as it was before it was compressed."""
        return self._whole.decode(frame, max_size=max_size)

    def encode(self, frame: Frame) -> Frame:
        """A frame for the page, compressed if it is of a map."""
        return self._whole.encode(frame) if of_map(frame.data) else frame


class MapsDeflatedFactory(ServerPerMessageDeflateFactory):
    """The server's side of the agreement on compression with a page."""

    def process_request_params(
        self, params: Sequence[ExtensionParameter], accepted_extensions: Sequence[Extension]
    ) -> tuple[list[ExtensionParameter], Any]:
        """The terms, and the extension. Raises NegotiationError where the page's can't be met."""
        agreed, whole = super().process_request_params(params, accepted_extensions)
        return agreed, MapsDeflated(whole)
