"""Undo and redo of a clip's edits."""

from dataclasses import dataclass, field

from eval.clean.edits import Edits

MAX_UNDONE = 200  # steps that are remembered


@dataclass
class EditHistory:
    """Edits of a clip with those before and after them.

    Attributes:
        present: Edits that hold.
        earlier: Edits that held before, the oldest first.
        later: Edits that were undone, the one that was undone last at the end.
    """

    present: Edits = field(default_factory=Edits)
    earlier: list[Edits] = field(default_factory=list)
    later: list[Edits] = field(default_factory=list)

    def change(self, edits: Edits) -> bool:
        """Let other edits hold; return whether they are others."""
        if edits == self.present:
            return False
        self.earlier = [*self.earlier, self.present][-MAX_UNDONE:]
        self.present, self.later = edits, []
        return True

    def undo(self) -> bool:
        """Let the edits before hold again; return whether there are any."""
        if not self.earlier:
            return False
        self.later.append(self.present)
        self.present = self.earlier.pop()
        return True

    def redo(self) -> bool:
        """Let the edits hold that were undone last; return whether there are any."""
        if not self.later:
            return False
        self.earlier.append(self.present)
        self.present = self.later.pop()
        return True
