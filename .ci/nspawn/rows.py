"""The package under a real systemd: installed, started, killed, hung, cut off from power, upgraded, removed
and purged, on two machines, watched by a subscriber on the host. Prints what was expected and what was seen.

    python3 rows.py PACKAGE.deb TREE FORMER      (needs deploy/compose in PYTHONPATH, root, systemd-nspawn, the tree that debian.py made, what .ci/upgrade made of a former commit, and eclipse-zenoh from PyPI)
"""

import json
import os
import re
import shutil
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path

import zenoh

import held_thread
from expectations import START, Table, require, until
from machine import Bridge, Machine, run

os.chdir(Path(__file__).resolve().parent.parent.parent)
PROGRAM = "target/release/trusswatch"
HOST, FIRST, SECOND = "10.77.0.1", "10.77.0.11", "10.77.0.12"
PLANT, MODULE1, MODULE2 = f"tcp/{FIRST}:7447", f"tcp/{FIRST}:7448", f"tcp/{SECOND}:7449"
UNIT1, UNIT2 = "trusswatch-diagnoser@module1.service", "trusswatch-diagnoser@module2.service"
PLANT_UNIT = "trusswatch-plant.service"
ETC = "/etc/trusswatch"
# Steps from a fault until it explains nothing any more and has left the statistics.
APART = 5500


class Subscriber:
    """A Zenoh client on the host, of another make."""

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
        self.subscribers = [
            self.session.declare_subscriber("trusswatch/tower/*/fault/**", self._fault),
            self.session.declare_subscriber("trusswatch/tower/*/progress", self._progress),
        ]

    def _fault(self, sample):
        with self.changed:
            self.faults.append(json.loads(sample.payload.to_string()))
            self.changed.notify_all()

    def _progress(self, sample):
        module = str(sample.key_expr).split("/")[2]
        with self.changed:
            self.steps[module] = json.loads(sample.payload.to_string())["step"]
            self.changed.notify_all()

    def fault(self, component, state, seconds):
        """Waits for a transition and takes it."""
        def there():
            return next((f for f in self.faults if f["component"] == component and f["state"] == state), None)
        with self.changed:
            if not self.changed.wait_for(there, seconds):
                received = [(f["component"], f["state"]) for f in self.faults]
                raise AssertionError(f"{component} did not become {state} within {seconds} s; seen: {received}")
            return there()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.session.close()

    def forget(self):
        with self.changed:
            self.faults.clear()

    def step(self, module, step, seconds):
        """Waits until a module has come to a step."""
        with self.changed:
            if not self.changed.wait_for(lambda: self.steps.get(module, -1) >= step, seconds):
                raise AssertionError(f"{module} is at step {self.steps.get(module)}, not {step}, after {seconds} s")

    def inject(self, component, fault):
        """Gives a component of the plant a fault; from which step on."""
        order = json.dumps({"v": 1, "component": component, "fault": fault})
        for reply in self.session.get("trusswatch/tower/plant/command/inject", payload=order, timeout=5):
            require(reply.ok is not None, f"the plant refuses: {reply.err and reply.err.payload.to_string()}")
            return json.loads(reply.ok.payload.to_string())["effective_step"]
        raise AssertionError("the plant did not answer")


def operator(*endpoints):
    """What an operator on the host sees."""
    connect = [word for endpoint in endpoints for word in ("--connect", endpoint)]
    done = run(PROGRAM, "faults", "--json", "--mode", "peer", *connect, check=False)
    try:
        return json.loads(done.stdout)
    except json.JSONDecodeError:
        return None


def held(endpoint, component):
    """The state and sequence number of a component as its module reports them."""
    picture = operator(endpoint)
    found = [c for c in (picture or {}).get("components", []) if c["component"] == component]
    return (found[0]["state"], found[0]["sequence"]) if found else None


def status(machine, unit):
    return machine.show(unit, "StatusText")["StatusText"]


def is_active(machine, unit):
    return machine.show(unit, "ActiveState")["ActiveState"] == "active"


def in_service(machine, unit):
    return is_active(machine, unit) and status(machine, unit).startswith("in service") and status(machine, unit)


def without_step(text):
    return re.sub(r"(step|lag) [0-9.]+( ms)?", r"\1 …", text)


def install(machine, package):
    machine.copy(package, f"/root/{Path(package).name}")
    environment = "DEBIAN_FRONTEND=noninteractive"
    return machine.do("env", environment, "dpkg", "--force-confdef", "--force-confold", "--install",
                      f"/root/{Path(package).name}")


