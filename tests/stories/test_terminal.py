"""The terminal view in a real terminal (tmux, 80×24), operated by keys alone."""

import json
import os
import pty
import re
import signal
import subprocess
import time
from pathlib import Path

import pytest
from conftest import LIMIT_S, PROGRAMS, needs, trusswatch, until

GAGE = "module1/sensor/g2"


class Terminal:
    """A shell in tmux with its own server."""

    def __init__(self, folder):
        self.folder = folder
        shell = "env -u NO_COLOR PS1=ready: bash --norc --noprofile"
        self.tmux("-f", "/dev/null", "new-session", "-d", "-x", "80", "-y", "24", shell)
        self.shows("ready:")
        self.before = self.modes()

    def tmux(self, *words):
        environment = {name: value for name, value in os.environ.items() if name != "TMUX"} | {"LC_ALL": "C.UTF-8"}
        command = ["tmux", "-S", self.folder / "tmux", *words]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=LIMIT_S)
        assert done.returncode == 0, f"tmux {words}: {done.stderr}"
        return done.stdout

    def screen(self):
        return self.tmux("capture-pane", "-p")

    def keys(self, *keys):
        self.tmux("send-keys", *keys)

    def type(self, text):
        self.tmux("send-keys", "-l", text)

    def shows(self, *patterns):
        """Waits until every pattern is on the screen, and returns the screen."""
        def probe():
            screen = self.screen()
            return all(re.search(pattern, screen) for pattern in patterns) and screen

        try:
            return until(f"{patterns} on the screen", probe)
        except AssertionError:
            print(self.screen())
            raise

    def view(self, endpoint, who="--by ada"):
        self.type(f"{PROGRAMS}/trusswatch watch --connect {endpoint} {who}")
        self.keys("Enter")
        until("the view", lambda: self.state()[0] == "1")

    def modes(self):
        """The settings of the terminal, as `stty` reads them in the shell."""
        file = self.folder / "modes"
        file.unlink(missing_ok=True)
        self.type(f"stty -g >{file}.new && mv {file}.new {file}")
        self.keys("Enter")
        until("stty has run", file.exists)
        return file.read_text()

    def state(self):
        """Whether the alternate screen is on, and whether the cursor is shown."""
        return self.tmux("display-message", "-p", "#{alternate_on} #{cursor_flag}").split()

    def program(self):
        """The program that runs in the shell."""
        shell = self.tmux("display-message", "-p", "#{pane_pid}").strip()
        return int(subprocess.run(["pgrep", "-P", shell], capture_output=True, text=True).stdout.split()[0])

    def is_as_before(self):
        until("the alternate screen is off, the cursor shown", lambda: self.state() == ["0", "1"])
        assert self.modes() == self.before

    def end(self):
        subprocess.run(["tmux", "-S", self.folder / "tmux", "kill-server"], capture_output=True)


@pytest.fixture
def terminal(tmp_path):
    needs("tmux", "pgrep")
    terminal = Terminal(tmp_path)
    yield terminal
    terminal.end()


def test_an_operator_handles_a_fault_by_keys_alone(terminal, rig):
    configs = rig.with_free_ports()
    plant, module1, _ = rig.endpoints()

    # Started first, the view shows its endpoint, and updates once modules appear.
    terminal.view(module1)
    terminal.shows("no module answers yet at tcp/", "NO NETWORK: no connection")
    rig.plant(configs)
    rig.diagnoser("module1", configs)
    rig.diagnoser("module2", configs)
    terminal.shows("module1 +in service", "module2 +in service")
    terminal.keys("?")
    terminal.shows("KEYS", "SYMBOLS")
    terminal.keys("Escape")

    # A fault is shown within a second of its publication time in the journal.
    trusswatch("inject", GAGE, "bias", "--offset-m", "1.5e-4", "--connect", plant)
    terminal.shows(rf"▲ +{GAGE} +latched")
    shown = time.time()
    transitions = json.loads(trusswatch("history", "--json", "--connect", module1))["transitions"]
    latched = [one for one in transitions if one["component"] == GAGE and one["state"] == "latched"]
    assert shown - latched[-1]["time_unix_ns"] / 1e9 < 1

    # Its component page has live plots, a kind and a freeze frame.
    terminal.keys("Enter")
    terminal.shows(rf"{GAGE} of tower: latched", "residual", "╌", "[⠁-⣿]")
    terminal.shows("┊ onset and detection", "┊", r"kind +\w")
    terminal.keys("Escape")
    terminal.shows("ALARMS")

    # It is acknowledged, with a note and a name.
    terminal.keys("a")
    terminal.shows(f"acknowledge {GAGE} of tower")
    terminal.type("seen on site")
    terminal.keys("Enter")
    terminal.shows(f"SEND: acknowledge {GAGE} of tower by ada: seen on site")
    terminal.keys("Enter")
    terminal.shows(rf"△ +{GAGE} +acknowledged", f"{GAGE}: acknowledged: now acknowledged")
    assert "acknowledged by ada: seen on site" in trusswatch("history", "--connect", module1)

    # It is shelved, which requires a reason, and unshelved.
    terminal.keys("s")
    terminal.shows("for +2h_")
    terminal.keys("Enter", "Enter")
    terminal.shows("a reason is needed")
    terminal.type("painting")
    terminal.keys("Enter")
    terminal.shows(f"SEND: shelve {GAGE} of tower for 2h by ada")
    terminal.keys("Enter")
    terminal.shows(rf"‖ +{GAGE}", f"{GAGE}: shelved: transition")
    terminal.keys("u", "Enter", "Enter")
    terminal.shows(rf"△ +{GAGE}", f"{GAGE}: unshelved: transition")

    # Its history; then the screen is frozen, with its age, and live again.
    terminal.keys("h")
    terminal.shows(f"HISTORY of {GAGE}", "acknowledged by ada: seen", "latched")
    terminal.keys("Escape", "f")
    terminal.shows(r"FROZEN [1-9]\d* s")
    terminal.keys("f")
    until("live again", lambda: "FROZEN" not in terminal.screen())

    # Its only entry point is killed: it is cut off, and knows nothing of module 2, which still runs.
    rig.end("module1", signal.SIGKILL)
    screen = terminal.shows("CUT OFF: tcp/", "module2 +NOT KNOWN")
    assert "NOT ANSWERING" not in screen and "GONE" not in screen, screen
    rig.diagnoser("module1", configs)
    terminal.shows("connected to tcp/", "module1 +in service", "module2 +in service", rf"△ +{GAGE} +acknowledged")

    # A killed diagnoser is listed as not answering among modules and alarms.
    rig.end("module2", signal.SIGKILL)
    terminal.shows(r"✖ +module2 +NOT ANSWERING +- +\d+ s ago", r"✖ +module2 +NOT ANSWERING +\d+ s ")


