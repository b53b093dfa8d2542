"""The package under a real systemd on separate machines: two of an operator, with crashes, hangs, power losses, an
upgrade, removal and purge; and three bare ones on which a new user follows deploy/secure.md.
"""

import contextlib
import json
import os
import re
import shutil
import signal
import socket
import ssl
import subprocess
import tempfile
import threading
import time
import urllib.request
import warnings
from pathlib import Path

import debian
import package
import pytest
import walkthrough
import zenoh
from conftest import LIMIT_S, PROGRAMS, ROOT, cannot, needs, trusswatch, until
from held_thread import has_died, hold
from machine import Bridge, Machine, run
from playwright.sync_api import expect, sync_playwright

pytestmark = pytest.mark.timeout(package.LIMIT_S)


@pytest.fixture
def boot(own_network, request):
    """Boots machines, by name and address, joined with this computer by a bridge. Each has the package in /root."""
    if os.geteuid() != 0:
        cannot("machines", "needs root")
    needs("systemd-nspawn", "debootstrap", "ip", "dpkg-deb", "chromium")
    probe = ["unshare", "--mount", "--net", "--pid", "--uts", "--ipc", "--fork", "mount", "-t", "tmpfs", "none", tempfile.gettempdir()]
    if subprocess.run(probe, capture_output=True).returncode != 0:
        cannot("machines", "no namespaces or mounts here")
    # If the story is terminated, no machine keeps running.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    machines = {}
    with contextlib.ExitStack() as ends:
        work = Path(tempfile.mkdtemp(prefix="trusswatch-machines-", dir="/var/tmp"))
        ends.callback(shutil.rmtree, work, ignore_errors=True)

        def boot(host, **addresses):
            ends.enter_context(Bridge(host))
            for name, address in addresses.items():
                machines[name] = ends.enter_context(Machine(name, address, debian.tree(), work))
                machines[name].boot()
                machines[name].copy(package.built(), f"/root/{package.built().name}")
            return machines.values()
        yield boot
        if getattr(request.node, "failed", False):
            for machine in (machine for machine in machines.values() if machine.leader):
                print(f"-- {machine.name}")
                print(machine.do("systemctl", "--no-pager", "--lines=0", "status", "trusswatch*", check=False))
                print(machine.do("journalctl", "--no-pager", "--lines=60", "--unit=trusswatch*", check=False))


# An operator's two computers.

HOST, FIRST, SECOND = "10.77.0.1", "10.77.0.11", "10.77.0.12"
PLANT, MODULE1, MODULE2 = f"tcp/{FIRST}:7447", f"tcp/{FIRST}:7448", f"tcp/{SECOND}:7449"
UNIT1, UNIT2 = "trusswatch-diagnoser@module1.service", "trusswatch-diagnoser@module2.service"
PLANT_UNIT = "trusswatch-plant.service"
ETC = "etc/trusswatch"
G2, G3, A4 = "module1/sensor/g2", "module1/sensor/g3", "module2/actuator/a4"
G5 = "module2/sensor/g5"
# Steps until a fault no longer explains changes and has left the statistics.
APART = 5500


class Subscriber:
    """A Zenoh client on the host, in another language."""

    def __init__(self):
        self.changed = threading.Condition()
        self.faults, self.steps = [], {}
        settings = {
            "mode": "peer",
            "connect": {"endpoints": [PLANT, MODULE1, MODULE2], "timeout_ms": -1, "exit_on_failure": False,
                        "retry": {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5}},
            "listen": {"endpoints": []},
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
            "transport": {"link": {"tx": {"lease": 1000}}},
        }
        self.session = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))
        self.session.declare_subscriber("trusswatch/tower/*/fault/**", self._fault)
        self.session.declare_subscriber("trusswatch/tower/*/progress", self._progress)

    def _fault(self, sample):
        with self.changed:
            self.faults.append(json.loads(sample.payload.to_string()))
            self.changed.notify_all()

    def _progress(self, sample):
        with self.changed:
            self.steps[str(sample.key_expr).split("/")[2]] = json.loads(sample.payload.to_string())["step"]
            self.changed.notify_all()

    def fault(self, component, state):
        """Waits for a transition."""
        def there():
            return next((f for f in self.faults if (f["component"], f["state"]) == (component, state)), None)
        with self.changed:
            assert self.changed.wait_for(there, LIMIT_S), f"{component} is not {state}: {self.faults}"
            return there()

    def forget(self):
        with self.changed:
            self.faults.clear()

    def step(self, module, step):
        """Waits until a module has reached a step."""
        with self.changed:
            assert self.changed.wait_for(lambda: self.steps.get(module, -1) >= step, LIMIT_S), f"{module}: {self.steps}"

    def inject(self, component, **fault):
        """Injects a fault into the plant; returns its first step."""
        order = json.dumps({"v": 1, "component": component, "fault": fault})
        reply = next(iter(self.session.get("trusswatch/tower/plant/command/inject", payload=order, timeout=LIMIT_S)))
        assert reply.ok is not None, reply.err and reply.err.payload.to_string()
        return json.loads(reply.ok.payload.to_string())["effective_step"]


