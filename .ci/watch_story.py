"""The terminal view in a real terminal: a plant, two diagnosers, and `trusswatch watch` in tmux, used by keys.

    python3 watch_story.py     (needs tmux, and deploy/compose in PYTHONPATH)
"""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from pathlib import Path

from expectations import require, seen, until

ROOT = Path(__file__).resolve().parent.parent
BIN = ROOT / "target/release"
# Nothing takes longer, on however busy a machine.
LIMIT_S = 60
GAGE = "module1/sensor/g2"


def free_ports(count):
    """Ports that were free a moment ago, all different."""
    sockets = [socket.socket() for _ in range(count)]
    try:
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]
    finally:
        for one in sockets:
            one.close()


def configured(folder):
    """The shipped configurations with ports of this run; returns those."""
    shutil.copytree(ROOT / "configs", folder, dirs_exist_ok=True)
    ports = dict(zip(("7447", "7448", "7449"), free_ports(3)))
    for name in ("plant", "module1", "module2"):
        file = folder / f"{name}.toml"
        file.write_text(re.sub(r"127\.0\.0\.1:(744\d)", lambda found: f"127.0.0.1:{ports[found[1]]}", file.read_text()))
    return [f"tcp/127.0.0.1:{port}" for port in ports.values()]


def start(folder, name):
    program = "trusswatch-plant" if name == "plant" else "trusswatch-diagnoser"
    command = [BIN / program, "run", folder / f"{name}.toml"]
    if name != "plant":
        command += ["--state-dir", folder / f"state-{name}"]
    return subprocess.Popen(command, stderr=(folder / f"{name}.log").open("wb"))


def trusswatch(*arguments):
    done = subprocess.run([BIN / "trusswatch", *arguments], capture_output=True, text=True, timeout=LIMIT_S)
    require(done.returncode == 0, f"{arguments}: {done.returncode} {done.stdout} {done.stderr}")
    return done.stdout


class Terminal:
    """A shell in tmux with a server of its own."""

    def __init__(self, folder):
        self.folder = folder
        self.socket = folder / "tmux"
        shell = "env -u NO_COLOR PS1=ready: bash --norc --noprofile"
        self.tmux("-f", "/dev/null", "new-session", "-d", "-x", "80", "-y", "24", shell)
        until("the shell is there", LIMIT_S, lambda: "ready:" in self.screen())
        self.before = self.modes()

    def tmux(self, *arguments):
        environment = {name: value for name, value in os.environ.items() if name != "TMUX"} | {"LC_ALL": "C.UTF-8"}
        done = subprocess.run(["tmux", "-S", self.socket, *arguments], capture_output=True, text=True, env=environment, timeout=LIMIT_S)
        require(done.returncode == 0, f"tmux {arguments}: {done.stderr}")
        return done.stdout

    def screen(self):
        return self.tmux("capture-pane", "-p")

    def keys(self, *keys):
        self.tmux("send-keys", *keys)

    def type(self, text):
        self.tmux("send-keys", "-l", text)

    def shows(self, what, *patterns, seconds=LIMIT_S):
        """Waits until every pattern is on the screen, and returns the screen."""
        def probe():
            screen = self.screen()
            return screen if all(re.search(pattern, screen) for pattern in patterns) else None
        try:
            return until(what, seconds, probe)
        except Exception:
            print(self.screen())
            raise

    def modes(self):
        """The settings of the terminal, as `stty` reads them in the shell."""
        file = self.folder / "modes"
        file.unlink(missing_ok=True)
        self.type(f"stty -g >{file}.new && mv {file}.new {file}")
        self.keys("Enter")
        until("stty has run", LIMIT_S, file.exists)
        return file.read_text()

    def state(self):
        """Whether the alternate screen is on, and whether the cursor is shown."""
        return self.tmux("display-message", "-p", "#{alternate_on} #{cursor_flag}").split()

    def program(self):
        """The program that runs in the shell."""
        shell = self.tmux("display-message", "-p", "#{pane_pid}").strip()
        return int(subprocess.run(["pgrep", "-P", shell], capture_output=True, text=True).stdout.split()[0])

    def is_as_before(self, how):
        until(f"{how}: the alternate screen is off, the cursor shown", LIMIT_S, lambda: self.state() == ["0", "1"])
        require(self.modes() == self.before, f"{how}: the terminal's settings are not what they were")
        seen(how, "alternate screen off, cursor shown, settings as before")

    def end(self):
        subprocess.run(["tmux", "-S", self.socket, "kill-server"], capture_output=True)


