"""Health and metrics of a plant and two diagnosers, queried over HTTP and compared with what the same
processes publish on the network. Prints what was expected and what was seen.

    python3 health_rows.py FOLDER     (where `prometheus` and `promtool` are, if anywhere; needs .ci/nspawn and deploy/compose in PYTHONPATH, eclipse-zenoh and prometheus_client from PyPI)
"""

import contextlib
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.parse
import urllib.request
from pathlib import Path

import zenoh
from prometheus_client.openmetrics.parser import text_string_to_metric_families

import held_thread
from expectations import require, seen, until

ROOT = Path(__file__).resolve().parent.parent
os.chdir(ROOT)

BIN = ROOT / "target/release"
CONFIGS = {"plant": "plant.toml", "module1": "module1.toml", "module2": "module2.toml"}
LABELS = {"structure", "module", "phase", "state", "component", "reason", "outcome", "peer", "version", "fingerprint", "how"}
# Nothing takes longer, on however busy a machine.
LIMIT_S = 60
# Below the ephemeral ports, so that no outgoing connection takes one meanwhile.
PORTS = iter(range(20_000, 32_000))


def skipped(what):
    require(not os.environ.get("CI"), f"with CI set, a skipped check is a failure: {what}")
    print(what)
    if "SKIPPED" in os.environ:
        with open(os.environ["SKIPPED"], "a") as file:
            file.write(what + "\n")


def free_port():
    """Another one at each call."""
    for port in PORTS:
        with socket.socket() as there, contextlib.suppress(OSError):
            there.bind(("127.0.0.1", port))
            return port
    raise AssertionError("no port is free")


class Process:
    """A program with its health on an address of its own."""

    def __init__(self, name, program, folder, address):
        self.name, self.address, self.folder = name, address, folder
        command = [BIN / program, "run", folder / CONFIGS[name]]
        if name != "plant":
            command += ["--state-dir", folder / f"state-{name}"]
        self.log = folder / f"{name}.log"
        self.child = subprocess.Popen(command, stderr=self.log.open("wb"))

    def get(self, path):
        """Status and body."""
        try:
            with urllib.request.urlopen(f"http://{self.address}{path}", timeout=10) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, error.read().decode()
        except OSError as error:
            return None, str(error)

    def is_at(self, path, status, words):
        """Waits until it answers so."""
        def answer():
            got = self.get(path)
            return got if got[0] == status and words in got[1] else None
        got = until(f"{self.name}{path} is {status} with “{words}”", LIMIT_S, answer)
        return f"{got[0]} “{got[1].strip()}”"

    def metrics(self):
        """Every sample, by name and labels; only what a strict parser takes."""
        status, text = self.get("/metrics")
        require(status == 200, f"{status} {text}")
        families = list(text_string_to_metric_families(text))
        return Metrics(families)

    def health(self, *flags):
        """What the command line reports: exit code and text."""
        done = subprocess.run([BIN / "trusswatch", "health", self.address, *flags], capture_output=True, text=True, timeout=LIMIT_S)
        return done.returncode, (done.stdout + done.stderr).strip()

    def signal(self, number):
        self.child.send_signal(number)

    def end(self):
        if self.child.poll() is None:
            self.child.kill()
        self.child.wait()


class Metrics:
    def __init__(self, families):
        self.families = families
        self.samples = {}
        for family in families:
            for sample in family.samples:
                labels = {name: value for name, value in sample.labels.items() if name not in ("structure", "module")}
                key = (sample.name, *sorted(labels.items()))
                require(key not in self.samples, f"{key} twice")
                self.samples[key] = sample.value

    def of(self, name, **labels):
        return self.samples[(name, *sorted(labels.items()))]