def held(endpoint, component):
    """State and sequence number of a component, as its module reports them to an operator on the host."""
    done = trusswatch("faults", "--json", "--mode", "peer", "--connect", endpoint, check=False)
    components = json.loads(done.stdout)["components"] if done.stdout.startswith("{") else []
    return next(((c["state"], c["sequence"]) for c in components if c["component"] == component), None)


def still_held(endpoint, component, before):
    assert before and before[0] == "latched"
    after = until(f"{component} is reported again", lambda: held(endpoint, component))
    assert after == before


def status(machine, unit):
    return machine.show(unit, "StatusText")["StatusText"]


def is_active(machine, unit):
    return machine.show(unit, "ActiveState")["ActiveState"] == "active"


def in_service(machine, unit):
    until(f"{unit} in service", lambda: is_active(machine, unit) and status(machine, unit).startswith("in service"))


def logged(machine, unit, words, *options):
    """The lines of a unit's journal that contain these words."""
    done = machine.try_to("journalctl", "--quiet", "--unit", unit, "--output=cat", f"--grep={words}", *options)
    return done.stdout.strip() if done.returncode == 0 else ""


def install(machine, deb):
    machine.copy(deb, f"/root/{deb.name}")
    machine.do("env", "DEBIAN_FRONTEND=noninteractive", "dpkg", "--force-confdef", "--force-confold", "--install", f"/root/{deb.name}")


def installed(first):
    """The target is enabled and active, and no service runs."""
    install(first, package.built())
    assert first.show("trusswatch.target", "ActiveState", "UnitFileState") == {"ActiveState": "active", "UnitFileState": "enabled"}
    assert not first.do("systemctl", "list-units", "--no-legend", "--plain", "trusswatch-*.service").split()


def as_shipped(first):
    """The shipped configuration runs everything on one computer."""
    first.do("systemctl", "enable", UNIT1, UNIT2)
    first.do("systemctl", "start", "trusswatch.target")
    assert is_active(first, UNIT1) and is_active(first, UNIT2)
    until("a degraded status", lambda: status(first, UNIT1).startswith("degraded: no sample"))
    first.do("systemctl", "enable", "--now", PLANT_UNIT)
    in_service(first, UNIT1)
    in_service(first, UNIT2)
    command = ["nsenter", "--target", first.leader, "--net", "--", PROGRAMS / "trusswatch", "faults", "--exit-code",
               "--connect", "tcp/127.0.0.1:7448"]
    until("no fault for the operator", lambda: run(*command, check=False).returncode == 0)


def journal(first):
    """Journal entries have the structured fields, and their values are in the text."""
    line = logged(first, UNIT1, "scheduling and limits")
    assert 'policy="other"' in line and "open_files" in line
    entry = json.loads(first.do("journalctl", "--unit", UNIT1, "--output=json", "--lines=1", "TRUSSWATCH_POLICY=other"))
    assert entry["SYSLOG_IDENTIFIER"] == "trusswatch-diagnoser" and entry["PRIORITY"] == "6"


def edit_network(machine, file, listen, connect):
    """The edits for two computers."""
    file = machine.root / ETC / file
    text = file.read_text()
    file.write_text(f"{text[:text.index('[network]')]}[network]\nlisten = {json.dumps([listen])}\nconnect = {json.dumps(connect)}\n")