def installed(table, first, package):
    install(first, package)
    target = first.show("trusswatch.target", "ActiveState", "UnitFileState")
    running = first.do("systemctl", "list-units", "--no-legend", "--plain", "trusswatch-*.service").split()
    require(target == {"ActiveState": "active", "UnitFileState": "enabled"} and not running, f"{target} {running}")
    table.row("package installed", "target enabled and active, no service",
              f"target {target['UnitFileState']} and {target['ActiveState']}, {len(running)} services")


def as_shipped(table, first):
    """The shipped configuration is that of one computer with everything."""
    first.do("systemctl", "enable", UNIT1, UNIT2)
    first.do("systemctl", "start", "trusswatch.target")
    require(is_active(first, UNIT1) and is_active(first, UNIT2), "not active although started")
    text = until("a degraded status", 5, lambda: status(first, UNIT1).startswith("degraded: no sample") and status(first, UNIT1))
    table.row("target started, no plant", "active, status degraded", f"active, “{text}”")
    first.do("systemctl", "enable", "--now", PLANT_UNIT)
    for unit in UNIT1, UNIT2:
        text = until(f"{unit} in service", 20, lambda: in_service(first, unit))
    table.row("plant started", "both in service", f"“{without_step(text)}”")
    command = ["nsenter", "--target", first.leader, "--net", "--", PROGRAM, "faults", "--exit-code",
               "--connect", "tcp/127.0.0.1:7448"]
    until("no fault for the operator", 10, lambda: run(*command, check=False).returncode == 0)
    table.row("shipped configuration, operator on the loopback", "faults --exit-code: 0", "0")


def journal(table, first):
    logged = first.do("journalctl", "--unit", UNIT1, "--output=cat", "--grep=scheduling and limits").strip()
    require("policy=\"other\"" in logged and "open_files" in logged, logged)
    entry = json.loads(first.do("journalctl", "--unit", UNIT1, "--output=json", "--lines=1", "TRUSSWATCH_POLICY=other"))
    require(entry["SYSLOG_IDENTIFIER"] == "trusswatch-diagnoser" and entry["PRIORITY"] == "6", entry)
    table.row("journal", "fields of their own, and in the text", entry["MESSAGE"][:60] + "…")


def edit_network(machine, file, listen, connect):
    """What the owner of two computers has to edit."""
    text = machine.do("cat", f"{ETC}/{file}")
    table = f"[network]\nlisten = {json.dumps([listen])}\nconnect = {json.dumps(connect)}\n"
    (machine.root / f"etc/trusswatch/{file}").write_text(text[:text.index("[network]")] + table)


def former_version(package, former, work):
    """The package of a former commit: with the programs, configurations and units of that commit."""
    tree, made = work / "former", work / "trusswatch_former.deb"
    run("dpkg-deb", "--raw-extract", package, tree)
    control = tree / "DEBIAN/control"
    control.write_text(re.sub(r"(?m)^Version: .*$", "Version: 0~former-1", control.read_text()))
    for inside, outside in ("usr/bin", "bin"), ("etc/trusswatch", "configs"), ("lib/systemd/system", "deploy/systemd"):
        for file in (tree / inside).rglob("*"):
            there = former / outside / file.relative_to(tree / inside)
            if there.is_file():
                shutil.copyfile(there, file)
    run("dpkg-deb", "--root-owner-group", "-Znone", "--build", tree, made)
    return made


def on_two_computers(table, first, second, package):
    first.do("systemctl", "disable", "--now", UNIT2)
    edit_network(first, "plant.toml", PLANT, [])
    edit_network(first, "module1.toml", MODULE1, [PLANT])
    install(second, package)
    edit_network(second, "module2.toml", MODULE2, [PLANT, MODULE1])
    second.do("systemctl", "enable", "--now", UNIT2)
    first.do("systemctl", "restart", "trusswatch.target")
    for machine, unit in (first, UNIT1), (second, UNIT2):
        text = until(f"{unit} in service", 20, lambda: in_service(machine, unit))
    table.row("edited for two computers, target restarted", "both in service", f"“{without_step(text)}”")


