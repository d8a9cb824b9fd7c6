"""What the panels of a tab need of it."""

from pathlib import Path
from typing import Protocol

from eval.studio.page.events import Events
from eval.studio.state.playback import Playback
from eval.studio.state.project import Project
from eval.studio.state.view_options import ViewOptions
from eval.studio.state.workspace import Workspace


class Host(Protocol):
    """A tab, as its panels see it.

    Attributes:
        workspace: Everything that is open.
        project: Clip that is shown, None before the first.
        playback: Time that is shown.
        options: What is shown.
        events: Wraps the callbacks of the controls.
    """

    workspace: Workspace
    project: Project | None
    playback: Playback
    options: ViewOptions
    events: Events

    def open(self, path: Path) -> None:
        """Show another clip."""
        ...

    def receive(self, name: str, content: bytes) -> None:
        """Show a clip that the browser sent."""
        ...

    def seek(self, time_s: float) -> None:
        """Show a time [s]."""
        ...

    def refresh(self) -> None:
        """Show everything anew."""
        ...

    def tell(self, line: str) -> None:
        """Show a line for a while."""
        ...
