"""A new user types what deploy/secure.md says, on three bare machines with nothing but the package put beside,
and gets a supervised system secured by TLS. Prints the transcript, then what was looked at besides.

    python3 newcomer.py PACKAGE.deb TREE      (needs deploy/compose in PYTHONPATH, root, systemd-nspawn and the tree that debian.py made)
"""

import json
import os
import shutil
import signal
import socket
import ssl
import sys
import tempfile
import time
from pathlib import Path

import walkthrough
from expectations import START, require, seen, until
from machine import Bridge, Machine

os.chdir(Path(__file__).resolve().parent.parent.parent)
DOCUMENT = "deploy/secure.md"
HOST = "192.0.2.1"
ADDRESSES = {"ground": "192.0.2.10", "module1": "192.0.2.11", "module2": "192.0.2.12"}
PORT = 7447
UNITS = {
    "ground": ["trusswatch-router", "trusswatch-plant"],
    "module1": ["trusswatch-diagnoser@module1"],
    "module2": ["trusswatch-diagnoser@module2"],
}
LOOK = f"trusswatch faults --json --tls pki/operator.ada --connect tls/{ADDRESSES['ground']}:{PORT}"
FAULT = "module1/sensor/g2"
# What the document has killed, and how often.
RESTARTS = {"trusswatch-diagnoser@module1": 1}
# Links of TLS whose two directions were not kept apart broke within two seconds.
UNBROKEN_S = 15


def carry(machines, what, to):
    """What the document has the user carry from the ground to a module's computer."""
    place = machines[to].root / "root" / Path(what).name
    shutil.copytree(machines["ground"].root / "root" / what, place)
    print(f"-- {what} is carried from ground to {to}", flush=True)


def follow_the_document(machines):
    """Types every step; the modules' directories are carried before the first thing that is typed there."""
    steps = walkthrough.steps(Path(DOCUMENT).read_text())
    require(len(steps) > 10, f"{DOCUMENT} has {len(steps)} steps")
    at_home = {walkthrough.EVERYWHERE, "ground"}
    for step in steps:
        if step.computer not in at_home:
            at_home.add(step.computer)
            carry(machines, f"pki/{step.computer}", step.computer)
        walkthrough.follow(step, machines)


def picture(ground):
    code, printed = walkthrough.type_in(ground, LOOK)
    return json.loads(printed) if code == 0 else None


def faulty(ground):
    """The components that are faulty or possibly so, with their states; `None` while not all modules are in
    service."""
    shown = picture(ground)
    if not shown or any(module["phase"] != "in_service" for module in shown["modules"]):
        return None
    suspects = [c for c in shown["components"] if c["state"] in ("tentative", "latched", "acknowledged", "unconfirmed")]
    return {component["component"]: component["state"] for component in suspects}


def services(machines):
    for name, units in UNITS.items():
        for unit in units:
            unit_state = machines[name].show(f"{unit}.service", "ActiveState", "UnitFileState", "User", "DynamicUser")
            require(unit_state["ActiveState"] == "active" and unit_state["UnitFileState"] == "enabled", f"{unit}: {unit_state}")
            require(unit_state["DynamicUser"] == "yes", f"{unit}: {unit_state}")
    seen("every unit is active, enabled, and a user of its own")


def files(machines):
    for name, machine in machines.items():
        kept = sorted((machine.root / "etc/credstore").iterdir())
        modes = {file.name: oct(file.stat().st_mode & 0o777) for file in kept}
        require(kept and set(modes.values()) == {"0o600"}, f"{name}: {modes}")
        require(name == "ground" or not (machine.root / "root" / name).exists(), f"{name} keeps a key at home")
    seen("keys can be read by root alone")


def ports(machines):
    for name, machine in machines.items():
        listening = machine.do("ss", "--no-header", "--listening", "--tcp", "--numeric").split("\n")
        places = [line.split()[3] for line in listening if line]
        expected = [f"{ADDRESSES['ground']}:{PORT}"] if name == "ground" else []
        require(places == expected, f"{name} listens at {places}")
    seen("only the router listens")


