"""The running rig, controlled from the host through docker and through the program in the observer."""

import json
import subprocess
import threading
import time

from expectations import START, Late, Table, require, until

PROJECT = "trusswatch"
NETWORK = f"{PROJECT}_tower"
MODULES = ["module1", "module2"]
# Steps until a fault no longer explains changes and has left the statistics, together with its repair if
# that came within REPAIRED_AFTER steps.
APART = 5800
REPAIRED_AFTER = 1200
STEPS_PER_S = 1000


def run(*command, check=True):
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if check and done.returncode != 0:
        raise RuntimeError(f"`{' '.join(map(str, command))}` failed with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done


def docker(*command, **options):
    return run("docker", *command, **options).stdout.strip()


class Rig:
    """The containers, which must be running."""

    def __init__(self):
        self.containers = {}
        for service in ["plant", *MODULES, "observer"]:
            require(self._find(service), f"{service} is not there; bring the rig up with `docker compose -f deploy/compose/compose.yaml up --detach`")
        self.has_router = bool(self._find("router"))
        # With certificates, an observer may only read.
        self.orderer = "operator" if self._find("operator") else "observer"
        # The observer's own connection flags.
        words = docker("inspect", "--format", "{{range .Config.Cmd}}{{println .}}{{end}}", self.containers["observer"]).split()
        self.link = [word for word in words if word.startswith("--")]

    def _find(self, service):
        labels = [f"label=com.docker.compose.{label}" for label in (f"project={PROJECT}", f"service={service}")]
        identifier = docker("ps", "--quiet", "--no-trunc", *(word for label in labels for word in ("--filter", label)))
        if identifier:
            self.containers[service] = identifier
        return identifier

    # The program in a container.

    def trusswatch(self, *words, check=True, by="observer"):
        return run("docker", "exec", self.containers[by], "trusswatch", *words, *self.link, check=check)

    def picture(self):
        """The output of `trusswatch faults`: modules and components by name."""
        done = self.trusswatch("faults", "--all", "--json", "--expect", ",".join(MODULES), check=False)
        try:
            seen = json.loads(done.stdout)
        except json.JSONDecodeError:
            return None
        seen["modules"] = {module["module"]: module for module in seen["modules"]}
        seen["components"] = {component["component"]: component for component in seen["components"]}
        return seen

    def phase(self, module):
        seen = self.picture()
        return seen["modules"][module]["phase"] if seen and seen["modules"][module]["answers"] else "not answering"

    def transitions(self):
        """The journals of all modules, which must be complete."""
        document = json.loads(self.trusswatch("history", "--json", "--module", ",".join(MODULES)).stdout)
        missing = document["silent"] + document["gaps"] + [m for m in document["modules"] if m["broken_off"]]
        require(not missing, f"the journals are not whole: {missing}")
        return document["transitions"]

    def reset(self, components):
        """Acknowledges and resets the components. First restarts the simulated structure, with new cylinders: repaired ones
        hold another amount of oil and would depart from their references."""
        run("docker", "restart", "--time", "5", self.containers["plant"])
        self.in_service()
        self.trusswatch("ack", *components, "--by", "rig", by=self.orderer)
        self.trusswatch("reset", *components, "--by", "rig", "--force", by=self.orderer)

    def inject(self, component, *fault, at_step=None):
        """Injects a fault into a component, or repairs it; returns the step."""
        step = [] if at_step is None else ["--at-step", at_step]
        done = self.trusswatch("inject", component, *fault, *step, "--json", "--structure", "tower", by=self.orderer)
        return json.loads(done.stdout)["effective_step"]

    # The container.

    def pid(self, service):
        return int(docker("inspect", "--format", "{{.State.Pid}}", self.containers[service]))

    def restarts(self, service):
        return int(docker("inspect", "--format", "{{.RestartCount}}", self.containers[service]))

    def health(self, service):
        return docker("inspect", "--format", "{{if .State.Health}}{{.State.Health.Status}}{{end}}", self.containers[service])

    def address(self, service):
        settings = json.loads(docker("inspect", "--format", "{{json .NetworkSettings.Networks}}", self.containers[service]))
        return settings[NETWORK]["IPAMConfig"]["IPv4Address"]

    def confinement(self, service):
        """User and privileges of a container's first process, from the kernel and from docker."""
        with open(f"/proc/{self.pid(service)}/status") as file:
            status = dict(line.split(":", 1) for line in file.read().splitlines())
        words = {name: status[name].split()[0] for name in ("Uid", "Gid", "CapEff", "CapBnd", "NoNewPrivs", "Seccomp")}
        words["ReadonlyRootfs"] = docker("inspect", "--format", "{{.HostConfig.ReadonlyRootfs}}", self.containers[service])
        return words

    # Conditions to wait for.

    def healthy(self, service, seconds=60):
        until(f"{service} is healthy", seconds, lambda: self.health(service) in ("healthy", ""))

    def in_service(self, seconds=60):
        """Waits until every module answers and is in service."""
        until("every module is in service", seconds, lambda: all(self.phase(module) == "in_service" for module in MODULES))

    def step(self):
        seen = until("the modules report their steps", 20, self.picture)
        return max(module["step"] or 0 for module in seen["modules"].values())

    def until_step(self, step, seconds=60):
        until(f"step {step}", seconds, lambda: self.step() >= step)

    def in_real_time(self, seconds=60):
        """Waits until the plant has caught up after a pause: until then it publishes faster than real time, and it keeps only
        the latest 8192 samples for recovery."""
        def keeps_time():
            start, first = time.monotonic(), self.step()
            time.sleep(1)
            passed, steps = time.monotonic() - start, self.step() - first
            return steps < 1.2 * STEPS_PER_S * passed
        until("the plant is in real time", seconds, keeps_time)


class Watcher:
    """The events that the observer receives from now on."""

    def __init__(self, rig):
        self.changed = threading.Condition()
        self.events = []
        command = ["docker", "exec", rig.containers["observer"], "trusswatch", "follow", "--json", *rig.link]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.thread = threading.Thread(target=self._read, daemon=True)
        self.thread.start()

    def _read(self):
        for line in self.process.stdout:
            with self.changed:
                self.events.append(json.loads(line))
                self.changed.notify_all()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()

    def mark(self):
        """The present position in the events."""
        with self.changed:
            return len(self.events)

    def wait(self, what, seconds, is_it, since=0):
        """Waits for an event after `since`, and returns it."""
        def there():
            return next((event for event in self.events[since:] if is_it(event)), None)
        with self.changed:
            if not self.changed.wait_for(there, seconds):
                received = [" ".join(str(event.get(key)) for key in ("news", "component", "module", "who", "state", "phase", "there") if key in event) for event in self.events[since:]]
                raise Late(f"{what}: not within {seconds} s; received: {received}")
            return there()

    def fault(self, component, state, seconds=30, since=0):
        def is_it(event):
            return event["news"] == "fault" and event["component"] == component and event["state"] == state
        return self.wait(f"{component} becomes {state}", seconds, is_it, since)

    def phase(self, module, phase, seconds=30, since=0):
        def is_it(event):
            return event["news"] == "phase" and event["module"] == module and event["phase"] == phase
        return self.wait(f"{module} becomes {phase}", seconds, is_it, since)

    def presence(self, who, there, seconds=30, since=0):
        def is_it(event):
            return event["news"] == "presence" and event["who"] == who and event["there"] == there
        return self.wait(f"{who} {'comes' if there else 'goes'}", seconds, is_it, since)


def nothing_is_wrong(rig):
    seen = rig.picture()
    held = [f"{c['component']} is {c['state']}" for c in seen["components"].values() if c["state"] not in ("normal", "unknown", "explained")]
    require(not held, f"{', '.join(held)}; reset it, or bring the rig up again")


def ever_faulty(transitions):
    return sorted({t["component"] for t in transitions if t["state"] in ("latched", "acknowledged")})


def play(story):
    """Runs a story against the rig and prints its table, also after a failure."""
    table = Table()
    try:
        story(table, Rig())
    except BaseException as error:
        table.fail(error)
        raise
    finally:
        table.print()
        print(f"{time.monotonic() - START:.0f} s", flush=True)
