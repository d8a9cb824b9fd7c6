"""The view: before and after, on which body, and what is drawn on it."""

import viser

from eval.studio.page.host import Host
from eval.studio.state.view_options import COMPARISONS, FIGURES, MESH


class ViewPanel:
    """Panel of the view.

    Attributes:
        figure: Choice of the figure.
        left_out: Line on a mesh that is no choice.
    """

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Add the controls."""
        self._host = host
        options, by_user = host.options, host.events.by_user
        comparison = gui.add_dropdown("Compare", COMPARISONS, initial_value=options.comparison)
        self.figure = gui.add_dropdown("Figure", FIGURES, initial_value=options.figure)
        self.left_out = gui.add_markdown("", visible=False)
        switches = {
            "follows": gui.add_checkbox("Follow", options.follows, hint="the view goes along with the figure"),
            "contacts": gui.add_checkbox("Contacts", options.contacts, hint="colour feet that stand, and draw footprints"),
            "misalignments": gui.add_checkbox(
                "Misaligned", options.misalignments, hint="colour and name segments whose sensors were misaligned"
            ),
            "trust": gui.add_checkbox("Trust", options.trust, hint="blue where physics performed it, amber where the recording was kept"),
            "centre_of_mass": gui.add_checkbox("Mass", options.centre_of_mass, hint="centre of mass and the point below it"),
            "shadows": gui.add_checkbox("Shadows", options.shadows, hint="off, where the page is slow"),
        }

        def take(_: object) -> None:
            options.comparison, options.figure = comparison.value, self.figure.value
            for name, switch in switches.items():
                setattr(options, name, switch.value)
            host.refresh()

        for control in (comparison, self.figure, *switches.values()):
            control.on_update(by_user(take))

    def refresh(self) -> None:
        """Offer the clip's figures; a mesh where its file has one."""
        project = self._host.project
        if project is None:
            return
        stated = project.session.bvh.stated
        figures = (*FIGURES, MESH) if stated.mesh else FIGURES
        if figures != self.figure.options:
            self.figure.options = figures
        if self._host.options.figure not in figures:  # another clip's mesh was shown
            self._host.options.figure = self.figure.value
        self.left_out.content, self.left_out.visible = stated.no_mesh, bool(stated.no_mesh)