def handshake(ground, holder):
    """What TLS makes of us as this holder, or without a certificate: the protocol and the router's name."""
    library = ground.root / "root/pki"
    context = ssl.create_default_context(cafile=str(library / "module1/authority.pem"))
    if holder:
        context.load_cert_chain(library / holder / "certificate.pem", library / holder / "key.pem")
    with socket.create_connection((ADDRESSES["ground"], PORT), timeout=10) as plain:
        with context.wrap_socket(plain, server_hostname=ADDRESSES["ground"]) as link:
            subject = dict(pair for part in link.getpeercert()["subject"] for pair in part)
            version = link.version()
            # With TLS 1.3 a refused client learns so only when reading, as an error; an accepted one receives
            # nothing and is disconnected after a while for sending nothing.
            link.settimeout(5)
            try:
                heard = link.recv(1)
            except TimeoutError:
                heard = b""
            require(heard == b"", f"the router said {heard!r} unasked")
            return version, subject["commonName"]


def heard(machine, unit, words):
    """Whether a unit's journal has these words."""
    return machine.succeeds("journalctl", f"--unit={unit}", f"--grep={words}")


def links(machines):
    version, name = handshake(machines["ground"], "operator.ada")
    require(version == "TLSv1.3" and name == "router.ground.tower", f"{version} {name}")
    try:
        handshake(machines["ground"], None)
    except ssl.SSLError as error:
        until("the router logs it", 10, lambda: heard(machines["ground"], "trusswatch-router", "peer sent no certificates"))
        seen(f"{version} with {name}; without a certificate: {error.reason}, and the router logs it")
    else:
        raise AssertionError("the router accepts an unknown client")


def exactly_that_fault(machines):
    states = faulty(machines["ground"])
    require(states == {FAULT: "acknowledged"}, f"{states}")
    seen(f"faulty is {FAULT} and nothing else")


def no_link_breaks(machines):
    """A link that breaks is set up again and leaves no other trace."""
    diagnosers = {name: units[0] for name, units in UNITS.items() if name != "ground"}
    since = {name: machines[name].do("date", "+%Y-%m-%d %H:%M:%S").strip() for name in diagnosers}
    time.sleep(UNBROKEN_S)
    for name, unit in diagnosers.items():
        lost = machines[name].do("journalctl", f"--unit={unit}", f"--since={since[name]}", "--output=cat", "--grep=has gone", check=False)
        require("has gone" not in lost, f"{unit} lost its peer:\n{lost}")
    for name, units in UNITS.items():
        for unit in units:
            restarts = int(machines[name].show(f"{unit}.service", "NRestarts")["NRestarts"])
            require(restarts == RESTARTS.get(unit, 0), f"{unit} was restarted {restarts} times")
    seen(f"in {UNBROKEN_S} s no link broke; nothing was restarted but what was killed")


def all_lose_power(machines):
    """Without any command, the fault is still there."""
    for machine in machines.values():
        machine.lose_power()
    start = time.monotonic()
    for machine in machines.values():
        machine.boot()
    until("everything is back", 60, lambda: faulty(machines["ground"]) == {FAULT: "acknowledged"})
    seen(f"all three lost power; {time.monotonic() - start:.1f} s later all are in service and know the fault")


def story(machines, package):
    for machine in machines.values():
        machine.boot()
        machine.copy(package, f"/root/{Path(package).name}")
    follow_the_document(machines)
    for look in services, files, ports, links, exactly_that_fault, no_link_breaks, all_lose_power:
        look(machines)


def explain(machines):
    for machine in machines.values():
        if machine.leader:
            for command in ("systemctl", "status", "--lines=0"), ("journalctl", "--lines=60"):
                option = "--unit=trusswatch*" if command[0] == "journalctl" else "trusswatch*"
                print(f"-- {machine.name}", machine.do(*command, "--no-pager", option, check=False), sep="\n")


def main(package, tree):
    # SIGTERM leaves no machine behind.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended from outside"))
    work = Path(tempfile.mkdtemp(prefix="trusswatch-newcomer-", dir="/var/tmp"))
    try:
        with Bridge(HOST):
            machines = {}
            try:
                for name, address in ADDRESSES.items():
                    machines[name] = Machine(name, address, tree, work)
                story(machines, package)
            except Exception:
                explain(machines)
                raise
            finally:
                for machine in machines.values():
                    machine.__exit__()
    finally:
        shutil.rmtree(work, ignore_errors=True)
    print(f"{time.monotonic() - START:.0f} s", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