def on_two_computers(first, second):
    first.do("systemctl", "disable", "--now", UNIT2)
    edit_network(first, "plant.toml", PLANT, [])
    edit_network(first, "module1.toml", MODULE1, [PLANT])
    install(second, package.built())
    edit_network(second, "module2.toml", MODULE2, [PLANT, MODULE1])
    second.do("systemctl", "enable", "--now", UNIT2)
    first.do("systemctl", "restart", "trusswatch.target")
    in_service(first, UNIT1)
    in_service(second, UNIT2)


def faults_are_seen(first, subscriber):
    """On the host, in the status and in the journal."""
    subscriber.step("module1", 4000)
    subscriber.step("module2", 4000)
    step = subscriber.inject(G2, kind="bias", offset_m=1.5e-4)
    assert subscriber.fault(G2, "latched")["durable"]
    subscriber.step("module1", step + APART)
    subscriber.inject(A4, kind="external_leakage_a", area_m2=3e-7)
    subscriber.fault(A4, "latched")
    until("the status reports it", lambda: "1 fault" in status(first, UNIT1))
    entry = first.do("journalctl", "--unit", UNIT1, "--output=cat", f"TRUSSWATCH_COMPONENT={G2}", "TRUSSWATCH_STATE=latched")
    assert f"component={G2}" in entry and "state=latched" in entry


def comes_back(machine, unit, strike, meanwhile=lambda: None):
    """Calls `strike` with the process id of a service; returns the time until another process of it is active [s]."""
    before = machine.show(unit, "MainPID", "NRestarts")
    # The clock of systemd's own timestamps.
    start = time.clock_gettime(time.CLOCK_MONOTONIC)
    strike(before["MainPID"])

    def back():
        meanwhile()
        now = machine.show(unit, "MainPID", "NRestarts", "ActiveState", "ActiveEnterTimestampMonotonic")
        entered = int(now["ActiveEnterTimestampMonotonic"]) / 1e6
        new = now["MainPID"] not in ("0", before["MainPID"]) and int(now["NRestarts"]) > int(before["NRestarts"])
        return now["ActiveState"] == "active" and new and entered > start and entered - start
    return until(f"{unit} is active again", back)


def crash(first):
    """After kill -9 a diagnoser is soon active again, with the same faults. Alone on its computer it takes less than a second;
    beside the compilers of the check, two seconds may pass between systemd's start and the program's first line."""
    before = held(MODULE1, G2)
    assert comes_back(first, UNIT1, lambda pid: first.do("kill", "-KILL", pid)) < 6
    still_held(MODULE1, G2, before)
    in_service(first, UNIT1)


def restarted_by_watchdog(machine, unit, seconds):
    assert 1.4 < seconds < 6
    assert logged(machine, unit, "Watchdog timeout", "--since=-10s")
    until("running again", lambda: is_active(machine, unit) and status(machine, unit).startswith(("in service", "running")))


def stopped(machine, unit):
    restarted_by_watchdog(machine, unit, comes_back(machine, unit, lambda pid: machine.do("kill", "-STOP", pid)))


def loop_hangs(machine, unit, name):
    """Holds only the thread of that name: no other thread may send the watchdog heartbeat."""
    pid = machine.process(machine.show(unit, "MainPID")["MainPID"])
    thread = next(int(task.name) for task in Path(f"/proc/{pid}/task").iterdir() if (task / "comm").read_text().strip() == name)
    try:
        hold(thread)
    except PermissionError as error:
        not_tried(f"hung loop of {unit}: {error}")
        return
    restarted_by_watchdog(machine, unit, comes_back(machine, unit, lambda _: None, lambda: has_died(thread)))


def not_tried(what):
    if os.environ.get("CI"):
        pytest.fail(f"{what}; with CI set, what cannot be tried has failed")
    warnings.warn(f"not tried: {what}", stacklevel=2)


