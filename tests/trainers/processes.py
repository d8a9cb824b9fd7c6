"""Processes that belong to a run, read from /proc."""

from pathlib import Path


def descendants(ancestor: int, title: str = "") -> list[int]:
    """Return the processes below one whose command line begins with a title, in order of their numbers."""
    children: dict[int, list[int]] = {}
    titles: dict[int, str] = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            titles[int(folder.name)] = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except (OSError, IndexError):
            continue  # it has just ended
        children.setdefault(parent, []).append(int(folder.name))
    found, left = [], [ancestor]
    while left:
        below = children.get(left.pop(), [])
        left += below
        found += [pid for pid in below if titles[pid].startswith(title)]
    return sorted(found)


def alive(pids: list[int]) -> list[int]:
    """Return those of them that are still running; what has ended and waits to be collected by its parent is not."""
    running = []
    for pid in pids:
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            continue
        if state != "Z":
            running.append(pid)
    return running
