"""Trainings that the restoring study repeats, each with one ingredient left out."""

from typing import NamedTuple

WHOLE = "whole"


class Ingredient(NamedTuple):
    """Training of the study.

    Attributes:
        name: Name of the row.
        overrides: Overrides of ``configs/restore.yaml``.
    """

    name: str
    overrides: tuple[str, ...]


INGREDIENTS = (
    Ingredient(WHOLE, ()),
    Ingredient("one suit a clip", ("data.suit_takes=1",)),
    Ingredient("no added misalignments", ("learner.added_misalignment=0",)),
    Ingredient("no conventions", ("learner.convention=0",)),
    Ingredient("no clean clips", ("learner.clean_share=0",)),
    Ingredient("not mirrored", ("learner.mirror=false",)),
    Ingredient("no exchanged limbs", ("learner.exchange_share=0",)),
    Ingredient("no sway", ("learner.sway=0",)),
    Ingredient("whole windows alone", ("learner.shortest_s=4",)),
    Ingredient("no made-up people", ("data.synthetic_sets=0",)),
)