def loss_of_power(first, second, subscriber):
    """A fault while the peer's computer is off is unconfirmed and becomes latched after its return; the peer keeps its own faults."""
    in_service(first, UNIT1)
    in_service(second, UNIT2)
    before = held(MODULE2, A4)
    subscriber.forget()
    second.lose_power()
    # Small, because a jump cannot be an effect and would be latched without module2.
    subscriber.inject(G3, kind="bias", offset_m=1.2e-5)
    assert subscriber.fault(G3, "unconfirmed")["of"] == ["module2"]
    second.boot()
    subscriber.fault(G3, "latched")
    in_service(second, UNIT2)
    still_held(MODULE2, A4, before)


def broken_configuration(first):
    """A misspelled key: the unit fails without a restart, and the log names the place."""
    file = first.root / ETC / "module1.toml"
    good = file.read_text()
    file.write_text(good.replace("gage_noise_strain", "gage_noise_strian"))
    first.succeeds("systemctl", "restart", UNIT1)
    until("it has failed", lambda: first.show(UNIT1, "ActiveState")["ActiveState"] == "failed")
    assert first.show(UNIT1, "ExecMainStatus", "NRestarts") == {"ExecMainStatus": "3", "NRestarts": "0"}
    assert "module1.toml" in logged(first, UNIT1, "strian", "--lines=1")
    file.write_text(good)
    first.do("systemctl", "restart", UNIT1)
    in_service(first, UNIT1)


def credentials(first):
    """The service has the certificates in /etc/credstore."""
    store = first.root / "etc/credstore"
    store.mkdir(mode=0o700, exist_ok=True)
    names = ["authority", "module1.certificate", "module1.key"]
    for name in names:
        (store / f"trusswatch.{name}.pem").write_text(f"{name}\n")
        (store / f"trusswatch.{name}.pem").chmod(0o600)
    first.do("systemctl", "restart", UNIT1)
    in_service(first, UNIT1)
    pid = first.show(UNIT1, "MainPID")["MainPID"]
    look = f"cd /run/credentials/{UNIT1} && cat authority.pem certificate.pem key.pem"
    assert first.do("nsenter", "--target", pid, "--mount", "--", "sh", "-c", look).split() == names


def real_time(first):
    """With the drop-in the log states the scheduling."""
    folder = first.root / "etc/systemd/system/trusswatch-diagnoser@.service.d"
    folder.mkdir()
    shutil.copy(first.root / "usr/share/doc/trusswatch/examples/realtime.conf", folder)
    first.do("systemctl", "daemon-reload")
    started = first.succeeds("systemctl", "restart", UNIT1)
    line = logged(first, UNIT1, "scheduling and limits", "--lines=1")
    if started and 'policy="fifo"' in line:
        in_service(first, UNIT1)
    else:
        not_tried(f"real-time drop-in: this kernel gives no real-time scheduling to containers ({line})")
    shutil.rmtree(folder)
    first.do("systemctl", "daemon-reload")
    first.do("systemctl", "restart", UNIT1)
    in_service(first, UNIT1)


def next_version(work):
    """The same package as the next version, with other conffiles."""
    tree, made = work / "next", work / "trusswatch_next.deb"
    run("dpkg-deb", "--raw-extract", package.built(), tree)
    control = tree / "DEBIAN/control"
    control.write_text(re.sub(r"(?m)^Version: .*$", "Version: 999-1", control.read_text()))
    for name in "module1.toml", "tower.toml":
        with open(tree / ETC / name, "a") as file:
            file.write("# new in this version\n")
    run("dpkg-deb", "--root-owner-group", "-Znone", "--build", tree, made)
    return made


def upgrade(first, work):
    """An edited file is kept, the new one is put beside it; the service is restarted with the same faults."""
    etc = first.root / ETC
    edited, faults, before = (etc / "module1.toml").read_text(), held(MODULE1, G2), first.show(UNIT1, "MainPID")
    install(first, next_version(work))
    assert (etc / "module1.toml").read_text() == edited
    assert "# new" in (etc / "module1.toml.dpkg-dist").read_text()
    assert "# new" in (etc / "tower.toml").read_text()
    in_service(first, UNIT1)
    assert first.show(UNIT1, "MainPID") != before
    still_held(MODULE1, G2, faults)