class Onlooker:
    """Collects what the processes publish on the network."""

    def __init__(self, endpoints):
        settings = {"mode": "peer", "connect": {"endpoints": endpoints, "timeout_ms": -1, "exit_on_failure": False},
                    "listen": {"endpoints": []}, "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}}}
        self.lock, self.statuses = threading.Lock(), {}
        self.session = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))
        self.subscribers = [self.session.declare_subscriber("trusswatch/tower/*/status", self.hear)]

    def hear(self, sample):
        speaker = str(sample.key_expr).split("/")[2]
        with self.lock:
            self.statuses.setdefault(speaker, []).append(json.loads(sample.payload.to_string()))

    def heard(self, speaker):
        with self.lock:
            return list(self.statuses.get(speaker, []))

    def inject(self, component, fault):
        order = json.dumps({"v": 1, "component": component, "fault": fault})
        for reply in self.session.get("trusswatch/tower/plant/command/inject", payload=order, timeout=20):
            require(reply.ok is not None, f"the plant refuses: {reply.err and reply.err.payload.to_string()}")
            return
        raise AssertionError("the plant did not answer")


def of_module(status):
    """What the metrics of this status must be, by the message and not by the program."""
    said = {}

    def expect(name, value, **labels):
        said[(name, *sorted(labels.items()))] = value

    for phase in ("waiting", "initialising", "in_service", "stale"):
        expect("trusswatch_phase", float(status["phase"] == phase), phase=phase)
    expect("trusswatch_step", status["step"])
    expect("trusswatch_lag_seconds", status["lag_ms"] / 1000)
    expect("trusswatch_sample_age_seconds", status["sample_age_ms"] / 1000)
    expect("trusswatch_samples_queued", status["queued_samples"])
    expect("trusswatch_questions_waiting", status["waiting_questions"])
    expect("trusswatch_transitions_total", status["next_sequence"] - 1)
    expect("trusswatch_thresholds_info", 1, fingerprint=status["thresholds"])
    if status["reference"] is not None:
        expect("trusswatch_reference_info", 1, fingerprint=status["reference"])
    expect("trusswatch_components_verified", status["verified"])
    expect("trusswatch_components_set_aside", status["shelved"])
    expect("trusswatch_module_suppressed", float(status["suppressed"] is not None))
    expect("trusswatch_build_info", 1, version=status["software"])
    expect("trusswatch_components", status["unconfirmed"], state="unconfirmed")
    expect("trusswatch_components", status["unknown"], state="unknown")
    intake, diagnosis, inquiries = status["intake"], status["diagnosis"], status["inquiries"]
    for name, value in [
        ("samples_received", intake["received"]), ("samples_diagnosed", diagnosis["samples"]),
        ("samples_missing", diagnosis["samples_missing"]), ("samples_recovered", intake["recovered"]),
        ("recoveries_failed", intake["recoveries_failed"]), ("sample_timestamps_not_increasing", intake["clock_standing"]),
        ("resynchronisations", intake["resynchronised"]), ("sample_timeouts", intake["silences"]),
        ("samples_incomplete", diagnosis["samples_non_finite"]), ("runs", diagnosis["runs"]), ("channel_restarts", diagnosis["restarts"]), ("changes", diagnosis["changes"]),
        ("changes_unjudged", diagnosis["changes_unjudged"]),
        ("questions_asked", diagnosis["questions_asked"]), ("questions_unanswered", diagnosis["questions_unanswered"]),
        ("answers_malformed", diagnosis["answers_malformed"]), ("verdicts_disputed", diagnosis["verdicts_disputed"]),
        ("requests_received", inquiries["received"]),
        ("events_published", status["publisher"]["events"]), ("events_lost", status["publisher"]["events_lost"]),
        ("replies_lost", status["publisher"]["replies_lost"]), ("journal_records_lost", status["journal"]["lost"]),
        ("journal_records_damaged", status["journal"]["damaged"]),
    ]:
        expect(f"trusswatch_{name}_total", value)
    for reason in ("dropped", "malformed", "unknown_version", "wrong_message", "other_module", "other_source"):
        expect("trusswatch_samples_rejected_total", intake[reason], reason=reason)
    for reason in ("repeated", "late", "far_ahead", "wrong_length"):
        expect("trusswatch_samples_rejected_total", diagnosis[f"samples_{reason}"], reason=reason)
    expect("trusswatch_questions_received_total", diagnosis["answers_given"], outcome="answered")
    expect("trusswatch_questions_received_total", diagnosis["questions_refused"], outcome="refused")
    for outcome in ("answered", "refused", "malformed", "turned_away"):
        expect("trusswatch_requests_total", inquiries[outcome], outcome=outcome)
    for outcome, field in (("accepted", "orders_obeyed"), ("refused", "orders_refused")):
        expect("trusswatch_commands_total", inquiries[field], outcome=outcome)
    expect("trusswatch_journal_kept", float(status["journal"]["directory"] is not None))
    expect("trusswatch_journal_failing", float(status["journal"]["problem"] is not None))
    expect("trusswatch_journal_size_bytes", status["journal"]["bytes"])
    expect("trusswatch_journal_records_unsaved", status["journal"]["unsaved"])
    for peer in status["peers"]:
        expect("trusswatch_peer_present", float(peer["present"]), peer=peer["module"])
        for outcome in ("answered", "refused", "timed_out", "absent", "malformed"):
            expect("trusswatch_peer_questions_total", peer[outcome], peer=peer["module"], outcome=outcome)
        expect("trusswatch_peer_verdicts_disputed_total", peer["disputed"], peer=peer["module"])
    return said