def test_the_terminal_is_given_back_however_the_view_ends(terminal, rig):
    configs = rig.with_free_ports()
    _, module1, _ = rig.endpoints()
    rig.plant(configs)
    rig.diagnoser("module1", configs)
    rig.diagnoser("module2", configs)
    terminal.view(module1)
    terminal.shows("module1 +in service")

    terminal.keys("C-z")
    terminal.is_as_before()
    terminal.type("fg")
    terminal.keys("Enter")
    terminal.shows("module1 +in service")
    terminal.tmux("resize-window", "-x", "120", "-y", "40")
    terminal.shows("what it is +why")
    terminal.tmux("resize-window", "-x", "80", "-y", "24")
    terminal.shows("what it is; why")
    terminal.keys("q")
    terminal.is_as_before()

    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        terminal.view(module1)
        terminal.shows("module1 +in service")
        os.kill(terminal.program(), number)
        terminal.is_as_before()

    # The view is a client of module1's diagnoser: without it there is no connection, and no component is shown as normal.
    terminal.view(module1)
    terminal.shows("module1 +in service")
    rig.end("module1", signal.SIGKILL)
    silent = re.compile(r"module1 +NOT KNOWN +- +(\d+) s ago")
    age = int(silent.search(terminal.shows(silent.pattern, "CUT OFF", "unknown"))[1])
    until("its age grows", lambda: (now := silent.search(terminal.screen())) and int(now[1]) > age)
    rig.diagnoser("module1", configs)
    terminal.shows("module1 +in service")
    terminal.keys("q")
    terminal.is_as_before()

    # Closed with its terminal, the view ends.
    terminal.view(module1)
    program = Path(f"/proc/{terminal.program()}")
    terminal.end()
    until("the view has ended", lambda: not program.exists())


@pytest.mark.parametrize("holder, answer", [
    ("observer.wall", "commands disabled: the certificate is not an"),
    ("operator.ada", "no component is selected"),
])
def test_only_an_operators_certificate_permits_commands(terminal, tmp_path, holder, answer):
    pki = tmp_path / "pki"
    trusswatch("pki", "authority", "tower", "--dir", pki)
    trusswatch("pki", "issue", holder, "--dir", pki)
    # No process listens there; the permission to issue commands is known all the same.
    terminal.view("tls/127.0.0.1:1", f"--tls {pki}/{holder}")
    terminal.keys("a")
    terminal.shows(answer)
    terminal.keys("q")
    terminal.is_as_before()


def test_the_view_ends_without_a_panic_when_its_terminal_goes_with_standard_error():
    master, slave = pty.openpty()
    command = [f"{PROGRAMS}/trusswatch", "watch", "--connect", "tcp/127.0.0.1:9"]
    # In a session of its own, so that no SIGHUP ends it before it reads and writes in vain.
    view = subprocess.Popen(command, stdin=slave, stdout=slave, stderr=slave, start_new_session=True)
    os.close(slave)
    drawn = b""
    while b"\x1b[?1049h" not in drawn:
        drawn += os.read(master, 4096)
    os.close(master)
    try:
        assert view.wait(LIMIT_S) == 1
    finally:
        view.kill()
