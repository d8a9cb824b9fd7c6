"""A question for the user where the joints of a skeleton are not found: a draft of the mapping, to be completed on the page."""

from collections.abc import Callable
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

import viser

from configs.errors import InputError
from datasets.joints.mapping_draft import JointMapError
from datasets.performer.reading_options import ReadingOptions, read_mapping
from eval.studio.page.events import Events


def ask_for_joints(gui: viser.GuiApi, events: Events, error: JointMapError, answer: Callable[[ReadingOptions], None]) -> None:
    """Show which joints were found and guessed; ``answer`` is called with what the user makes of it."""
    modal = gui.add_modal("Which joint is which?")
    with modal:
        gui.add_html(f"<div style='padding:0 10px 8px 10px;font-size:0.875em'>{escape(str(error))}</div>")
        text = gui.add_text("Joints", error.draft, multiline=True)
        read = gui.add_button("Read it so", color="blue")
        leave = gui.add_button("Leave it", color="gray")

    def take(_: object) -> None:
        reading = reading_from_text(text.value)
        modal.close()
        answer(reading)

    read.on_click(events.by_user(take))
    leave.on_click(events.by_user(lambda _: modal.close()))


def reading_from_text(text: str) -> ReadingOptions:
    """Return what the text of a mapping file says.

    Raises:
        InputError: If there is something unknown in it.
    """
    with TemporaryDirectory(prefix="adapt-mimic-") as folder:
        path = Path(folder) / "mapping"
        path.write_text(text, encoding="utf-8")
        try:
            return read_mapping(path)
        except InputError as error:
            raise InputError(str(error).removeprefix(f"{path}: ")) from None