# Metrics of the process, of each component, or of time, which the status does not have.
BESIDES = {"trusswatch_loop_age_seconds", "process_cpu_seconds_total", "process_resident_memory_bytes",
           "trusswatch_status_timestamp_seconds", "trusswatch_components", "trusswatch_component_faulty",
           "trusswatch_divergence_ratio", "trusswatch_fault_kind_probability", "trusswatch_identifications_total",
           "trusswatch_identification_seconds_total", "trusswatch_identifications_published_total",
           "trusswatch_identifications_missed_total", "trusswatch_component_set_aside",
           "trusswatch_component_set_aside_end_timestamp_seconds"}


def module_agrees(process, onlooker):
    """Metrics and status of the same instant agree, and neither leaves anything out."""
    def both():
        metrics = process.metrics()
        at = metrics.of("trusswatch_status_timestamp_seconds")
        same = (s for s in onlooker.heard(process.name) if abs(s["time_unix_ns"] / 1e9 - at) < 2e-6)
        return next(((metrics, status) for status in same), None)
    metrics, status = until(f"a status of {process.name} of the instant of its metrics", LIMIT_S, both)
    said = of_module(status)
    for key, value in said.items():
        require(key in metrics.samples, f"{key} is missing")
        require(abs(metrics.samples[key] - value) <= 1e-9 * abs(value), f"{key}: {metrics.samples[key]}, status {value}")
    more = {key[0] for key in metrics.samples if key not in said} - BESIDES
    require(not more, f"{more} stand in no status")
    states = {key[1][1]: value for key, value in metrics.samples.items() if key[0] == "trusswatch_components"}
    require(states["latched"] + states["acknowledged"] == status["latched"], f"{states}, status {status['latched']}")
    require(sum(states.values()) == 12, f"{states}")
    return f"{len(said)} values of step {status['step']} are those of the status, latched {status['latched']}"


def plant_agrees(process, onlooker):
    """The plant's metrics are taken when queried: they lie between two statuses."""
    before = until("a status of the plant", LIMIT_S, lambda: onlooker.heard("plant"))[-1]
    metrics = process.metrics()
    after = until("the next status of the plant", LIMIT_S, lambda: [s for s in onlooker.heard("plant") if s["time_unix_ns"] / 1e9 > metrics.of("trusswatch_status_timestamp_seconds")])[0]
    for name, of in [("trusswatch_plant_next_step", lambda s: s["next_step"]),
                     ("trusswatch_plant_steps_late_total", lambda s: s["late_steps"]),
                     ("trusswatch_plant_worst_delay_seconds", lambda s: s["latest_ms"] / 1000),
                     ("trusswatch_plant_samples_unsent_total", lambda s: s["samples_unsent"]),
                     ("trusswatch_plant_faults", lambda s: len(s["faults"])),
                     ("trusswatch_plant_modules_awaited", lambda s: len(s["waiting_for"])),
                     ("trusswatch_plant_speed_ratio", lambda s: s["speed"])]:
        value = metrics.of(name)
        require(of(before) - 1e-9 <= value <= of(after) + 1e-9, f"{name}: {of(before)} ≤ {value} ≤ {of(after)}")
    require(metrics.of("trusswatch_plant_phase", phase="running") == 1, "not running")
    return f"step {metrics.of('trusswatch_plant_next_step'):.0f} lies between those of two statuses"