def remove(first):
    """Everything is stopped; configuration, journal and enabled units are kept."""
    first.do("dpkg", "--remove", "trusswatch")
    assert not first.succeeds("systemctl", "is-active", UNIT1)
    assert not first.succeeds("pgrep", "trusswatch")
    for kept in f"/{ETC}/module1.toml", "/var/lib/private/trusswatch/module1", f"/etc/systemd/system/trusswatch.target.wants/{UNIT1}":
        assert first.succeeds("test", "-e", kept) or first.succeeds("test", "-L", kept), kept


def purge(first):
    """Nothing is left."""
    first.do("dpkg", "--purge", "trusswatch")
    assert not first.do("find", "/", "/run", "-xdev", "-name", "*trusswatch*", "-not", "-path", "/root/*").split()
    assert "trusswatch" not in first.do("find", "/etc/systemd", "-xtype", "l")


def test_package_on_two_computers(boot, tmp_path):
    first, second = boot(HOST, first=FIRST, second=SECOND)
    installed(first)
    as_shipped(first)
    journal(first)
    on_two_computers(first, second)
    subscriber = Subscriber()
    with subscriber.session:
        faults_are_seen(first, subscriber)
        crash(first)
        stopped(first, UNIT1)
        loop_hangs(first, UNIT1, "trusswatch-diag")
        subscriber.step("module1", subscriber.steps["module1"] + APART)
        loss_of_power(first, second, subscriber)
    broken_configuration(first)
    credentials(first)
    real_time(first)
    loop_hangs(first, PLANT_UNIT, "plant")
    upgrade(first, tmp_path)
    remove(first)
    purge(first)


# A new user's three computers.

DOCUMENT = "deploy/secure.md"
ADDRESSES = {"ground": "192.0.2.10", "module1": "192.0.2.11", "module2": "192.0.2.12"}
PORT, PAGE_PORT = 7447, 8480
UNITS = {
    "ground": ["trusswatch-router", "trusswatch-plant", "trusswatch-web"],
    "module1": ["trusswatch-diagnoser@module1"],
    "module2": ["trusswatch-diagnoser@module2"],
}
LOOK = f"trusswatch faults --json --tls pki/operator.ada --connect tls/{ADDRESSES['ground']}:{PORT}"
# The units that the document kills, and how often.
RESTARTS = {"trusswatch-diagnoser@module1": 1}
# TLS links without the fix broke within two seconds; a step is a millisecond.
UNBROKEN_STEPS = 15_000


def follow_the_document(machines):
    """Runs every step; copies a module's certificates to its computer before the first command there."""
    steps = walkthrough.steps((ROOT / DOCUMENT).read_text())
    assert len(steps) > 10
    reached = {walkthrough.EVERYWHERE, "ground"}
    for step in steps:
        if step.computer not in reached:
            reached.add(step.computer)
            shutil.copytree(machines["ground"].root / "root/pki" / step.computer, machines[step.computer].root / "root" / step.computer)
        walkthrough.follow(step, machines)


def modules(ground):
    """The output of `trusswatch faults` for the new user, once all modules are in service."""
    code, printed = walkthrough.type_in(ground, LOOK)
    shown = json.loads(printed) if code == 0 else None
    return shown and all(module["phase"] == "in_service" for module in shown["modules"]) and shown


def only_those_faults(ground):
    """The only faulty or suspect components are those that the document injected, and that were acknowledged."""
    shown = modules(ground)
    suspects = ("tentative", "latched", "acknowledged", "unconfirmed")
    return shown and {c["component"]: c["state"] for c in shown["components"] if c["state"] in suspects} == {G2: "acknowledged", G5: "acknowledged"}


def services(machines):
    for name, unit in ((name, unit) for name, units in UNITS.items() for unit in units):
        state = machines[name].show(f"{unit}.service", "ActiveState", "UnitFileState", "DynamicUser")
        assert state == {"ActiveState": "active", "UnitFileState": "enabled", "DynamicUser": "yes"}, unit


def keys_are_private(machines):
    for name, machine in machines.items():
        modes = {oct(file.stat().st_mode & 0o777) for file in (machine.root / "etc/credstore").iterdir()}
        assert modes == {"0o600"}, name
        assert name == "ground" or not (machine.root / "root" / name).exists(), f"{name} keeps a key at home"