def faults_are_seen(table, first, subscriber):
    subscriber.step("module1", 4000, 20)
    subscriber.step("module2", 4000, 20)
    step = subscriber.inject("module1/sensor/g2", {"kind": "bias", "offset_m": 1.5e-4})
    fault = subscriber.fault("module1/sensor/g2", "latched", 10)
    require(fault["durable"], "not in the journal")
    table.row("bias injected into module1/sensor/g2", "latched, seen on the host",
              f"latched, onset {fault['onset_step'] - step} steps after it")
    subscriber.step("module1", step + APART, 20)
    step = subscriber.inject("module2/actuator/a4", {"kind": "external_leakage_a", "area_m2": 3e-7})
    fault = subscriber.fault("module2/actuator/a4", "latched", 10)
    table.row("leak injected into module2/actuator/a4", "latched, seen on the host",
              f"latched, onset {fault['onset_step'] - step} steps after it")
    text = until("the status reports it", 5, lambda: "1 fault" in status(first, UNIT1) and status(first, UNIT1))
    table.row("status", "phase, step, faults, lag", f"“{text}”")
    fields = first.do("journalctl", "--unit", UNIT1, "--output=cat", "TRUSSWATCH_COMPONENT=module1/sensor/g2",
                      "TRUSSWATCH_STATE=latched").strip()
    require("component=module1/sensor/g2" in fields and "state=latched" in fields, fields)
    table.row("the verdict in the journal", "found by its field, stated in its text", fields.splitlines()[0][:60])


def comes_back(machine, unit, strike, meanwhile=lambda: None):
    """Strikes a service; after how long another process of it is active [s]."""
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
    return until(f"{unit} is active again", 15, back)


def upgrade_of_one_computer(table, first, second, package, subscriber):
    """The one with the former package, beside one with the present; their faults were found by both together."""
    before = held(MODULE2, "module2/actuator/a4")
    require(before and before[0] == "latched", f"{before}")
    install(second, package)
    text = until("module2 in service", 20, lambda: in_service(second, UNIT2))
    after = until("module2 answers", 10, lambda: held(MODULE2, "module2/actuator/a4"))
    require(after == before, f"{before} before, {after} after")
    subscriber.step("module2", subscriber.steps["module1"] + APART, 20)
    until("module1 in service", 20, lambda: in_service(first, UNIT1))
    table.row("former package of module2 upgraded", "in service, same latched faults", f"“{without_step(text)}”, {after[0]}")


def crash(table, first):
    before = held(MODULE1, "module1/sensor/g2")
    require(before and before[0] == "latched", f"{before}")
    seconds = comes_back(first, UNIT1, lambda pid: first.do("kill", "-KILL", pid))
    require(seconds < 2, f"active after {seconds:.2f} s")
    after = until("its faults are back", 5, lambda: held(MODULE1, "module1/sensor/g2"))
    require(after == before, f"{before} before, {after} after")
    until("in service again", 15, lambda: in_service(first, UNIT1))
    table.row("kill -9 of a diagnoser", "active in < 2 s, same latched faults",
              f"active in {seconds:.2f} s, {after[0]}, transition {after[1]}")


def watchdog_has_bitten(table, machine, unit, what, seconds):
    require(1.4 < seconds < 6, f"active after {seconds:.2f} s")
    said = machine.do("journalctl", "--unit", unit, "--output=cat", "--grep=Watchdog timeout", "--since=-10s").strip()
    require(said, "no watchdog timeout in the journal")
    text = until("running again", 15, lambda: is_active(machine, unit) and (s := status(machine, unit)).startswith(("in service", "running")) and s)
    table.row(what, "watchdog restarts it", f"active again in {seconds:.2f} s, “{without_step(text)[:24]}…”")


def stopped(table, machine, unit, what):
    seconds = comes_back(machine, unit, lambda pid: machine.do("kill", "-STOP", pid))
    watchdog_has_bitten(table, machine, unit, f"{what} is stopped (SIGSTOP)", seconds)


def loop_hangs(table, machine, unit, what, thread):
    """Holds the thread of that name alone: all others go on, and none may feed the watchdog in its stead."""
    pid = machine.process(machine.show(unit, "MainPID")["MainPID"])
    threads = {Path(f"{task}/comm").read_text().strip(): int(task.name) for task in Path(f"/proc/{pid}/task").iterdir()}
    try:
        held_thread.hold(threads[thread])
    except PermissionError as error:
        skip(f"hung loop of {what}: {error}")
        return
    seconds = comes_back(machine, unit, lambda _: None, lambda: held_thread.has_died(threads[thread]))
    watchdog_has_bitten(table, machine, unit, f"the loop of {what} hangs, {len(threads) - 1} other threads go on", seconds)