def well_formed(process):
    families = process.metrics().families
    for family in families:
        require(re.fullmatch("(trusswatch|process)_[a-z_]+", family.name), family.name)
        require(family.documentation.endswith("."), f"{family.name}: {family.documentation}")
        require(family.unit in ("", "seconds", "bytes"), f"{family.name}: {family.unit}")
        for sample in family.samples:
            require(set(sample.labels) <= LABELS, f"{sample.name}: {sample.labels}")
            require(family.type != "counter" or sample.name.endswith("_total"), sample.name)
    samples = sum(len(family.samples) for family in families)
    return f"{len(families)} families, {samples} samples"


def hostile(process):
    """A flood, and many silent connections: the diagnosis is not affected. [requests answered]"""
    before = process.metrics()
    host, port = process.address.split(":")
    silent = [socket.create_connection((host, int(port))) for _ in range(100)]
    for number, one in enumerate(silent):
        one.sendall(b"GET /metrics HTTP/1.1\r\n" if number % 2 else b"\xff" * 100)
    end, answered = time.monotonic() + 4, []

    def flood():
        while time.monotonic() < end:
            if process.get("/metrics")[0] == 200:
                answered.append(1)
    clients = [threading.Thread(target=flood) for _ in range(8)]
    for client in clients:
        client.start()
    for client in clients:
        client.join()
    for one in silent:
        one.close()
    after = until("the next status", LIMIT_S, lambda: (m := process.metrics()).of("trusswatch_status_timestamp_seconds") > before.of("trusswatch_status_timestamp_seconds") and m)
    for name in ("trusswatch_samples_missing_total", "trusswatch_resynchronisations_total", "trusswatch_sample_timeouts_total"):
        require(before.of(name) == after.of(name), f"{name}: {before.of(name)} before, {after.of(name)} after")
    require(process.get("/readyz")[0] == 200, f"{process.get('/readyz')}")
    return f"{len(answered)} answers in 4 s, no sample missed, lag {after.of('trusswatch_lag_seconds') * 1e3:.1f} ms"


def document_file(name):
    """What stands in deploy/README.md after `<!-- NAME file -->`."""
    text = Path("deploy/README.md").read_text()
    found = re.search(rf"<!-- {re.escape(name)} file -->\n```\w*\n(.*?)```", text, re.DOTALL)
    require(found, f"deploy/README.md has no `{name} file`")
    return found.group(1)


class Prometheus:
    """Prometheus itself, as deploy/README.md configures it, but with these addresses and quicker."""

    def __init__(self, programs, folder, addresses):
        config = document_file("prometheus.yml")
        for shipped, address in zip(("127.0.0.1:9464", "127.0.0.1:9465", "127.0.0.1:9466"), addresses):
            require(shipped in config, f"{shipped} is not in the documented prometheus.yml")
            config = config.replace(shipped, address)
        config = "global: {scrape_interval: 250ms, scrape_timeout: 250ms, evaluation_interval: 250ms}\n" + config
        (folder / "prometheus.yml").write_text(config)
        (folder / "trusswatch.rules.yml").write_text(document_file("trusswatch.rules.yml"))
        checked = subprocess.run([programs / "promtool", "check", "config", folder / "prometheus.yml"], capture_output=True, text=True)
        require(checked.returncode == 0, checked.stdout + checked.stderr)
        seen("promtool: the documented configuration and rules", checked.stdout.strip().splitlines()[-1].strip())
        self.address = f"127.0.0.1:{free_port()}"
        self.child = subprocess.Popen(
            [programs / "prometheus", f"--config.file={folder / 'prometheus.yml'}", f"--storage.tsdb.path={folder / 'tsdb'}",
             f"--web.listen-address={self.address}"], stderr=(folder / "prometheus.log").open("wb"), stdout=subprocess.DEVNULL)

    def ask(self, query):
        try:
            url = f"http://{self.address}/api/v1/query?{urllib.parse.urlencode({'query': query})}"
            with urllib.request.urlopen(url, timeout=10) as answer:
                return json.load(answer)["data"]["result"]
        except OSError:
            return []

    def end(self):
        self.child.kill()
        self.child.wait()


