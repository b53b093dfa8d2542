#!/usr/bin/env python3
"""Kills, stops, pauses and cuts off the rig's containers, some of them while a fault occurs. Checks what the
others report meanwhile and that the verdicts are right afterwards.

    deploy/compose/chaos.py        (needs the running rig without faults, and root for kill -9)
"""

import os
import signal
import time

from expectations import require, until
from rig import APART, MODULES, NETWORK, Watcher, docker, ever_faulty, nothing_is_wrong, play, run

LEAK = ("external_leakage_a", "--area-m2", "3e-7")
# Thirteen times the noise of a gage on a column: too abrupt to be an effect, so it is latched although a peer is
# silent.
BIAS = ("bias", "--offset-m", "1.2e-5")
LATCHED_BEFORE = "module2/actuator/a4"


class Stage:
    """The rig, the events that the observer receives, and the injected faults."""

    def __init__(self, table, rig, watcher):
        self.table, self.rig, self.watcher = table, rig, watcher
        self.before = len(rig.transitions())
        self.injected = []
        self.free_from = 0

    def inject(self, component, *fault):
        """Injects a fault once the previous one no longer explains changes."""
        self.rig.until_step(self.free_from)
        since = self.watcher.mark()
        step = self.rig.inject(component, *fault)
        self.injected.append(component)
        self.free_from = step + APART
        return since

    def held(self, component):
        seen = self.rig.picture()
        known = seen and seen["components"].get(component)
        return known and (known["state"], known["sequence"])

    def calm(self):
        """Everything is healthy again except for the faults."""
        self.rig.in_service()
        for service in self.rig.containers:
            self.rig.healthy(service)

    def crash(self, service):
        """kill -9 from the host, because docker does not restart containers that it has killed itself."""
        before = self.rig.restarts(service)
        os.kill(self.rig.pid(service), signal.SIGKILL)
        until(f"{service} is restarted", 30, lambda: self.rig.restarts(service) > before and self.rig.pid(service))


def unconfirmed_meanwhile(stage, component, silent, since):
    """While the peer is unreachable, no component is reported faulty: the change is unconfirmed."""
    doubt = stage.watcher.fault(component, "unconfirmed", 20, since)
    require(doubt["doubt"] == "silent" and doubt["of"] == [silent], f"{component} is unconfirmed, {doubt}, not for {silent}")
    named = [n for n in stage.watcher.events[since:] if n["news"] == "fault" and n["state"] == "latched"]
    require(not named, f"called faulty meanwhile: {[n['component'] for n in named]}")
    return f"{doubt['state']}: no answer from {silent}"


def confirmed_after(stage, component, since, start):
    """After its return, the verdict follows."""
    verdict = stage.watcher.fault(component, "latched", 30, since)
    return f"{verdict['state']} {time.monotonic() - start:.1f} s after"


def killed_diagnoser(stage):
    rig, since = stage.rig, stage.inject(LATCHED_BEFORE, *LEAK)
    stage.watcher.fault(LATCHED_BEFORE, "latched", 30, since)
    before, since, start = stage.held(LATCHED_BEFORE), stage.watcher.mark(), time.monotonic()
    stage.crash("module2")
    stage.watcher.presence("module2", False, 30, since)
    stage.watcher.presence("module2", True, 30, since)
    came, since = time.monotonic() - start, stage.watcher.mark()
    after = until("module2 reports its components", 20, lambda: stage.held(LATCHED_BEFORE))
    require(after == before, f"{LATCHED_BEFORE} was {before}, is {after}")
    stage.calm()
    stage.table.row("kill -9 module2", "restarted, same faults, in service", f"back {came:.1f} s after, {after[0]}, {rig.phase('module2')}")


def stopped_diagnoser(stage):
    rig, component = stage.rig, "module1/sensor/g3"
    before = stage.held(LATCHED_BEFORE)
    docker("stop", rig.containers["module2"])
    seen = until("module2 is missed", 20, lambda: rig.phase("module2") == "not answering" and rig.picture())
    require(seen["modules"]["module2"]["peer_of"] == ["module1"], f"module1 does not miss it: {seen['modules']['module2']}")
    stage.table.row("stop module2", "not answering, missed by module1", f"not answering, peer of {seen['modules']['module2']['peer_of'][0]}")
    since = stage.inject(component, *BIAS)
    stage.table.row(f"fault in {component} meanwhile", "unconfirmed: no answer from module2", unconfirmed_meanwhile(stage, component, "module2", since))
    start = time.monotonic()
    docker("start", rig.containers["module2"])
    verdict = confirmed_after(stage, component, since, start)
    stage.calm()
    after = stage.held(LATCHED_BEFORE)
    require(after == before, f"{LATCHED_BEFORE} was {before}, is {after}")
    stage.table.row("start module2", "the fault is named; module2 has its own still", f"{verdict}; {LATCHED_BEFORE} {after[0]}")


def paused_diagnoser(stage):
    rig, component = stage.rig, "module2/sensor/g3"
    stage.rig.until_step(stage.free_from)
    docker("pause", rig.containers["module1"])
    try:
        since = stage.inject(component, *BIAS)
        doubt = unconfirmed_meanwhile(stage, component, "module1", since)
        start = time.monotonic()
    finally:
        docker("unpause", rig.containers["module1"])
    stage.table.row(f"pause module1, fault in {component}", "unconfirmed: no answer from module1", doubt)
    verdict = confirmed_after(stage, component, since, start)
    stage.calm()
    stage.table.row("go on with module1", "the fault is named", verdict)


