"""What a tab shows of a clip."""

from dataclasses import dataclass

GHOST, SIDE_BY_SIDE, ONLY_BEFORE, ONLY_AFTER = "ghost", "side by side", "before", "after"
COMPARISONS = (SIDE_BY_SIDE, GHOST, ONLY_BEFORE, ONLY_AFTER)
HUMANOID, SKELETON, MESH = "humanoid", "performer's skeleton", "mesh"
FIGURES = (HUMANOID, SKELETON)  # that every clip has; a mesh is a figure where the file has one


@dataclass
class ViewOptions:
    """What a tab shows of a clip.

    Attributes:
        comparison: How before and after are shown, one of ``COMPARISONS``.
        figure: On which body, one of ``FIGURES`` or ``MESH``.
        follows: Whether the view follows the figure.
        contacts: Whether feet that stand are coloured, and footprints drawn.
        trust: Whether the cleaned figure's colour tells how far it is the simulation's.
        centre_of_mass: Whether the centre of mass is drawn.
        misalignments: Whether misaligned segments are coloured and labelled.
        shadows: Whether figures cast shadows.
    """

    comparison: str = SIDE_BY_SIDE
    figure: str = HUMANOID
    follows: bool = True
    contacts: bool = True
    trust: bool = False
    centre_of_mass: bool = False
    misalignments: bool = True
    shadows: bool = True