def configured(folder):
    """The shipped configurations with ports of this run, health switched on by taking the comment off."""
    ports = {port: free_port() for port in ("7447", "7448", "7449", "9464", "9465", "9466")}
    addresses = {}
    for file in CONFIGS.values():
        text = (folder / file).read_text()
        text, switched = re.subn(r"(?m)^# (\[health\]|listen = )", r"\1", text)
        require(switched == 2, f"{file} has no `[health]` to take the comment off")
        text = re.sub(r"127\.0\.0\.1:(\d+)", lambda found: f"127.0.0.1:{ports[found[1]]}", text)
        (folder / file).write_text(text)
        addresses[file] = re.search(r"\[health\]\nlisten = \"(.*)\"", text)[1]
    return addresses, [f"tcp/127.0.0.1:{ports[port]}" for port in ("7447", "7448", "7449")]


def held_loop(process, thread, what):
    """Holds the loop's thread alone: all others go on, the one that serves health among them."""
    try:
        held_thread.hold(thread)
    except OSError as error:
        skipped(f"health of a hung loop of {what}: {error}")
        return
    seen(f"the loop of {what} hangs: /healthz", process.is_at("/healthz", 503, "the loop has made no progress for"))
    seen(f"the loop of {what} hangs: /readyz", process.is_at("/readyz", 503, "the loop has made no progress for"))
    age = process.metrics().of("trusswatch_loop_age_seconds")
    require(age > 2, f"{age}")
    code, words = process.health("--live")
    require(code == 1, f"{code} {words}")
    seen(f"the loop of {what} hangs: `trusswatch health --live`", f"exit code {code}, loop age {age:.1f} s in the metrics")
    process.child.kill()
    until(f"the loop of {what} has ended", LIMIT_S, lambda: held_thread.has_died(thread))


def named_thread(process, name):
    tasks = Path(f"/proc/{process.child.pid}/task").iterdir()
    return next(int(task.name) for task in tasks if (task / "comm").read_text().strip() == name)


