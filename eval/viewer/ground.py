"""Ground and light of a scene."""

import viser

_GROUND_M = 60.0  # edge of the ground, which fades long before it


def add_ground(scene: viser.SceneApi, world: str) -> viser.GridHandle:
    """Add a grid of metres and half metres, on which shadows fall, below the node ``world``; return it."""
    return scene.add_grid(
        f"{world}/ground",
        width=_GROUND_M,
        height=_GROUND_M,
        cell_size=0.5,
        section_size=1.0,
        cell_color=(214, 219, 225),
        section_color=(176, 184, 194),
        plane_color=(240, 243, 246),
        plane_opacity=1.0,
        shadow_opacity=0.28,
        fade_distance=22.0,
        fade_strength=1.5,
    )


def add_lights(scene: viser.SceneApi) -> viser.DirectionalLightHandle:
    """Add a sky, a sun from behind the usual view that casts shadows, and a weak light from the other side; return the sun."""
    scene.configure_default_lights(False)
    scene.configure_environment_map(None)
    scene.add_light_hemisphere("/light/sky", sky_color=(255, 255, 255), ground_color=(186, 182, 178), intensity=1.6)
    scene.add_light_directional("/light/fill", color=(205, 220, 255), intensity=0.6, position=(-4.0, 3.0, 3.0))
    return scene.add_light_directional("/light/sun", intensity=2.1, cast_shadow=True, position=(3.0, -2.0, 6.0))
