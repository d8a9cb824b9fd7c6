"""What the user is told in one line where a cleaning cannot be done."""


class AddonError(Exception):
    """Cleaning that cannot be done; the message says in one line what is wrong and what would be right."""
