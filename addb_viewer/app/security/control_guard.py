"""What a page may send to a control: a value that the control can have, and nothing else."""

import logging
import math
from typing import Any

import viser
from viser import _messages
from viser.infra import ClientId

LOG = logging.getLogger("addb_viewer")
LONGEST_TEXT = 100_000  # characters; a long note has a thousand
SHOWN = 40  # characters of a refused value, of which strangers send any

Message = _messages.GuiUpdateMessage


class ControlGuard:
    """Looks at what one browser sends to its controls, before viser sets it."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Stand before the controls.

        Viser would set whatever attribute a message names, to whatever its type makes of the value sent, and
        then call what waits for it.

        Args:
            gui: of the browser; what it gets later is guarded as well.
        """
        self._gui = gui
        self._told: set[str] = set()
        interface = gui._websock_interface
        interface.unregister_handler(Message, gui._handle_gui_updates)
        interface.register_handler(Message, self._handle)

    async def _handle(self, client_id: ClientId, message: Message) -> None:
        control = self._gui._gui_input_handle_from_uuid.get(message.uuid)
        if control is None:  # it went while the message was under way
            return
        if message.updates.keys() == {"value"} and can_have(control, message.updates["value"]):
            await self._gui._handle_gui_updates(client_id, message)
        elif message.uuid not in self._told:
            self._told.add(message.uuid)
            sent = repr(message.updates)[:SHOWN].encode("ascii", "backslashreplace").decode()
            LOG.warning(
                "A browser or program sent '%s' what it cannot take (%s): nothing was changed.",
                getattr(control, "label", type(control).__name__),
                sent,
            )


def can_have(control: Any, value: object) -> bool:
    """Whether a person can give this value to the control by mouse and keys.

    Args:
        control: viser's handle; its options and bounds are those of now.
        value: as sent.
    """
    match control:
        case viser.GuiButtonHandle():
            return value is True
        case viser.GuiCheckboxHandle():
            return isinstance(value, bool)
        case viser.GuiButtonGroupHandle() | viser.GuiDropdownHandle():
            return isinstance(value, str) and value in control.options
        case viser.GuiTextHandle():
            return isinstance(value, str) and len(value) <= LONGEST_TEXT
        case viser.GuiSliderHandle() | viser.GuiNumberHandle():
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                return False
            return not (control.min is not None and value < control.min) and not (
                control.max is not None and value > control.max
            )
    return False
