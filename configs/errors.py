"""The error that a user can mend."""


class InputError(ValueError):
    """Bad input from the user: the message says in one line what is wrong, where, and what would be right."""
