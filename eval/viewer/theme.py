"""How pages look around their scene."""

import viser

from eval.viewer.colours import BRAND


def set_theme(viewer: viser.ViserServer, title: str, panel_width_px: int) -> None:
    """Set colour, title and panel, which stands at the right, and let z point up."""
    viewer.gui.configure_theme(control_width="medium", show_logo=False, show_share_button=False, brand_color=BRAND)
    viewer.gui.set_panel_label(title)
    viewer.gui.main_panel.dock_right()
    viewer.gui.main_panel.set_width(panel_width_px)
    viewer.scene.set_up_direction("+z")
