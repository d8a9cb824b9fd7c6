"""Notices of a clip: what a person should read, each with a button that goes to its time."""

from html import escape

import viser

from eval.clean.notices import Notice
from eval.clean.timeline import timeline_notices
from eval.studio.page.host import Host

MAX_BUTTONS = 40  # as a page with thousands of controls would be slow


class NoticesPanel:
    """Panel of the notices."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Add the text; buttons come with a result."""
        self._gui, self._host = gui, host
        self._text = gui.add_html("")
        self._folder = gui.add_folder("Go to", expand_by_default=True)
        self._buttons: list[viser.GuiButtonHandle] = []
        self._shown: tuple[Notice, ...] | None = None

    def refresh(self) -> None:
        """Show the notices of the result."""
        project = self._host.project
        result = project.result if project else None
        timed = timeline_notices(result) if result else ()
        whole = [notice for notice in result.notices if notice.start_s is None] if result else []
        rows = "".join(f"<li>{escape(str(notice))}</li>" for notice in whole)
        self._text.content = f"<ul style='margin:2px 10px;padding-left:1.2em;font-size:0.875em;line-height:1.45'>{rows}</ul>"
        if timed == self._shown:
            return
        self._shown = timed
        for button in self._buttons:
            button.remove()
        self._buttons = []
        with self._folder:
            for notice in sorted(timed, key=lambda one: one.start_s or 0.0)[:MAX_BUTTONS]:
                button = self._gui.add_button(f"{notice.start_s:.2f} s  {notice}", color="gray", hint=str(notice))
                button.on_click(self._host.events.by_user(lambda _, time=notice.start_s or 0.0: self._host.seek(time)))
                self._buttons.append(button)
