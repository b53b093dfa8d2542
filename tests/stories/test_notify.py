"""People are told of an incident once each, whatever is killed meanwhile: by webhook, ntfy, mail, and a real Alertmanager."""

import contextlib
import email
import email.header
import email.policy
import http.server
import json
import os
import re
import shutil
import signal
import threading
import time
import urllib.request
from pathlib import Path

import pytest
from aiosmtpd.controller import Controller
from conftest import LIMIT_S, PROGRAMS, ROOT, cannot, free_ports, needs, trusswatch, until
from playwright.sync_api import expect, sync_playwright
from test_terminal import Terminal

ALERTMANAGER = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "trusswatch/prometheus/usr/bin/prometheus-alertmanager"
# From the command that makes the fault to Alertmanager's recipient, and from the verdict to the other recipients.
TOLD_WITHIN_S = 4
TOLD_AFTER_VERDICT_S = 2
PHONE = {"width": 390, "height": 844}
COMPONENT = "module1/actuator/a1"


class HttpSink:
    """Keeps what is posted; answers with `status`."""

    def __init__(self):
        self.heard, self.status = [], 200
        sink = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"])).decode()
                if sink.status == 200:
                    sink.heard.append((time.time(), self.headers, body))
                self.send_response(sink.status)
                self.end_headers()

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}/tower"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def documents(self):
        return [json.loads(body) for _, _, body in self.heard]


class MailSink:
    """Keeps what is mailed."""

    def __init__(self):
        self.heard, self.times = [], []
        [self.port] = free_ports(1)
        self.controller = Controller(self, hostname="127.0.0.1", port=self.port)
        self.controller.start()

    async def handle_DATA(self, server, session, envelope):
        message = email.message_from_bytes(envelope.content, policy=email.policy.default)
        self.heard.append(message)
        self.times.append(time.time())
        return "250 OK"


class Alertmanager:
    def __init__(self, rig, folder, receiver):
        if not ALERTMANAGER.exists():
            cannot("Alertmanager", "run .ci/tools prometheus")
        [port] = free_ports(1)
        self.url = f"http://127.0.0.1:{port}"
        route = {"receiver": "people", "group_by": ["incident"], "group_wait": "0s", "group_interval": "1s", "repeat_interval": "1h"}
        people = {"name": "people", "webhook_configs": [{"url": receiver, "send_resolved": True}]}
        (folder / "alertmanager.yml").write_text(json.dumps({"route": route, "receivers": [people]}))
        rig.start("alertmanager", ALERTMANAGER, f"--config.file={folder}/alertmanager.yml", f"--storage.path={folder}/alertmanager",
                  f"--web.listen-address=127.0.0.1:{port}", "--cluster.listen-address=")
        until("Alertmanager answers", lambda: self.get("/api/v2/status"))

    def get(self, path):
        with contextlib.suppress(OSError):
            with urllib.request.urlopen(self.url + path, timeout=10) as answer:
                return json.load(answer)

    def alerts(self):
        """State of each alert by its incident."""
        return {alert["labels"]["incident"]: alert["status"]["state"] for alert in self.get("/api/v2/alerts") or []}


@pytest.fixture
def tower(rig):
    """The tower in service, with a function that starts the process that tells people."""
    configs = rig.with_free_ports()
    rig.plant(configs)
    for module in "module1", "module2":
        rig.diagnoser(module, configs)
    link = ["--mode", "peer", *(word for endpoint in rig.endpoints() for word in ("--connect", endpoint))]
    until("all is well", lambda: trusswatch("faults", "--exit-code", *link, check=False).returncode == 0)

    def notify(*words):
        return rig.start("notify", PROGRAMS / "trusswatch", "notify", *words, "--state-dir", rig.folder / "calls",
                         "--drawing", ROOT / "configs/tower.toml", "--page", "https://tower.example.org", *link)
    return rig, configs, link, notify


def page(port):
    with contextlib.suppress(OSError):
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=10) as answer:
            return answer.read().decode()
    return ""


@contextlib.contextmanager
def phone(address, state):
    """The page on a phone that stays signed in."""
    needs("chromium")
    expect.set_options(timeout=1000 * LIMIT_S)
    link = trusswatch("web", "link", "ada", "--state-dir", state, "--address", address).strip()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_context(viewport=PHONE, has_touch=True, is_mobile=True).new_page()
        page.goto(link)
        page.get_by_label("Keep this device signed in").check()
        page.get_by_role("button", name="Sign in").tap()
        yield page
        browser.close()


def title_of(heard):
    return str(email.header.make_header(email.header.decode_header(heard[1]["Title"])))


