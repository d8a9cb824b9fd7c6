"""The error that a user can mend."""


class InputError(ValueError):
    """Bad input from the user: the message says in one line what is wrong, where, and what would be right."""


class RunError(RuntimeError):
    """The end of a run that cannot go on, by no fault of what was typed: the message says in one line what was lost and what is saved."""


def require(condition: bool, name: str, value: object, expected: str) -> None:
    """Raise InputError that the setting ``name`` has a ``value`` that is not what it ``expected`` be, unless it is ``condition``."""
    if not condition:
        raise InputError(f"{name} is {value}, should be {expected}")