def loss_of_power(table, first, second, subscriber):
    until("module1 in service", 20, lambda: in_service(first, UNIT1))
    until("module2 in service", 20, lambda: in_service(second, UNIT2))
    before = held(MODULE2, "module2/actuator/a4")
    require(before and before[0] == "latched", f"{before}")
    subscriber.forget()
    second.lose_power()
    # Small: a jump is no effect of anything, and is latched without module2.
    subscriber.inject("module1/sensor/g3", {"kind": "bias", "offset_m": 1.2e-5})
    fault = subscriber.fault("module1/sensor/g3", "unconfirmed", 10)
    require(fault["silent"] == ["module2"], f"silent: {fault['silent']}")
    table.row("power loss of module2's computer, fault in module1", "unconfirmed: module2 is silent",
              f"{fault['state']}: {' '.join(fault['silent'])} is silent")
    start = time.monotonic()
    second.boot()
    fault = subscriber.fault("module1/sensor/g3", "latched", 15)
    table.row("power is back", "the fault is confirmed", f"latched {time.monotonic() - start:.1f} s after")
    text = until("module2 in service", 20, lambda: in_service(second, UNIT2))
    after = until("module2 answers", 10, lambda: held(MODULE2, "module2/actuator/a4"))
    require(after == before, f"{before} before, {after} after")
    table.row("module2 after the loss of power", "in service, same latched faults", f"“{without_step(text)}”, {after[0]}")


def broken_configuration(table, first):
    file = first.root / "etc/trusswatch/module1.toml"
    good = file.read_text()
    file.write_text(good.replace("gage_noise_strain", "gage_noise_strian"))
    first.succeeds("systemctl", "restart", UNIT1)
    state = until("failed", 10, lambda: (s := first.show(UNIT1, "ActiveState", "ExecMainStatus", "NRestarts"))["ActiveState"] == "failed" and s)
    said = first.do("journalctl", "--unit", UNIT1, "--output=cat", "--grep=strian", "--lines=1").strip()
    require(state["ExecMainStatus"] == "3" and "module1.toml" in said, f"{state} {said}")
    file.write_text(good)
    first.do("systemctl", "restart", UNIT1)
    until("in service again", 20, lambda: in_service(first, UNIT1))
    table.row("a misspelt key in the configuration", "failed, no restart, place reported", said[:60])


def credentials(table, first):
    store = first.root / "etc/credstore"
    store.mkdir(mode=0o700, exist_ok=True)
    names = ["authority", "module1.certificate", "module1.key"]
    for name in names:
        (store / f"trusswatch.{name}.pem").write_text(f"{name}\n")
        (store / f"trusswatch.{name}.pem").chmod(0o600)
    first.do("systemctl", "restart", UNIT1)
    until("in service", 20, lambda: in_service(first, UNIT1))
    folder = f"/run/credentials/{UNIT1}"
    pid = first.show(UNIT1, "MainPID")["MainPID"]
    seen = first.do("nsenter", "--target", pid, "--mount", "--", "sh", "-c", f"cd {folder} && cat authority.pem certificate.pem key.pem").split()
    require(seen == names, f"{seen}")
    table.row("certificates in /etc/credstore", "the service has them; starts without, too", f"{len(seen)} in {folder}"[:64])


def real_time(table, first):
    folder = first.root / "etc/systemd/system/trusswatch-diagnoser@.service.d"
    folder.mkdir()
    shutil.copy(first.root / "usr/share/doc/trusswatch/examples/realtime.conf", folder)
    first.do("systemctl", "daemon-reload")
    started = first.succeeds("systemctl", "restart", UNIT1)
    said = first.do("journalctl", "--unit", UNIT1, "--output=cat", "--grep=scheduling and limits", "--lines=1").strip()
    if started and 'policy="fifo"' in said:
        until("in service", 20, lambda: in_service(first, UNIT1))
        table.row("real-time drop-in", "the log states fifo, 40", said[:60])
    else:
        skip(f"real-time drop-in: this kernel gives no real-time scheduling to containers ({said[:60]})")
    shutil.rmtree(folder)
    first.do("systemctl", "daemon-reload")
    first.do("systemctl", "restart", UNIT1)
    until("in service", 20, lambda: in_service(first, UNIT1))


def skip(reason):
    require(not os.environ.get("CI"), f"with CI set, a skipped check is a failure: {reason}")
    print(f"   skipped: {reason}", flush=True)
    if "SKIPPED" in os.environ:
        with open(os.environ["SKIPPED"], "a") as skipped:
            skipped.write(f"{reason}\n")