def order(link, *words):
    """Gives an order, again while the module does not answer."""
    done = until(f"an answer to {words}", lambda: (done := trusswatch(*words, *link, check=False)).returncode != 4 and done)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture
def terminal(tmp_path):
    needs("tmux")
    folder = tmp_path / "terminal"
    folder.mkdir()
    terminal = Terminal(folder)
    yield terminal
    terminal.end()


def test_an_incident_is_told_once_to_each_until_it_is_over(tower, tmp_path, terminal):
    rig, configs, link, notify = tower
    terminal.view(rig.endpoints()[1])
    webhook, ntfy, mail, people = HttpSink(), HttpSink(), MailSink(), HttpSink()
    alertmanager = Alertmanager(rig, tmp_path, people.url)
    [health] = free_ports(1)
    words = ["--webhook", webhook.url, "--ntfy", ntfy.url, "--alertmanager", alertmanager.url, "--mail", "ada@example.org",
             "--smtp", f"smtp://127.0.0.1:{mail.port}", "--mail-from", "tower@example.org", "--health", f"127.0.0.1:{health}"]
    notify(*words)
    until("it observes", lambda: trusswatch("health", f"127.0.0.1:{health}", check=False).returncode == 0)
    [port] = free_ports(1)

    def web():
        rig.start("web", PROGRAMS / "trusswatch", "web", "--listen", f"127.0.0.1:{port}", "--notifier", f"127.0.0.1:{health}",
                  "--state-dir", rig.folder / "web", *link)
        until("the page is served", lambda: page(port))
    web()

    begun = time.monotonic()
    trusswatch("inject", COMPONENT, "hard_over", *link)
    until("all are told", lambda: webhook.heard and ntfy.heard and mail.heard and people.heard)
    assert time.monotonic() - begun < TOLD_WITHIN_S
    [told] = webhook.documents()
    assert told["call"] == "opened" and told["incident"]["component"] == COMPONENT
    assert "hard-over" in told["title"] and told["incident"]["severity"] == "critical"
    assert told["place"].startswith("level ") and told["drawing"].startswith("<svg")
    assert told["link"] == f"https://tower.example.org/component/{COMPONENT}"
    incident = told["incident"]["id"]
    entries = json.loads(trusswatch("history", "--json", *link))["transitions"]
    [latched_s] = [e["time_unix_ns"] / 1e9 for e in entries if e["component"] == COMPONENT and e["state"] == "latched"]
    delays = [round(at - latched_s, 2) for at in (webhook.heard[0][0], ntfy.heard[0][0], mail.times[0])]
    print(f"told after the verdict [s]: {delays}")
    assert max(delays) < TOLD_AFTER_VERDICT_S, delays
    [(_, headers, body)] = ntfy.heard
    assert "hard-over" in title_of(ntfy.heard[0]) and headers["Priority"] == "5" and incident in body
    [message] = mail.heard
    assert "hard-over" in message["Subject"] and message["To"] == "ada@example.org"
    parts = [part.get_content_type() for part in message.walk()]
    assert "text/plain" in parts and "image/svg+xml" in parts
    assert alertmanager.alerts() == {incident: "active"}
    # One incident everywhere, however many effects it has.
    shown = json.loads(trusswatch("faults", "--json", *link))
    assert incident in [row["incident"] for row in shown["incidents"]]
    screen = terminal.shows(rf"▲ +{COMPONENT} +latched")
    assert len(re.findall(rf"▲ +{COMPONENT}", screen)) == 1, screen

    # Killed and started again, nobody is told twice, and nobody is forgotten.
    for name in "notify", "module1", "module2", "web", "plant":
        rig.end(name, signal.SIGKILL)
    rig.plant(configs)
    rig.diagnoser("module1", configs)
    rig.diagnoser("module2", configs)
    notify(*words)
    web()
    until("it observes", lambda: trusswatch("health", f"127.0.0.1:{health}", check=False).returncode == 0)
    # A simulated structure is new after a restart, the cylinder of a real one would still be broken.
    order(link, "inject", COMPONENT, "hard_over")
    with phone(f"http://127.0.0.1:{port}", rig.folder / "web") as page_of_ada:
        row = page_of_ada.locator("#alarms li").filter(has_text=COMPONENT).first
        # The row is the whole incident, also after the modules were killed.
        expect(page_of_ada.locator("#alarms li")).to_have_count(1, timeout=30_000)
        row.get_by_role("button", name="Acknowledge").tap()
        expect(page_of_ada.locator(".message")).to_contain_text("acknowledged")
    until("Alertmanager is quiet", lambda: alertmanager.alerts() == {incident: "suppressed"})
    terminal.shows(rf"△ +{COMPONENT} +acknowledged")

    # A recipient that is down for a while is told later; the health says so.
    webhook.status = 500
    order(link, "inject", COMPONENT, "--repair")
    terminal.shows(rf"△ +{COMPONENT} .*ready to re")
    until("the page says that it can be reset", lambda: "ready to reset" in page(port))
    order(link, "reset", COMPONENT, "--note", "repaired", "--by", "ada", "--wait", "40")
    until("the others are told", lambda: len(ntfy.heard) == 2 and len(mail.heard) == 2)
    said = until("health names the recipient", lambda: (
        done := trusswatch("health", f"127.0.0.1:{health}", check=False)).returncode == 1 and done.stdout + done.stderr)
    assert "webhook 127.0.0.1" in said and "500" in said
    until("the page says so, too", lambda: "Notifications are not delivered: webhook 127.0.0.1" in page(port))
    webhook.status = 200
    until("the webhook is told", lambda: len(webhook.heard) == 2)
    until("the page is content", lambda: (text := page(port)) and "Notifications are not" not in text)
    assert [document["call"] for document in webhook.documents()] == ["opened", "resolved"]
    assert {document["incident"]["id"] for document in webhook.documents()} == {incident}
    until("Alertmanager knows that it is over", lambda: alertmanager.alerts() == {})
    statuses = until("people know that it is over", lambda: [document["status"] for document in people.documents()][1:])
    assert statuses == ["resolved"] or statuses[-1] == "resolved"
    assert [len(sink.heard) for sink in (webhook, ntfy, mail)] == [2, 2, 2]
    terminal.shows("24 of 24 components are normal")
    assert COMPONENT not in terminal.screen().split("EVENTS")[0]
    # The page, too, remembers all of it, though it was killed.
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/incident?id={incident.replace('@', '%40')}", timeout=10) as answer:
        sheet = answer.read().decode()
    assert "by ada" in sheet and "not yet" not in sheet and "hard-over" in sheet


