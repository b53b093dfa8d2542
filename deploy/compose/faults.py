#!/usr/bin/env python3
"""Injects six faults into the rig's plant, one after the other, and checks that exactly these are isolated. It then
resets them, which restores the rig.

    deploy/compose/faults.py        (needs the running rig)
"""

from expectations import require, until
from rig import APART, MODULES, REPAIRED_AFTER, Watcher, ever_faulty, nothing_is_wrong, play

FAULTS = [
    ("module1/sensor/g2", "bias", "--offset-m", "1.5e-4"),
    ("module1/sensor/g7", "random_walk", "--drift-m-per-s", "2e-4", "--increment-m", "2e-5"),
    ("module1/actuator/a3", "internal_leakage", "--area-m2", "3e-7"),
    ("module2/actuator/a4", "external_leakage_a", "--area-m2", "3e-7"),
    ("module1/actuator/a1", "hard_over"),
    ("module2/sensor/g1", "bias", "--offset-m", "-6e-4"),
]

CONFINED = {
    "Uid": "65532",
    "Gid": "65532",
    "CapEff": "0" * 16,
    "CapBnd": "0" * 16,
    "NoNewPrivs": "1",
    "Seccomp": "2",
    "ReadonlyRootfs": "true",
}


def order(rig):
    """Schedules every fault and every repair in the plant; returns the steps."""
    first = rig.step() + 4000
    steps = {}
    for number, (component, *fault) in enumerate(FAULTS):
        steps[component] = first + number * APART
        rig.inject(component, *fault, at_step=steps[component])
        rig.inject(component, "--repair", at_step=steps[component] + REPAIRED_AFTER)
    return steps


def named(table, rig, watcher):
    before = len(rig.transitions())
    since = watcher.mark()
    steps = order(rig)
    for component, kind, *_ in FAULTS:
        fault = watcher.fault(component, "latched", 120, since)
        late = fault["detection_step"] - steps[component]
        require(0 <= late <= 500, f"{component} changed {late} steps after its fault")
        table.row(f"{kind} of {component}", "named", f"latched, found {late} ms after, decided {fault['decided_step'] - steps[component]} ms after")
    rig.until_step(max(steps.values()) + APART)
    return rig.transitions()[before:]


def story(table, rig):
    rig.in_service()
    for service in rig.containers:
        rig.healthy(service)
    health = ", ".join(f"{service} {rig.health(service)}" for service in rig.containers if rig.health(service))
    table.row("rig", "every module is in service", health)
    for service in rig.containers:
        require(rig.confinement(service) == CONFINED, f"{service} may do more than it should: {rig.confinement(service)}")
    table.row("rights", "no root, no capability, nothing writable", f"so it is with {len(rig.containers)} containers")
    nothing_is_wrong(rig)
    injected = sorted(component for component, *_ in FAULTS)
    with Watcher(rig) as watcher:
        transitions = named(table, rig, watcher)
        gone = [event["who"] for event in watcher.events if event["news"] == "presence" and not event["there"]]
        # A busy computer may be late once; unstable links break dozens of times.
        require(len(gone) <= 2, f"went away without a disturbance: {gone}")
    present = rig.picture()["components"].values()
    held = sorted(c["component"] for c in present if c["state"] not in ("normal", "unknown", "explained"))
    require(held == injected, f"injected {injected}, held {held}")
    require(ever_faulty(transitions) == injected, f"injected {injected}, ever called faulty {ever_faulty(transitions)}")
    explained = len({t["component"] for t in transitions if t["state"] == "explained"})
    table.row("all together", "exactly the injected ones", f"{len(held)} of {len(injected)}, nothing else; {explained} explained by them")
    rig.reset(injected)
    until("all is well", 30, lambda: rig.trusswatch("faults", "--exit-code", "--expect", ",".join(MODULES), check=False).returncode == 0)
    table.row("reset", "all is well", "all is well")


if __name__ == "__main__":
    play(story)
