"""Headless Chromium by its DevTools protocol: real clicks and keys, what the console says, what leaves the machine."""

import base64
import json
import shutil
import subprocess
import tempfile
import time
import urllib.request
from pathlib import Path

from websockets.sync.client import connect

FLAGS = [
    "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-extensions",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-default-apps",
    "--disable-dev-shm-usage", "--hide-scrollbars", "--force-color-profile=srgb", "--remote-debugging-port=0",
    # Nothing but this machine has a name: a page that needs the network fails here.
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
]
PATIENCE_S = 20.0
KEYS = {"Space": (" ", "Space", 32), "Escape": ("Escape", "Escape", 27), "Enter": ("Enter", "Enter", 13), "Tab": ("Tab", "Tab", 9),
        "ArrowLeft": ("ArrowLeft", "ArrowLeft", 37)}


class Browser:
    """A browser of its own with one tab; a context manager."""

    def __enter__(self):
        self.home = tempfile.mkdtemp(prefix="tonus-page-")
        self.process = subprocess.Popen(["chromium", *FLAGS, f"--user-data-dir={self.home}", "about:blank"],
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        port = Path(self.home, "DevToolsActivePort")
        until(lambda: port.exists() and port.read_text().count("\n"), "Chromium starts", 60.0)
        at = f"http://127.0.0.1:{port.read_text().split()[0]}/json/list"
        self.targets = [each for each in json.load(urllib.request.urlopen(at)) if each["type"] == "page"]
        return Tab(self.targets[0]["webSocketDebuggerUrl"])

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(10)
        shutil.rmtree(self.home, ignore_errors=True)


class Tab:
    """One page."""

    def __init__(self, url):
        self.socket = connect(url, max_size=None)
        self.calls = 0
        self.complaints = []
        self.requests = []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method, **parameters):
        self.calls += 1
        self.socket.send(json.dumps({"id": self.calls, "method": method, "params": parameters}))
        while True:
            message = json.loads(self.socket.recv(timeout=60))
            if message.get("id") == self.calls:
                if "error" in message:
                    raise AssertionError(f"{method}: {message['error']}")
                return message["result"]
            self.note(message.get("method"), message.get("params", {}))

    def note(self, event, about):
        """Errors and warnings of the page, and every address that it asks for."""
        if event == "Runtime.exceptionThrown":
            details = about["exceptionDetails"]
            self.complaints.append(details.get("exception", {}).get("description") or details["text"])
        elif event == "Runtime.consoleAPICalled" and about["type"] in ("error", "warning", "assert"):
            self.complaints.append(" ".join(str(each.get("value", each.get("description"))) for each in about["args"]))
        elif event == "Log.entryAdded" and about["entry"]["level"] in ("error", "warning"):
            self.complaints.append(f"{about['entry']['text']} {about['entry'].get('url', '')}")
        elif event == "Network.requestWillBeSent":
            self.requests.append(about["request"]["url"])
        elif event == "Network.webSocketCreated":
            self.requests.append(about["url"])

    def open(self, url):
        self.call("Page.navigate", url=url)
        self.wait("document.readyState === 'complete'", f"{url.split('#')[0]} is loaded")

    def size(self, width, height, theme):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])

    def value(self, expression):
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise AssertionError(f"{expression}: {answer['exceptionDetails']['exception'].get('description')}")
        return answer["result"].get("value")

    def wait(self, expression, what, patience_s=PATIENCE_S):
        return until(lambda: self.value(expression), what, patience_s)

    def text(self, test_id):
        return self.value(f"{find(test_id)}.textContent")

    def visible(self, test_id):
        return self.value(f"Boolean({find(test_id)}?.checkVisibility())")

    def wait_visible(self, test_id, patience_s=PATIENCE_S):
        self.wait(f"Boolean({find(test_id)}?.checkVisibility())", f"{test_id} is to be seen", patience_s)

    def wait_text(self, test_id, part, patience_s=PATIENCE_S):
        self.wait(f"{find(test_id)}.textContent.includes({json.dumps(part)})", f"{test_id} says {part!r}", patience_s)

    def middle(self, test_id):
        """Where to click: the element's middle, which nothing may cover, or nothing while it is not ready for a click."""
        return self.value(f"""(() => {{
            const node = {find(test_id)};
            if (!node?.checkVisibility() || node.disabled) return null;
            node.scrollIntoView({{ block: "nearest" }});
            const box = node.getBoundingClientRect();
            const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
            const hit = document.elementFromPoint(x, y);
            return node.contains(hit) ? [x, y] : null;
        }})()""")

    def click(self, test_id):
        x, y = until(lambda: self.middle(test_id), f"{test_id} may be clicked")
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y)

    def mouse(self, kind, x, y, buttons=1):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=buttons, clickCount=1)

    def drag(self, start, end):
        self.mouse("mousePressed", *start)
        for share in (0.25, 0.5, 0.75, 1.0):
            self.mouse("mouseMoved", *(a + share * (b - a) for a, b in zip(start, end)))
        self.mouse("mouseReleased", *end)

    def write(self, test_id, text):
        """Replaces what a field holds, as by typing, and leaves it."""
        self.click(test_id)
        self.value(f"{find(test_id)}.select()")
        self.call("Input.insertText", text=text)
        self.key("Tab")

    def key(self, name):
        key, code, number = KEYS[name]
        text = {"Space": " ", "Enter": "\r"}.get(name)
        about = {"key": key, "code": code, "windowsVirtualKeyCode": number}
        self.call("Input.dispatchKeyEvent", type="keyDown", **about, **({"text": text} if text else {}))
        self.call("Input.dispatchKeyEvent", type="keyUp", **about)

    def focus(self, test_id):
        self.value(f"{find(test_id)}.focus()")

    def picture(self, path):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))


def find(test_id):
    return f"document.querySelector('[data-testid=\"{test_id}\"]')"


def until(holds, what, patience_s=PATIENCE_S):
    """Asks until it holds; what it then says is the answer."""
    end = time.monotonic() + patience_s
    while True:
        answer = holds()
        if answer:
            return answer
        if time.monotonic() > end:
            raise AssertionError(f"not within {patience_s:.0f} s: {what}")
        time.sleep(0.05)