def next_version(package, work):
    """The same package as the next version, with other conffiles."""
    tree, made = work / "next", work / "trusswatch_next.deb"
    run("dpkg-deb", "--raw-extract", package, tree)
    control = tree / "DEBIAN/control"
    control.write_text(re.sub(r"(?m)^Version: .*$", "Version: 999-1", control.read_text()))
    for name in "module1.toml", "tower.toml":
        with open(tree / "etc/trusswatch" / name, "a") as file:
            file.write("# new in this version\n")
    run("dpkg-deb", "--root-owner-group", "-Znone", "--build", tree, made)
    return made


def upgrade(table, first, package, work):
    etc = first.root / "etc/trusswatch"
    edited = (etc / "module1.toml").read_text()
    before = first.show(UNIT1, "MainPID")["MainPID"]
    faults = held(MODULE1, "module1/sensor/g2")
    install(first, next_version(package, work))
    require((etc / "module1.toml").read_text() == edited, "the edit is gone")
    require("# new" in (etc / "module1.toml.dpkg-dist").read_text(), "the new file is not offered")
    require("# new" in (etc / "tower.toml").read_text(), "an untouched file was not replaced")
    until("in service", 20, lambda: in_service(first, UNIT1))
    require(first.show(UNIT1, "MainPID")["MainPID"] != before, "not restarted")
    after = until("module1 answers", 10, lambda: held(MODULE1, "module1/sensor/g2"))
    require(after == faults and after[0] == "latched", f"{faults} before, {after} after")
    table.row("upgrade with an edited conffile", "edit kept, restarted, same faults", "edit kept, new file beside it, " + after[0])


def remove(table, first):
    first.do("dpkg", "--remove", "trusswatch")
    require(not first.succeeds("systemctl", "is-active", UNIT1), "still running")
    require(not first.succeeds("pgrep", "trusswatch"), "a process is left")
    for kept in f"{ETC}/module1.toml", "/var/lib/private/trusswatch/module1", f"/etc/systemd/system/trusswatch.target.wants/{UNIT1}":
        require(first.succeeds("test", "-e", kept) or first.succeeds("test", "-L", kept), f"{kept} is gone")
    table.row("remove", "stopped; configuration, journal, enablement kept", "no process; all three there")


def purge(table, first):
    first.do("dpkg", "--purge", "trusswatch")
    left = first.do("find", "/", "/run", "-xdev", "-name", "*trusswatch*", "-not", "-path", "/root/*").split()
    require(not left, f"left: {left}")
    dangling = first.do("find", "/etc/systemd", "-xtype", "l").split()
    require(not any("trusswatch" in link for link in dangling), f"{dangling}")
    table.row("purge", "nothing left", "nothing")


def story(table, first, second, package, former, work):
    installed(table, first, package)
    as_shipped(table, first)
    journal(table, first)
    there = former.exists()
    on_two_computers(table, first, second, former_version(package, former, work) if there else package)
    with Subscriber() as subscriber:
        faults_are_seen(table, first, subscriber)
        if there:
            upgrade_of_one_computer(table, first, second, package, subscriber)
        crash(table, first)
        stopped(table, first, UNIT1, "a diagnoser")
        loop_hangs(table, first, UNIT1, "a diagnoser", "trusswatch-diag")
        subscriber.step("module1", subscriber.steps["module1"] + APART, 20)
        loss_of_power(table, first, second, subscriber)
    broken_configuration(table, first)
    credentials(table, first)
    real_time(table, first)
    loop_hangs(table, first, PLANT_UNIT, "the plant", "plant")
    upgrade(table, first, package, work)
    remove(table, first)
    purge(table, first)


def main(package, tree, former):
    # SIGTERM leaves no machine behind.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended from outside"))
    work = Path(tempfile.mkdtemp(prefix="trusswatch-machines-", dir="/var/tmp"))
    table = Table()
    failed = None
    try:
        with Bridge(HOST), Machine("first", FIRST, tree, work) as first, Machine("second", SECOND, tree, work) as second:
            try:
                first.boot()
                second.boot()
                story(table, first, second, package, Path(former), work)
            except Exception as error:
                failed = error
                table.fail(error)
                for machine in first, second:
                    if machine.leader:
                        units = "trusswatch*"
                        print(machine.do("systemctl", "--no-pager", "--lines=0", "status", units, check=False))
                        print(machine.do("journalctl", "--no-pager", "--lines=60", "--unit", units, check=False))
    finally:
        shutil.rmtree(work, ignore_errors=True)
    table.print()
    print(f"{time.monotonic() - START:.0f} s", flush=True)
    if failed:
        raise failed


if __name__ == "__main__":
    main(*sys.argv[1:])
