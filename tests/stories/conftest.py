"""Fixtures of the stories, which use the real programs as an operator, an integrator or an administrator does.

    pytest tests/stories                  those of the check
    pytest tests/stories -m nightly       the long ones

A story that lacks a tool is skipped, and fails with CI set.
"""

import contextlib
import ctypes
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = Path(os.environ.get("TRUSSWATCH_PROGRAMS", ROOT / "target/release"))
# Package and image contain the same programs.
os.environ.setdefault("PROFILE", PROGRAMS.name)
CLONE_NEWNET = 0x40000000
LIBC = ctypes.CDLL(None)
# The simulated tower and its two diagnosers, as configured.
SHIPPED = {"plant": 7447, "module1": 7448, "module2": 7449}
# Time limit of a single step of a story, also on a busy machine.
LIMIT_S = 60

sys.path.insert(0, str(ROOT / "deploy/compose"))


def cannot(what, why):
    """Skips a story that cannot run on this machine."""
    if os.environ.get("CI"):
        pytest.fail(f"{what}: {why}; with CI set, a skipped story has failed", pytrace=False)
    pytest.skip(f"{what}: {why}")


def needs(*programs):
    missing = [program for program in programs if not shutil.which(program)]
    if missing:
        cannot("tools", f"needs {', '.join(missing)}: run .ci/tools")


def until(what, probe, seconds=LIMIT_S, pause_s=0.05):
    """Calls `probe` until it returns a true value, and returns that value."""
    end = time.monotonic() + seconds
    while not (answer := probe()):
        assert time.monotonic() < end, f"{what}: not within {seconds} s"
        time.sleep(pause_s)
    return answer


def trusswatch(*words, check=True, timeout=LIMIT_S):
    """Runs a command line; returns its standard output, or with check=False the finished process."""
    command = [PROGRAMS / "trusswatch", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=timeout)
    if not check:
        return done
    assert done.returncode == 0, f"{words}: exit code {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def documented(name):
    """The shell command after the line `<!-- NAME command -->` in a document."""
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True)
    for document in listed.stdout.split():
        text = (ROOT / document).read_text()
        found = re.search(rf"^<!-- {re.escape(name)} command -->\n+```\w*\n(.*?)^```", text, re.M | re.S)
        if found:
            return found[1]
    raise AssertionError(f"no document has a `{name} command`")


def free_ports(count):
    """Different ports of this machine that were free a moment ago."""
    with contextlib.ExitStack() as taken:
        return [taken.enter_context(socket.create_server(("127.0.0.1", 0))).getsockname()[1] for _ in range(count)]


class Rig:
    """Processes of a story, with logs in its directory; all end with the story."""

    def __init__(self, folder):
        self.folder, self.processes, self.ports = folder, {}, dict(SHIPPED)

    def start(self, name, *command, **options):
        options.setdefault("stdout", (self.folder / f"{name}.out").open("ab"))
        options.setdefault("stderr", (self.folder / f"{name}.log").open("ab"))
        # Its own process group, so that children of a shell end with it.
        command = [str(word) for word in command]
        self.processes[name] = subprocess.Popen(command, cwd=ROOT, start_new_session=True, **options)
        return self.processes[name]

    def with_free_ports(self):
        """Copies the shipped configurations with free ports; returns their directory."""
        configs = self.folder / "configs"
        shutil.copytree(ROOT / "configs", configs)
        self.ports = dict(zip(SHIPPED, free_ports(len(SHIPPED))))
        new = {str(SHIPPED[name]): str(port) for name, port in self.ports.items()}
        for name in SHIPPED:
            file = configs / f"{name}.toml"
            text = file.read_text()
            file.write_text(re.sub(r"127\.0\.0\.1:(\d+)", lambda at: f"127.0.0.1:{new.get(at[1], at[1])}", text))
        return configs

    def endpoints(self):
        return [f"tcp/127.0.0.1:{port}" for port in self.ports.values()]

    def plant(self, configs=ROOT / "configs"):
        return self.start("plant", PROGRAMS / "trusswatch-plant", "run", configs / "plant.toml")

    def diagnoser(self, module, configs=ROOT / "configs"):
        state = self.folder / f"state-{module}"
        return self.start(module, PROGRAMS / "trusswatch-diagnoser", "run", configs / f"{module}.toml", "--state-dir", state)

    def end(self, name, how=signal.SIGTERM):
        """Stops a process and returns its exit code."""
        process = self.processes.pop(name)
        process.send_signal(how)
        return process.wait(timeout=LIMIT_S)

    def end_all(self):
        for process in self.processes.values():
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
        for process in self.processes.values():
            process.wait()
        self.processes.clear()

    def logs(self):
        return "\n".join(f"-- {log.name}\n{log.read_text(errors='replace')[-3000:]}" for log in sorted(self.folder.glob("*.log")))


@pytest.fixture
def rig(tmp_path, request):
    rig = Rig(tmp_path)
    yield rig
    rig.end_all()
    if getattr(request.node, "failed", False):
        print(rig.logs())


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report = yield
    item.failed = report.when == "call" and report.failed
    return report


@contextlib.contextmanager
def back_in_this_network():
    """Restores the process's present network afterwards."""
    with open("/proc/self/ns/net") as before:
        try:
            yield
        finally:
            LIBC.setns(before.fileno(), CLONE_NEWNET)


@pytest.fixture(scope="session")
def another_network():
    """An empty network namespace, if permitted; one for all stories, since the threads of Zenoh's library stay in it."""
    with back_in_this_network():
        if LIBC.unshare(CLONE_NEWNET) != 0:
            return None
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
        return open("/proc/self/ns/net")


@pytest.fixture
def own_network(another_network):
    """Runs the story in the separate network, because shipped configurations have fixed ports. All stories that use Zenoh's
    library run there.
    """
    with back_in_this_network():
        if another_network:
            LIBC.setns(another_network.fileno(), CLONE_NEWNET)
        yield
