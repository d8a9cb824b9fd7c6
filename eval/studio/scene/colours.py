"""Colours of the page, which people with any colour vision can tell apart, on figures and in the timeline alike."""

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
FOOT_OF_BODY = {body: foot for foot, bodies in enumerate(FOOT_AND_TOE_BODIES) for body in bodies}


def blend(low: Colour, high: Colour, share: float, levels: int = 8) -> Colour:
    """Return the colour between two others, in so many levels that a figure is not coloured anew in every frame."""
    level = round(share * levels) / levels
    red, green, blue = (round(a + level * (b - a)) for a, b in zip(low, high, strict=True))
    return red, green, blue


def in_css(colour: Colour) -> str:
    """Return a colour as style sheets write it."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
