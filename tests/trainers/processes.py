"""Processes that belong to a run, read from /proc."""

from pathlib import Path

from eval.benchmark.timing.process_tree import process_tree


def descendants(ancestor: int, title: str = "") -> list[int]:
    """Return the processes below one whose command line begins with a title, in order of their numbers."""
    return sorted(pid for pid in process_tree(ancestor) if pid != ancestor and _title(pid).startswith(title))


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


def _title(pid: int) -> str:
    """Return a process' command line; nothing if it has just ended."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        return ""
