"""Chromium without a window, driven by its DevTools protocol over two pipes."""

import base64
import fcntl
import json
import os
import subprocess
import time

ENDS = 3, 4
"""The descriptors at which Chromium reads and writes."""
TIMEOUT_S = 30


class Browser:
    """A page of Chromium's; a context manager.

    `said` has errors and warnings, `asked` what was requested, but for data in the page itself.
    """

    def __init__(self, program, folder, *, dark=False, size=(1360, 900)):
        self._number, self._session = 0, None
        self.said, self.asked = [], []
        theirs, self._to = _pipe()
        self._from, other = _pipe()
        for own in (self._to, self._from):
            os.set_inheritable(own, False)
        redirected = f'exec "$0" "$@" {ENDS[0]}<&{theirs} {ENDS[1]}>&{other}'
        command = [
            *("bash", "-c", redirected, program),
            *("--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"),
            *(f"--user-data-dir={folder}", f"--window-size={size[0]},{size[1]}", "about:blank"),
        ]
        self._process = subprocess.Popen(
            command,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=(theirs, other),
        )
        for one in (theirs, other):
            os.close(one)
        self._left = b""
        self._attach(dark, size)

    def _attach(self, dark, size):
        targets = self.call("Target.getTargets")["targetInfos"]
        page = next(one["targetId"] for one in targets if one["type"] == "page")
        self._session = self.call("Target.attachToTarget", targetId=page, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.call(
            "Emulation.setDeviceMetricsOverride",
            **dict(zip(("width", "height"), size, strict=True)),
            deviceScaleFactor=1,
            mobile=False,
        )
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._process.kill()
        self._process.wait()
        for one in (self._to, self._from):
            os.close(one)

    def call(self, method, **parameters):
        """A command of the protocol; its result."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            found = self._read()
            if found.get("id") == self._number:
                assert "error" not in found, found
                return found["result"]

    def open(self, path):
        """Load a file, until all of it is there."""
        self.call("Page.navigate", url=path.as_uri())
        self.wait("location.protocol === 'file:' && document.readyState === 'complete'")

    def value(self, script):
        """What an expression gives."""
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def wait(self, condition):
        """Until an expression is true."""
        end = time.monotonic() + TIMEOUT_S
        while not self.value(condition):
            assert time.monotonic() < end, condition
            time.sleep(0.02)

    def press(self, key):
        """Press a key of the keyboard."""
        codes = {"Enter": 13, "Tab": 9, "Escape": 27, "Home": 36, "End": 35}
        codes |= {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, " ": 32}
        text = {"Enter": "\r", " ": " "}.get(key, "")
        for kind in ("keyDown", "keyUp"):
            code = {"windowsVirtualKeyCode": codes[key], "text": text if kind == "keyDown" else ""}
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, **code)

    def screenshot(self, path, *, whole=False):
        """Write a PNG of what is seen, or of the whole page."""
        found = self.call("Page.captureScreenshot", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(found["data"]))

    def _read(self):
        while b"\0" not in self._left:
            more = os.read(self._from, 1 << 20)
            assert more, "Chromium has ended"
            self._left += more
        line, _, self._left = self._left.partition(b"\0")
        found = json.loads(line)
        method, values = found.get("method"), found.get("params", {})
        complains = method == "Runtime.consoleAPICalled" and values["type"] in ("error", "warning")
        if complains or method in ("Runtime.exceptionThrown", "Log.entryAdded"):
            self.said.append(values)
        elif method == "Network.requestWillBeSent" and not values["request"]["url"].startswith("data:"):
            self.asked.append(values["request"]["url"])
        return found


def _pipe():
    """A pipe whose ends don't have the numbers of Chromium's."""
    ends = os.pipe()
    high = tuple(fcntl.fcntl(one, fcntl.F_DUPFD_CLOEXEC, 10) for one in ends)
    for one in ends:
        os.close(one)
    return high
