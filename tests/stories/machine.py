"""Machines with a real systemd: systemd-nspawn containers of a small Debian, each with a disk that
survives a power loss and its own network card."""

import os
import re
import shutil
import subprocess
import uuid
from pathlib import Path

from conftest import until

BRIDGE = "trusswatch0"


def run(*command, check=True, **options):
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    if check and done.returncode != 0:
        raise RuntimeError(f"`{' '.join(map(str, command))}` failed with {done.returncode}:\n{done.stdout}")
    return done


class Bridge:
    """The bridge between the machines and the host, which has this address on it."""

    def __init__(self, host):
        self.host = host

    def __enter__(self):
        run("ip", "link", "add", BRIDGE, "type", "bridge")
        run("ip", "address", "add", f"{self.host}/24", "dev", BRIDGE)
        run("ip", "link", "set", BRIDGE, "up")
        return self

    def __exit__(self, *_):
        run("ip", "link", "delete", BRIDGE, check=False)


class Machine:
    """One computer."""

    def __init__(self, name, address, tree, work):
        self.name, self.address = name, address
        self.folder = Path(work) / name
        self.root = self.folder / "root"
        self.log = self.folder / "console"
        self.nspawn = None
        self.leader = None
        upper, scratch = self.folder / "upper", self.folder / "scratch"
        for folder in (self.root, upper, scratch):
            folder.mkdir(parents=True)
        options = f"lowerdir={tree},upperdir={upper},workdir={scratch}"
        run("mount", "-t", "overlay", "overlay", "-o", options, self.root)
        (self.root / "etc/hostname").write_text(name + "\n")
        # A machine id of its own; without one systemd would treat this as a first boot.
        (self.root / "etc/machine-id").write_text(uuid.uuid4().hex + "\n")

    def boot(self):
        command = ["systemd-nspawn", "--boot", "--quiet", "-D", self.root, f"--machine={self.name}",
                   "--register=no", "--keep-unit", f"--network-bridge={BRIDGE}", "--console=pipe"]
        with open(self.log, "a") as log:
            self.nspawn = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self.leader = until(f"{self.name} boots", self._child)
        until(f"{self.name} has a service manager", self._is_up)
        self.do("ip", "address", "replace", f"{self.address}/24", "dev", "host0")
        self.do("ip", "link", "set", "host0", "up")

    def _child(self):
        """The machine's init process; before it nspawn starts others."""
        if self.nspawn.poll() is not None:
            raise RuntimeError(f"{self.name} does not boot:\n{self.log.read_text()[-2000:]}")
        children = run("ps", "-o", "pid=,comm=", "--ppid", self.nspawn.pid, check=False).stdout.splitlines()
        return next((pid for pid, name in map(str.split, children) if name == "systemd"), None)

    def _is_up(self):
        bus = self.enter("systemctl", "show", "--property=Version")
        return run(*bus, check=False).returncode == 0

    def enter(self, *command):
        return ["nsenter", "--target", self.leader, "--all", "--", *command]

    def do(self, *command, check=True):
        """Runs a command in the machine and returns its output."""
        return run(*self.enter(*map(str, command)), check=check).stdout

    def try_to(self, *command):
        """Runs a command in the machine; the command may fail."""
        return run(*self.enter(*map(str, command)), check=False)

    def succeeds(self, *command):
        return self.try_to(*command).returncode == 0

    def lose_power(self):
        run("kill", "-KILL", self.leader)
        self.nspawn.wait(timeout=20)
        self.leader = None

    def show(self, unit, *properties):
        """A unit's properties."""
        output = self.do("systemctl", "show", "--property", ",".join(properties), unit)
        return dict(line.split("=", 1) for line in output.splitlines() if "=" in line)

    def process(self, number):
        """The host's process id of a process with this id in the machine."""
        inside = os.readlink(f"/proc/{self.leader}/ns/pid")
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                numbers = re.search(r"(?m)^NSpid:(.*)$", (folder / "status").read_text())[1].split()
                if numbers[-1] == number and os.readlink(folder / "ns/pid") == inside:
                    return int(folder.name)
            except OSError:
                continue
        raise RuntimeError(f"{self.name} has no process {number}")

    def copy(self, file, to):
        shutil.copy(file, self.root / to.lstrip("/"))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.nspawn and self.nspawn.poll() is None:
            self.leader = self._child()
            if self.leader:
                self.lose_power()
            else:
                self.nspawn.kill()
                self.nspawn.wait(timeout=20)
        run("umount", "--lazy", self.root, check=False)