def only_the_router_and_the_page_listen(machines):
    for name, machine in machines.items():
        lines = machine.do("ss", "--no-header", "--listening", "--tcp", "--numeric").splitlines()
        expected = [f"{ADDRESSES['ground']}:{port}" for port in (PORT, PAGE_PORT)] if name == "ground" else []
        assert sorted(line.split()[3] for line in lines) == expected, name


def ada_acknowledges_on_her_phone(ground):
    """From another computer, over TLS with the authority's certificate."""
    address = f"https://{ADDRESSES['ground']}:{PAGE_PORT}"
    link = ground.do("trusswatch", "web", "link", "Ada Lovelace", "--address", address).strip()
    trusted = ssl.create_default_context(cafile=str(ground.root / "root/pki/operator.web/authority.pem"))
    with urllib.request.urlopen(f"{address}/healthz", context=trusted, timeout=LIMIT_S) as answer:
        assert answer.status == 200
    expect.set_options(timeout=1000 * LIMIT_S)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        # The certificate was checked above; this browser has no place to import an authority to.
        phone = browser.new_context(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True, ignore_https_errors=True)
        page = phone.new_page()
        page.goto(link)
        page.get_by_label("Keep this device signed in").check()
        page.get_by_role("button", name="Sign in").tap()
        row = page.locator("#alarms li").filter(has_text=G5).first
        row.get_by_role("button", name="Acknowledge").tap()
        expect(page.locator(".message")).to_contain_text("acknowledged")
        browser.close()


def handshake(ground, holder):
    """Connects over TLS as this holder, or without a certificate: returns the protocol and the router's name."""
    library = ground.root / "root/pki"
    context = ssl.create_default_context(cafile=str(library / "module1/authority.pem"))
    if holder:
        context.load_cert_chain(library / holder / "certificate.pem", library / holder / "key.pem")
    with socket.create_connection((ADDRESSES["ground"], PORT), timeout=10) as plain:
        with context.wrap_socket(plain, server_hostname=ADDRESSES["ground"]) as link:
            subject = dict(pair for part in link.getpeercert()["subject"] for pair in part)
            # With TLS 1.3 a refused client learns so only when reading, as an error; an accepted one receives nothing
            # and is disconnected after a while for sending nothing.
            link.settimeout(5)
            with contextlib.suppress(TimeoutError):
                assert link.recv(1) == b""
            return link.version(), subject["commonName"]


def links_are_secured(machines):
    assert handshake(machines["ground"], "operator.ada") == ("TLSv1.3", "router.ground.tower")
    with pytest.raises(ssl.SSLError):
        handshake(machines["ground"], None)
    until("the router logs it", lambda: logged(machines["ground"], "trusswatch-router", "peer sent no certificates"))


def no_link_breaks(machines):
    """A broken link is re-established; only the journal shows that it broke."""
    def step():
        shown = modules(machines["ground"])
        return shown and min(module["step"] or 0 for module in shown["modules"])
    since = {name: machine.do("date", "+%Y-%m-%d %H:%M:%S").strip() for name, machine in machines.items()}
    start = until("a step", step)
    until("more steps", lambda: (step() or 0) >= start + UNBROKEN_STEPS)
    for name, unit in ((name, unit) for name, units in UNITS.items() for unit in units):
        assert name == "ground" or "disappeared" not in logged(machines[name], unit, "disappeared", f"--since={since[name]}")
        assert machines[name].show(f"{unit}.service", "NRestarts") == {"NRestarts": str(RESTARTS.get(unit, 0))}, unit


def all_lose_power(machines):
    """Without a command, the fault persists."""
    for machine in machines.values():
        machine.lose_power()
    for machine in machines.values():
        machine.boot()
    until("everything is back", lambda: only_those_faults(machines["ground"]))


def test_new_user_secures_a_system_as_documented(boot):
    machines = dict(zip(ADDRESSES, boot("192.0.2.1", **ADDRESSES)))
    follow_the_document(machines)
    services(machines)
    keys_are_private(machines)
    only_the_router_and_the_page_listen(machines)
    ada_acknowledges_on_her_phone(machines["ground"])
    links_are_secured(machines)
    assert only_those_faults(machines["ground"])
    no_link_breaks(machines)
    all_lose_power(machines)