def view(terminal, endpoint, who="--by ada"):
    terminal.type(f"{BIN}/trusswatch watch --connect {endpoint} {who}")
    terminal.keys("Enter")
    until("the view is there", LIMIT_S, lambda: terminal.state()[0] == "1")


def latched_at(endpoint, component):
    """When the verdict was published [s], by the module's journal."""
    history = json.loads(trusswatch("history", "--json", "--connect", endpoint))
    own = [one for one in history["transitions"] if one["component"] == component and one["state"] == "latched"]
    return own[-1]["time_unix_ns"] / 1e9


def a_fault_comes(terminal, plant, module1):
    trusswatch("inject", GAGE, "bias", "--offset-m", "1.5e-4", "--connect", plant)
    terminal.shows("the fault is on the screen", rf"▲ +{GAGE} +latched")
    on_screen = time.time()
    delay = on_screen - latched_at(module1, GAGE)
    require(delay < 1, f"the fault was shown {delay:.2f} s after it was published")
    seen("a fault", f"on the screen {1e3 * delay:.0f} ms after it was published")
    terminal.keys("Enter")
    terminal.shows("the component with its plots", rf"{GAGE} of tower: latched", "residual", "╌", "[⠁-⣿]")
    terminal.shows("the freeze frame", "┊ onset and detection", "┊", r"kind +\w")
    seen("Enter", "the component with its kind, its freeze frame and live plots")
    terminal.keys("Escape")
    terminal.shows("the list again", "ALARMS")


def it_is_acknowledged(terminal, module1):
    terminal.keys("a")
    terminal.shows("the note is typed", f"acknowledge {GAGE} of tower")
    terminal.type("seen on site")
    terminal.keys("Enter")
    terminal.shows("what is to be sent", f"SEND: acknowledge {GAGE} of tower by ada: seen on site")
    terminal.keys("Enter")
    terminal.shows("the acknowledgement", rf"△ +{GAGE} +acknowledged", f"{GAGE} acknowledged: now acknowledged")
    history = trusswatch("history", "--connect", module1)
    require("acknowledged by ada: seen on site" in history, history)
    seen("a", "acknowledged; `trusswatch history` has the name and the note")


def it_is_shelved(terminal):
    terminal.keys("s")
    terminal.shows("the span is typed", "for +2h_")
    terminal.keys("Enter")
    terminal.keys("Enter")
    terminal.shows("no shelving without a reason", "a reason is needed")
    terminal.type("painting")
    terminal.keys("Enter")
    terminal.shows("what is to be sent", f"SEND: shelve {GAGE} of tower for 2h by ada")
    terminal.keys("Enter")
    # A diagnoser of a version whose command line cannot shelve refuses it, and the view says so.
    if re.search(r"(?m)^ +shelve ", trusswatch("fault", "--help")):
        terminal.shows("shelved", rf"‖ +{GAGE}", f"{GAGE} shelved: now")
        terminal.keys("u", "Enter", "Enter")
        terminal.shows("unshelved", rf"△ +{GAGE}", f"{GAGE} unshelved: now")
        seen("s, u", "shelved and unshelved")
    else:
        terminal.shows("the refusal", "shelve refused: |shelve: nobody takes|shelve: no answer")
        seen("s", "refused by a diagnoser that cannot shelve, and shown")


def history_and_freezing(terminal):
    terminal.keys("h")
    terminal.shows("the history", f"HISTORY of {GAGE}", "acknowledged by ada: seen", "latched")
    terminal.keys("Escape", "f")
    terminal.shows("frozen, with its age", r"FROZEN [1-9]\d* s")
    terminal.keys("f")
    until("thawed", LIMIT_S, lambda: "FROZEN" not in terminal.screen())
    seen("h, f", "history; frozen and thawed")