def paused_plant(stage):
    stage.rig.until_step(stage.free_from)
    since = stage.watcher.mark()
    docker("pause", stage.rig.containers["plant"])
    try:
        for module in MODULES:
            stage.watcher.phase(module, "stale", 20, since)
        until("both are seen stale", 20, lambda: [stage.rig.phase(module) for module in MODULES] == ["stale", "stale"])
    finally:
        docker("unpause", stage.rig.containers["plant"])
    stage.table.row("pause the plant", "both modules stale", "both modules stale")
    stage.calm()
    stage.rig.in_real_time()
    stage.table.row("go on with the plant", "both in service", "both in service")


def itself_stale(rig):
    """The status of module2, queried in its own container."""
    health = ["docker", "exec", rig.containers["module2"], "trusswatch", "health", "127.0.0.1:9464"]
    until("module2 notices", 20, lambda: run(*health, check=False).stdout.startswith("stale"))
    return "stale"


def cut_off_diagnoser(stage):
    rig, component = stage.rig, "module1/sensor/g2"
    stage.rig.until_step(stage.free_from)
    container, address = rig.containers["module2"], rig.address("module2")
    docker("network", "disconnect", NETWORK, container)
    try:
        since = stage.inject(component, *BIAS)
        doubt = unconfirmed_meanwhile(stage, component, "module2", since)
        inside = itself_stale(rig)
        start = time.monotonic()
    finally:
        docker("network", "connect", "--ip", address, NETWORK, container)
    stage.table.row(f"cut off module2, fault in {component}", "unconfirmed: no answer from module2; itself stale", f"{doubt}; itself {inside}")
    verdict = confirmed_after(stage, component, since, start)
    stage.calm()
    stage.table.row("join module2 again", "the fault is named", verdict)


def killed_plant(stage):
    since, before = stage.watcher.mark(), stage.held(LATCHED_BEFORE)
    stage.crash("plant")
    for module in MODULES:
        stage.watcher.phase(module, "in_service", 60, since)
    stage.free_from = 0
    stage.calm()
    after = stage.held(LATCHED_BEFORE)
    require(after == before, f"{LATCHED_BEFORE} was {before}, is {after}")
    stage.table.row("kill -9 the plant", "a new run, in service, same faults", f"both in service, {after[0]}")


def killed_router(stage):
    before = stage.held(LATCHED_BEFORE)
    stage.crash("router")
    stage.calm()
    after = until("module2 reports its components", 20, lambda: stage.held(LATCHED_BEFORE))
    require(after == before, f"{LATCHED_BEFORE} was {before}, is {after}")
    stage.table.row("kill -9 the router", "all reconnect to it, in service", f"both in service, {after[0]}")


def refused_observer(stage):
    """With certificates: a read-only client sends a command, and the router logs the refusal."""
    rig = stage.rig
    done = rig.trusswatch("inject", "module1/actuator/a1", "hard_over", "--structure", "tower", check=False)
    require(done.returncode == 4, f"the observer's command ended with {done.returncode}: {done.stdout}{done.stderr}")
    refusal = "access control refused Query on trusswatch/tower/plant/command/inject by observer.rig.tower"
    log = run("docker", "logs", rig.containers["router"])
    require(refusal in log.stdout + log.stderr, f"the router does not log: {refusal}")
    stage.table.row("the observer injects a fault", "no effect, logged by the router", "access control refused Query … by observer.rig.tower")


def killed_observer(stage):
    stage.crash("observer")
    lines = until("the observer reports", 20, lambda: docker("logs", "--since", "10s", stage.rig.containers["observer"]).splitlines())
    stage.table.row("kill -9 the observer", "restarted, reports again", f"{len(lines)} lines")


def nothing_else(stage):
    """Only injected faults were ever reported, and all of them are still present."""
    transitions, injected = stage.rig.transitions()[stage.before:], sorted(stage.injected)
    require(ever_faulty(transitions) == injected, f"injected {injected}, ever called faulty {ever_faulty(transitions)}")
    held = sorted(c["component"] for c in stage.rig.picture()["components"].values() if c["state"] not in ("normal", "unknown", "explained"))
    require(held == injected, f"injected {injected}, held {held}")
    stage.table.row("all together", "exactly the injected ones", f"{len(held)} of {len(injected)}, nothing else; no transition missing")


ACTS = [killed_diagnoser, stopped_diagnoser, paused_diagnoser, paused_plant, cut_off_diagnoser, killed_plant]


def story(table, rig):
    require(os.geteuid() == 0, "kill -9 of a container's process needs root")
    rig.in_service()
    nothing_is_wrong(rig)
    with Watcher(rig) as watcher:
        stage = Stage(table, rig, watcher)
        for act in ACTS:
            act(stage)
        if rig.has_router:
            killed_router(stage)
        if rig.orderer != "observer":
            refused_observer(stage)
    killed_observer(stage)
    nothing_else(stage)


if __name__ == "__main__":
    play(story)