def rows(folder, programs, running):
    addresses, endpoints = configured(folder)

    def start(name):
        program = "trusswatch-plant" if name == "plant" else "trusswatch-diagnoser"
        running.append(Process(name, program, folder, addresses[CONFIGS[name]]))
        return running[-1]

    plant, module1 = start("plant"), start("module1")
    seen("plant without module2: /readyz", plant.is_at("/readyz", 503, "waiting for the diagnosers of module2"))
    seen("plant without module2: /healthz", plant.is_at("/healthz", 200, "the loop is live"))
    seen("module1 without samples: /readyz", module1.is_at("/readyz", 503, "waiting: no sample has come yet"))
    seen("module1 without samples: /healthz", module1.is_at("/healthz", 200, "the loop is live"))
    module2 = start("module2")
    seen("the first steps: /readyz", module1.is_at("/readyz", 503, "initialising: "))
    for process, words in ((module1, "in_service"), (module2, "in_service"), (plant, "running")):
        seen(f"{process.name}: /readyz", process.is_at("/readyz", 200, words))
        code, said = process.health()
        require(code == 0 and words in said, f"{code} {said}")
        seen(f"{process.name}: /metrics by the strict parser", well_formed(process))

    prometheus = None
    if (programs / "prometheus").is_file():
        prometheus = Prometheus(programs, folder, [p.address for p in (module1, module2, plant)])
        running.append(prometheus)
        up = until("Prometheus has read all three", LIMIT_S, lambda: (r := prometheus.ask("sum(up)")) and r[0]["value"][1] == "3" and r)
        seen("Prometheus", f"{up[0]['value'][1]} targets up")
        require(prometheus.ask("ALERTS") == [], f"{prometheus.ask('ALERTS')}")

    onlooker = Onlooker(endpoints)
    seen("module1: metrics and status", module_agrees(module1, onlooker))
    seen("hostile clients", hostile(module1))
    onlooker.inject("module1/sensor/g2", {"kind": "bias", "offset_m": 1.5e-4})
    until("the fault is in the metrics", LIMIT_S, lambda: module1.metrics().of("trusswatch_component_faulty", component="sensor/g2") == 1)
    require(module1.metrics().of("trusswatch_divergence_ratio", component="sensor/g2") > 0, "no divergence")
    bias = ("trusswatch_fault_kind_probability", ("component", "sensor/g2"), ("kind", "bias"))
    until("the fault is identified in the metrics", LIMIT_S, lambda: module1.metrics().samples.get(bias, 0) >= 0.95)
    identified = module1.metrics()
    require(identified.of("trusswatch_identifications_missed_total", reason="turned_away") == 0, "identification turned away")
    require(identified.of("trusswatch_identifications_published_total") >= 1, "nothing published")
    seen("a fault identified", f"{identified.of('trusswatch_identifications_total'):.0f} times in {identified.of('trusswatch_identification_seconds_total') * 1e3:.1f} ms")
    seen("a fault: metrics and status", module_agrees(module1, onlooker))
    seen("the other module: metrics and status", module_agrees(module2, onlooker))
    seen("the plant: metrics and status", plant_agrees(plant, onlooker))
    if prometheus:
        alert = until("an alert", LIMIT_S, lambda: prometheus.ask('ALERTS{alertname="ComponentFaulty",alertstate="firing"}'))
        labels = alert[0]["metric"]
        require((labels["module"], labels["component"]) == ("module1", "sensor/g2"), f"{labels}")
        seen("Prometheus: ComponentFaulty fires", f"{labels['module']} {labels['component']}, and nothing else: {len(alert)}")

    plant.signal(signal.SIGSTOP)
    seen("the plant is stopped: /readyz of module1", module1.is_at("/readyz", 503, "stale: no sample for"))
    seen("the plant is stopped: /healthz of module1", module1.is_at("/healthz", 200, "the loop is live"))
    code, said = module1.health()
    require(code == 1 and "stale" in said, f"{code} {said}")
    code, said = plant.health()
    require(code == 4 and "no answer" in said, f"{code} {said}")
    seen("the plant is stopped: `trusswatch health`", f"module1 exit code 1, plant exit code {code}")
    if prometheus:
        alert = until("an alert", LIMIT_S, lambda: prometheus.ask('ALERTS{alertname="ModuleNotMonitored",module="module1"}'))
        seen("Prometheus: ModuleNotMonitored", alert[0]["metric"]["alertstate"])
    plant.signal(signal.SIGCONT)
    seen("the plant goes on: /readyz of module1", module1.is_at("/readyz", 200, "in_service"))

    held_loop(module1, module1.child.pid, "module1")
    held_loop(plant, named_thread(plant, "plant"), "the plant")
    code, said = module1.health()
    seen("a terminated process", f"exit code {code}, “{said}”")
    require(code == 4, f"{code} {said}")
    module2.signal(signal.SIGTERM)
    require(module2.child.wait(LIMIT_S) == 0, "module2 did not end properly")
    onlooker.session.close()


def main():
    folder = Path(tempfile.mkdtemp(prefix="trusswatch-health-"))
    running = []
    try:
        shutil.copytree("configs", folder, dirs_exist_ok=True)
        rows(folder, Path(sys.argv[1]), running)
    except BaseException:
        for log in sorted(folder.glob("*.log")):
            print(f"--- {log.name}\n{log.read_text(errors='replace')[-3000:]}", file=sys.stderr)
        raise
    finally:
        for process in running:
            process.end()
        shutil.rmtree(folder)


main()
