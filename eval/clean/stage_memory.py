"""Memory of what stages returned: a stage runs again only for what it was not run for lately."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

T = TypeVar("T")
NUM_KEPT = 3  # results of each stage that are kept: of the edits, of those before, and of a comparison


class StageMemory:
    """Results of stages by their name, and by what they depend on."""

    def __init__(self) -> None:
        """Begin with none."""
        self._stages: dict[str, OrderedDict[Hashable, Any]] = {}

    def result(self, stage: str, key: Hashable, run: Callable[[], T]) -> T:
        """Return what a stage returned for a key, or returns now.

        Args:
            stage: Name of the stage.
            key: All that its result depends on, within one session.
            run: Runs the stage.
        """
        kept = self._stages.setdefault(stage, OrderedDict())
        if key not in kept:
            kept[key] = run()
        kept.move_to_end(key)
        while len(kept) > NUM_KEPT:
            kept.popitem(last=False)
        return kept[key]