def test_what_nobody_acknowledges_is_told_again_and_that_nothing_is_heard_is_told(tower, tmp_path):
    rig, configs, link, notify = tower
    webhook, chief = HttpSink(), HttpSink()
    settings = tmp_path / "notify.toml"
    (tmp_path / "token").write_text("s3cret\n")
    settings.write_text(f'''escalate_after = "2s"
[[webhook]]
url = "{webhook.url}"
token_file = "token"
[[ntfy]]
url = "{chief.url}"
only_escalated = true
''')
    assert "2 recipients" in trusswatch("check", settings)
    notify(settings)
    trusswatch("inject", "module1/sensor/g2", "bias", "--offset-m", "1.5e-4", *link)
    until("it is told again", lambda: len(webhook.heard) == 2 and chief.heard)
    assert [document["call"] for document in webhook.documents()] == ["opened", "escalated"]
    assert all(headers["Authorization"] == "Bearer s3cret" for _, headers, _ in webhook.heard)
    assert len(chief.heard) == 1 and "NOT ACKNOWLEDGED" in title_of(chief.heard[0])
    # Dead man: every process that it could hear is gone.
    for name in "plant", "module1", "module2":
        rig.end(name, signal.SIGKILL)
    monitoring = until("it says that nothing is heard", lambda: [
        document for document in webhook.documents() if document["incident"]["name"] == "monitoring"])
    assert monitoring[0]["call"] == "opened" and monitoring[0]["incident"]["component"] is None
    # What is not known is not over.
    assert "resolved" not in [document["call"] for document in webhook.documents()]


def test_mistakes_are_named_before_anything_is_sent(tmp_path):
    for words, expected in [
        ([], "no recipients"),
        (["--webhook", "example.org"], "`url` of `webhook` is `example.org`"),
        (["--webhook", "https://ada:pw@example.org"], "contains a name or a password"),
        (["--mail", "ada"], "is not a mail address"),
        (["--webhook", "http://x.org", "--escalate-after", "soon"], "is not a time span"),
    ]:
        done = trusswatch("notify", *words, "--state-dir", tmp_path, check=False)
        assert done.returncode == 2 and expected in done.stderr, (words, done.stderr)
    (tmp_path / "calls.json").write_text("{")
    done = trusswatch("notify", "--webhook", "http://127.0.0.1:9", "--state-dir", tmp_path, "--connect", "tcp/127.0.0.1:9", check=False)
    assert done.returncode == 1 and "move it away" in done.stderr
