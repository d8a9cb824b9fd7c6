"""Names of what the studio writes beside a recording."""

from pathlib import Path

CLEAN_ENDING = "_clean"  # of a clean clip's stem


def cleaned_path(clip: Path, suffix: str) -> Path:
    """Return where a clip's clean one goes, beside it and never over it."""
    return clip.with_name(f"{clip.stem}{CLEAN_ENDING}{suffix}")


def is_cleaned(file: Path) -> bool:
    """Return whether a file is the clean one of a clip beside it."""
    if not file.stem.endswith(CLEAN_ENDING):
        return False
    stem = file.stem.removesuffix(CLEAN_ENDING)
    return any(other.stem == stem for other in file.parent.iterdir())
