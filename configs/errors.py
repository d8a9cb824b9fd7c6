"""Errors that are shown to the user as one line."""


class InputError(ValueError):
    """Bad input from the user; the message states in one line what is wrong, where, and what would be right."""


class RunError(RuntimeError):
    """Failure of a run through no fault of its input; the message states in one line what was lost and what is saved."""


def require(condition: bool, name: str, value: object, expected: str) -> None:
    """Raise InputError "NAME is VALUE, should be EXPECTED" unless ``condition`` holds."""
    if not condition:
        raise InputError(f"{name} is {value}, should be {expected}")
