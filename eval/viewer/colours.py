"""Colours of the pages, which people with any colour vision can tell apart, on figures, in tables and in the timeline alike."""

import numpy as np

from datasets.motion.humanoid import FOOT_AND_TOE_BODIES

Colour = tuple[int, int, int]  # red, green, blue, 0 to 255

BEFORE: Colour = (158, 163, 173)
AFTER: Colour = (53, 128, 196)
LEFT_FOOT: Colour = (232, 131, 58)
RIGHT_FOOT: Colour = (24, 150, 132)
FOOT_COLOURS = (LEFT_FOOT, RIGHT_FOOT)  # in the order of every array of contacts
UNSURE: Colour = (226, 160, 60)  # of a frame in which nothing is the simulation's
MISALIGNED: Colour = (158, 84, 176)
CENTRE_OF_MASS: Colour = (214, 62, 62)
BRAND: Colour = AFTER
NOT_YET: Colour = BEFORE  # of a live user before the first frame that counts
USER_COLOURS: tuple[Colour, ...] = ((53, 128, 196), (158, 84, 176), (208, 64, 100), (122, 112, 40), (96, 190, 232), (70, 74, 92))
FOOT_OF_BODY = {body: foot for foot, bodies in enumerate(FOOT_AND_TOE_BODIES) for body in bodies}


def user_colour(user: int) -> Colour:
    """Return the colour of a live user by number, from 1 on; those of feet that stand are none of them."""
    return USER_COLOURS[(user - 1) % len(USER_COLOURS)]


def blend(low: Colour, high: Colour, share: float, levels: int = 8) -> Colour:
    """Return the colour between two others, in so many levels that a figure is not coloured anew in every frame."""
    level = round(share * levels) / levels
    red, green, blue = (round(a + level * (b - a)) for a, b in zip(low, high, strict=True))
    return red, green, blue


def in_linear(colours: np.ndarray) -> np.ndarray:
    """Return colours (..., 3) in linear light, 0 to 255: viser takes those of batched meshes so, and all others as sRGB."""
    share = np.asarray(colours) / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)  # IEC 61966-2-1
    return np.round(255.0 * linear).astype(np.uint8)


def in_css(colour: Colour) -> str:
    """Return a colour as style sheets write it."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
