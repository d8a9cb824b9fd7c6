"""A headless Chromium over its debugging pipe, for tests that need a real browser; no driver and no network."""

import base64
import fcntl
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars"),
    *("--no-first-run", "--disable-quic", "--disable-background-networking", "--disable-component-update", "--disable-sync"),
    *("--disable-extensions", "--remote-debugging-pipe"),
)
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
SECONDS = 20.0
AT_3_AND_4 = "import os, sys; os.dup2(int(sys.argv[1]), 3); os.dup2(int(sys.argv[2]), 4); os.execv(sys.argv[3], sys.argv[3:])"


class Browser:
    """One page; messages go in at one pipe and come out of another, each ended by a zero byte."""

    def __init__(self, into: int, out_of: int) -> None:
        """Open a page."""
        self._into, self._out_of, self._number, self._bytes = into, out_of, 0, b""
        self._session = ""
        target = self._call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]

    def open(self, address: str) -> None:
        """Go to an address."""
        self._call("Page.navigate", url=address)

    def resize(self, size: tuple[int, int]) -> None:
        """Give the page, without the window around it, a size [pixels]."""
        self._call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=False)

    def before_pages(self, script: str) -> None:
        """Run a script on every page that is opened from now on, before its own."""
        self._call("Page.enable")
        self._call("Page.addScriptToEvaluateOnNewDocument", source=script)

    def metrics(self) -> dict[str, float]:
        """Return Chromium's metrics of the page, such as ``ScriptDuration`` of its main thread so far [s]."""
        self._call("Performance.enable", timeDomain="threadTicks")
        return {one["name"]: one["value"] for one in self._call("Performance.getMetrics")["metrics"]}

    def value(self, script: str) -> Any:
        """Return what an expression is worth on the page."""
        found = self._call("Runtime.evaluate", expression=script, returnByValue=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def until(self, script: str) -> None:
        """Wait until an expression is true."""
        end = time.monotonic() + SECONDS
        while not self.value(f"document.body !== null && ({script})"):
            assert time.monotonic() < end, f"never true: {script}"
            time.sleep(0.05)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag with the mouse."""
        for kind, (x, y) in (("mousePressed", start), ("mouseMoved", end), ("mouseReleased", end)):
            self._call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def click(self, element: str) -> None:
        """Click in the middle of an element, which an expression finds, as soon as it is there and enabled."""
        self.until(f"(e => e && !e.disabled && e.getBoundingClientRect().width > 0)({element})")
        box = self.box(element)
        self.drag((box[0] + box[2] / 2, box[1] + box[3] / 2), (box[0] + box[2] / 2, box[1] + box[3] / 2))

    def box(self, element: str) -> list[float]:
        """Return left, top, width and height of an element, which an expression finds, brought into view [pixels]."""
        self.value(f"({element}).scrollIntoView({{block: 'nearest'}})")
        return self.value(f"(b => [b.x, b.y, b.width, b.height])(({element}).getBoundingClientRect())")

    def press(self, key: str, code: int) -> None:
        """Press a key, by its name and its Windows key code."""
        for kind in ("rawKeyDown", "keyUp"):
            self._call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code)

    def choose_file(self, selector: str, file: Path) -> None:
        """Choose a file in an input of files, which a CSS selector finds."""
        root = self._call("DOM.getDocument")["root"]["nodeId"]
        found = self._call("DOM.querySelector", nodeId=root, selector=selector)["nodeId"]
        self._call("DOM.setFileInputFiles", nodeId=found, files=[str(file)])

    def drop_file(self, element: str, file: Path) -> None:
        """Drop a file onto the middle of an input of files, which an expression finds, again until it is taken: a busy page misses some."""
        dragged, end = {"items": [], "files": [str(file)], "dragOperationsMask": 1}, time.monotonic() + SECONDS  # to be copied
        while not self.value(f"[...({element})?.files ?? []].some(one => one.name === {file.name!r})"):
            assert time.monotonic() < end, f"never taken: {file.name}"
            self.until(f"({element})?.getBoundingClientRect().width > 0")
            left, top, width, height = self.box(element)
            for kind in ("dragEnter", "dragOver", "drop"):
                self._call("Input.dispatchDragEvent", type=kind, x=left + width / 2, y=top + height / 2, data=dragged)
                time.sleep(0.1)

    def save_downloads(self, folder: Path) -> None:
        """Save what is downloaded in a folder."""
        self._call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(folder))

    def screenshot(self) -> bytes:
        """Return the page as PNG."""
        return base64.b64decode(self._call("Page.captureScreenshot", format="png")["data"])

    def _call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the DevTools protocol and return its result; events are passed over."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._into, json.dumps(message).encode() + b"\0")
        while True:
            while b"\0" not in self._bytes:
                read = os.read(self._out_of, 1 << 16)
                assert read, "the browser is gone"
                self._bytes += read
            line, _, self._bytes = self._bytes.partition(b"\0")
            answer = json.loads(line)
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]


@contextmanager
def browser(profile: Path, size: tuple[int, int] = (1000, 700)) -> Iterator[Browser]:
    """Start a browser whose files go to ``profile``, with a window of a size [pixels]; skips the test where there is none."""
    found = next((path for name in NAMES if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip(f"needs a browser: none of {', '.join(NAMES)} is installed")
    (hears, say), (hear, says) = os.pipe(), os.pipe()
    ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (hears, says)]  # out of the way of 3 and 4, which a browser listens at
    command = [
        sys.executable,
        "-c",
        AT_3_AND_4,
        *map(str, ends),
        found,
        *FLAGS,
        f"--window-size={size[0]},{size[1]}",
        f"--user-data-dir={profile}",
    ]
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(command, pass_fds=ends, stdout=quiet, stderr=quiet, start_new_session=True)
    for end in (hears, says, *ends):
        os.close(end)
    try:
        yield Browser(say, hear)
    finally:
        os.close(say)  # the browser ends with its pipe
        os.close(hear)
        try:
            process.wait(5.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