def story(folder, running, terminal):
    plant, module1, _ = configured(folder)
    view(terminal, module1)
    terminal.shows("nobody answers", "no module answers yet; looking at tcp/", "NO NETWORK: no connection")
    seen("before anything else", "no module answers yet, and where it looks")
    running += [start(folder, name) for name in ("plant", "module1", "module2")]
    terminal.shows("the modules come", "module1 +in service", "module2 +in service")
    seen("the modules", "came by themselves, in service")
    terminal.keys("?")
    terminal.shows("the help", "KEYS", "SYMBOLS")
    terminal.keys("Escape")
    a_fault_comes(terminal, plant, module1)
    it_is_acknowledged(terminal, module1)
    it_is_shelved(terminal)
    history_and_freezing(terminal)
    running[-1].kill()
    terminal.shows("silent among the modules and the alarms", r"✖ +module2 +SILENT +- +\d+ s ago", r"✖ +module2 +SILENT +\d+ s ")
    seen("a diagnoser killed", "SILENT among the modules and the alarms")
    endings(terminal, module1)
    the_network_goes_and_comes(folder, running, terminal, module1)
    certificates_bound_it(folder, terminal)
    the_terminal_is_closed(terminal, module1)


def the_network_goes_and_comes(folder, running, terminal, module1):
    """The view is a client of module1's diagnoser: without that there is no network."""
    view(terminal, module1)
    terminal.shows("in service", "module1 +in service")
    running[1].kill()
    running[1].wait()
    silent = re.compile(r"✖ +module1 +SILENT +- +(\d+) s ago")
    screen = terminal.shows("nothing is called normal that is not known to be", silent.pattern, "unknown")
    age = int(silent.search(screen)[1])
    until("its age grows", LIMIT_S, lambda: (now := silent.search(terminal.screen())) and int(now[1]) > age)
    running.append(start(folder, "module1"))
    terminal.shows("it is back", "module1 +in service")
    terminal.keys("q")
    terminal.is_as_before("q, after the network was away")
    seen("the network away", "SILENT, older every second; in service again when it came back")


def certificates_bound_it(folder, terminal):
    """Nobody listens there; who may give orders is known all the same."""
    pki = folder / "pki"
    trusswatch("pki", "authority", "tower", "--dir", pki)
    trusswatch("pki", "issue", "operator.ada", "observer.wall", "--dir", pki)
    for holder, answer in (("observer.wall", "no orders from here: the certificate that is shown is not an"),
                           ("operator.ada", "no component is selected")):
        view(terminal, "tls/127.0.0.1:1", f"--tls {pki}/{holder}")
        terminal.keys("a")
        terminal.shows(f"what {holder} may do", answer)
        terminal.keys("q")
        terminal.is_as_before(f"q, as {holder}")
        seen(f"{holder} orders", answer)


def the_terminal_is_closed(terminal, module1):
    view(terminal, module1)
    program = Path(f"/proc/{terminal.program()}")
    terminal.end()
    until("the view ends with its terminal", LIMIT_S, lambda: not program.exists())
    seen("the terminal closed", "the view has ended")


def endings(terminal, module1):
    terminal.keys("C-z")
    terminal.is_as_before("Ctrl-Z")
    terminal.type("fg")
    terminal.keys("Enter")
    terminal.shows("continued", "module1 +in service")
    seen("fg", "drawn again")
    terminal.tmux("resize-window", "-x", "120", "-y", "40")
    terminal.shows("the wider screen", "what it is +why")
    terminal.tmux("resize-window", "-x", "80", "-y", "24")
    terminal.shows("the narrow screen", "what it is; why")
    seen("resized", "drawn for the new size")
    terminal.keys("q")
    terminal.is_as_before("q")
    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        view(terminal, module1)
        terminal.shows("in service", "module1 +in service")
        os.kill(terminal.program(), number)
        terminal.is_as_before(number.name)


def main():
    folder = Path(tempfile.mkdtemp(prefix="trusswatch-watch-"))
    running, terminal = [], None
    try:
        terminal = Terminal(folder)
        story(folder, running, terminal)
    finally:
        if terminal:
            terminal.end()
        for process in running:
            process.kill()
            process.wait()
        shutil.rmtree(folder)
    print("the terminal view: used by keys alone, and the terminal is as it was")


main()
