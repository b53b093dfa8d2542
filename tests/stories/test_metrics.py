"""Health and metrics of a plant and two diagnosers over HTTP: read by Prometheus' strict parser and by Prometheus itself,
with the configuration and the alerting rules of deploy/README.md. The mapping of status fields to metrics is tested in
crates/daemon/src/metrics.
"""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import threading
import time
import urllib.error
import urllib.parse
import urllib.request
from pathlib import Path

import pytest
import zenoh
from conftest import ROOT, cannot, trusswatch, until
from held_thread import has_died, hold
from prometheus_client.openmetrics.parser import text_string_to_metric_families

PROMETHEUS = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "trusswatch/prometheus/usr/bin"
ADDRESSES = {"module1": "127.0.0.1:9464", "module2": "127.0.0.1:9465", "plant": "127.0.0.1:9466"}
SERVED = "http://127.0.0.1:9090"
FLOOD_S = 4


def get(name, path):
    """HTTP status and body."""
    try:
        with urllib.request.urlopen(f"http://{ADDRESSES[name]}{path}", timeout=10) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()
    except OSError as error:
        return None, str(error)


def answers(name, path, status, words):
    """Waits until a process gives this answer."""
    def probe():
        got, body = get(name, path)
        return got == status and words in body
    until(f"{name}{path} is {status} with “{words}”", probe)


def families(name):
    """All metrics, read by a strict parser."""
    status, text = get(name, "/metrics")
    assert status == 200, text
    return list(text_string_to_metric_families(text))


def metrics(name):
    """Every sample by its name and its distinguishing labels."""
    samples = {}
    for sample in (sample for family in families(name) for sample in family.samples):
        labels = {label: value for label, value in sample.labels.items() if label not in ("structure", "module")}
        key = (sample.name, *(labels[label] for label in sorted(labels)))
        assert key not in samples, f"{key} twice"
        samples[key] = sample.value
    return samples


def value(name, metric, *labels):
    return metrics(name)[(metric, *labels)]


def health(name, *flags):
    """Exit code and text of `trusswatch health`."""
    done = trusswatch("health", ADDRESSES[name], *flags, check=False)
    return done.returncode, done.stdout + done.stderr


def well_formed(name):
    for family in families(name):
        assert re.fullmatch("(trusswatch|process)_[a-z_]+", family.name)
        assert family.documentation.endswith("."), family
        assert family.unit in ("", "seconds", "bytes"), family
        assert family.type != "counter" or all(sample.name.endswith("_total") for sample in family.samples), family


class Statuses:
    """The statuses that the processes publish on the network."""

    def __init__(self, endpoints):
        settings = {"mode": "peer", "connect": {"endpoints": endpoints, "timeout_ms": -1, "exit_on_failure": False},
                    "listen": {"endpoints": []}, "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}}}
        self.heard = {"plant": [], "module1": [], "module2": []}
        self.session = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))
        self.session.declare_subscriber("trusswatch/tower/*/status", self.hear)

    def hear(self, sample):
        self.heard[str(sample.key_expr).split("/")[2]].append(json.loads(sample.payload.to_string()))

    def module_agrees(self, name):
        """The metrics equal those of a published status, for all components of the module."""
        def both():
            samples = metrics(name)
            at_s = samples[("trusswatch_status_timestamp_seconds",)]
            return next(((samples, s) for s in list(self.heard[name]) if abs(s["time_unix_ns"] / 1e9 - at_s) < 2e-6), None)
        samples, status = until(f"a status of {name} of the instant of its metrics", both)
        assert samples[("trusswatch_step",)] == status["step"]
        assert samples[("trusswatch_samples_received_total",)] == status["intake"]["received"]
        states = {key[1]: count for key, count in samples.items() if key[0] == "trusswatch_components"}
        assert states["latched"] + states["acknowledged"] == status["latched"]
        assert sum(states.values()) == 12

    def plant_agrees(self):
        """The plant's metrics are taken at the scrape, so they lie between two statuses."""
        before = until("a status of the plant", lambda: list(self.heard["plant"]))[-1]
        samples = metrics("plant")
        at_s = samples[("trusswatch_status_timestamp_seconds",)]
        after = until("the next one", lambda: [s for s in list(self.heard["plant"]) if s["time_unix_ns"] / 1e9 > at_s])[0]
        assert before["next_step"] <= samples[("trusswatch_plant_next_step",)] <= after["next_step"]
        assert samples[("trusswatch_plant_faults",)] == len(after["faults"]) == 1
        assert samples[("trusswatch_plant_phase", "running")] == 1


def withstands_hostile_clients(name):
    """A flood, and many silent connections, do not affect the diagnosis."""
    before = metrics(name)
    host, port = ADDRESSES[name].split(":")
    silent = [socket.create_connection((host, int(port))) for _ in range(100)]
    for number, one in enumerate(silent):
        one.sendall(b"GET /metrics HTTP/1.1\r\n" if number % 2 else b"\xff" * 100)
    end = time.monotonic() + FLOOD_S

    def flood():
        while time.monotonic() < end:
            get(name, "/metrics")
    clients = [threading.Thread(target=flood) for _ in range(8)]
    for client in clients:
        client.start()
    for client in clients:
        client.join()
    for one in silent:
        one.close()
    at = ("trusswatch_status_timestamp_seconds",)
    after = until("the next status", lambda: (m := metrics(name))[at] > before[at] and m)
    for metric in "samples_missing", "resynchronisations", "sample_timeouts":
        key = (f"trusswatch_{metric}_total",)
        assert before[key] == after[key], metric
    assert get(name, "/readyz")[0] == 200


def hangs(process, name, thread):
    """Holds only the loop's thread; all others continue, including the one that serves health."""
    tasks = {(task / "comm").read_text().strip(): int(task.name) for task in Path(f"/proc/{process.pid}/task").iterdir()}
    try:
        hold(tasks[thread])
    except OSError as error:
        cannot(f"health of {name} while its loop hangs", error)
    for path in "/healthz", "/readyz":
        answers(name, path, 503, "the loop has made no progress for")
    assert value(name, "trusswatch_loop_age_seconds") > 2
    assert health(name, "--live")[0] == 1
    process.kill()
    until(f"{name} has ended", lambda: has_died(tasks[thread]))


def documented_file(name):
    found = re.search(rf"<!-- {re.escape(name)} file -->\n```\w*\n(.*?)```", (ROOT / "deploy/README.md").read_text(), re.S)
    assert found, f"deploy/README.md has no `{name} file`"
    return found[1]


@pytest.fixture
def configs(own_network, tmp_path):
    """The shipped configurations with health enabled by uncommenting it."""
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    for name, address in ADDRESSES.items():
        file = tmp_path / "configs" / f"{name}.toml"
        text, switched = re.subn(r"(?m)^# (\[health\]|listen = )", r"\1", file.read_text())
        assert switched == 2 and f'[health]\nlisten = "{address}"' in text
        file.write_text(text)
    return tmp_path / "configs"


@pytest.fixture
def alerts(rig, own_network, tmp_path):
    """Starts Prometheus as documented but with shorter intervals; returns a function that queries it."""
    if not (PROMETHEUS / "prometheus").exists():
        cannot("Prometheus", "run .ci/tools prometheus")
    quick = "global: {scrape_interval: 250ms, scrape_timeout: 250ms, evaluation_interval: 250ms}\n"
    (tmp_path / "prometheus.yml").write_text(quick + documented_file("prometheus.yml"))
    (tmp_path / "trusswatch.rules.yml").write_text(documented_file("trusswatch.rules.yml"))
    checked = subprocess.run([PROMETHEUS / "promtool", "check", "config", tmp_path / "prometheus.yml"], capture_output=True, text=True)
    assert checked.returncode == 0, checked.stdout + checked.stderr
    rig.start("prometheus", PROMETHEUS / "prometheus", f"--config.file={tmp_path}/prometheus.yml",
              f"--storage.tsdb.path={tmp_path}/tsdb", f"--web.listen-address={SERVED.removeprefix('http://')}")

    def ask(query):
        try:
            with urllib.request.urlopen(f"{SERVED}/api/v1/query?{urllib.parse.urlencode({'query': query})}", timeout=10) as answer:
                return json.load(answer)["data"]["result"]
        except OSError:
            return []
    return ask


def test_readiness_in_the_life_of_a_process(rig, configs):
    """From startup, through a plant that stops, to hung loops and ended processes."""
    plant, module1 = rig.plant(configs), rig.diagnoser("module1", configs)
    answers("plant", "/readyz", 503, "waiting for the diagnosers of module2")
    answers("plant", "/healthz", 200, "the loop is live")
    answers("module1", "/readyz", 503, "waiting: no sample received yet")
    answers("module1", "/healthz", 200, "the loop is live")
    rig.diagnoser("module2", configs)
    answers("module1", "/readyz", 503, "initialising: ")
    for name, words in ("module1", "in_service"), ("module2", "in_service"), ("plant", "running"):
        answers(name, "/readyz", 200, words)
        code, said = health(name)
        assert code == 0 and words in said

    plant.send_signal(signal.SIGSTOP)
    answers("module1", "/readyz", 503, "stale: no sample since 20")
    answers("module1", "/healthz", 200, "the loop is live")
    code, said = health("module1")
    assert code == 1 and "stale" in said
    code, said = health("plant")
    assert code == 4 and "no answer" in said
    plant.send_signal(signal.SIGCONT)
    answers("module1", "/readyz", 200, "in_service")

    hangs(module1, "module1", "trusswatch-diag")
    hangs(plant, "plant", "plant")
    assert health("module1")[0] == 4
    assert rig.end("module2") == 0


def test_metrics_are_those_of_the_published_status(rig, configs):
    rig.plant(configs)
    for module in "module1", "module2":
        rig.diagnoser(module, configs)
    for name in ADDRESSES:
        answers(name, "/readyz", 200, "")
        well_formed(name)
    statuses = Statuses(rig.endpoints())
    with statuses.session:
        statuses.module_agrees("module1")
        withstands_hostile_clients("module1")
        inject_bias(rig)
        until("the fault is in the metrics", lambda: value("module1", "trusswatch_component_faulty", "sensor/g2") == 1)
        assert value("module1", "trusswatch_limit_ratio", "sensor/g2", "change") >= 0
        bias = ("trusswatch_fault_kind_probability", "sensor/g2", "bias")
        until("the fault is identified in the metrics", lambda: metrics("module1").get(bias, 0) >= 0.95)
        assert value("module1", "trusswatch_identifications_missed_total", "turned_away") == 0
        assert value("module1", "trusswatch_identifications_published_total") >= 1
        statuses.module_agrees("module1")
        statuses.module_agrees("module2")
        statuses.plant_agrees()
    for name in ADDRESSES:
        well_formed(name)


def inject_bias(rig):
    trusswatch("inject", "module1/sensor/g2", "bias", "--offset-m", "1.5e-4", "--mode", "peer", "--connect", rig.endpoints()[0])


def dashboard():
    """Every expression of the Grafana dashboard, for all structures and modules."""
    panels = json.loads((ROOT / "deploy/grafana/trusswatch.json").read_text())["panels"]
    expressions = [target["expr"] for panel in panels for target in panel["targets"]]
    assert len(expressions) > 15
    return [re.sub(r"\$(structure|module)", ".*", e).replace("[5m]", "[2s]") for e in expressions]


def test_alerts_of_prometheus(rig, configs, alerts):
    """The documented rules alert on a fault and on a module without samples, and on nothing else."""
    plant = rig.plant(configs)
    for module in "module1", "module2":
        rig.diagnoser(module, configs)
    for name in ADDRESSES:
        answers(name, "/readyz", 200, "")
    until("Prometheus has read all three", lambda: (up := alerts("sum(up)")) and up[0]["value"][1] == "3")
    until("no alert", lambda: alerts("ALERTS") == [] and alerts("trusswatch_phase{phase='in_service'} == 1"))
    inject_bias(rig)
    firing = until("an alert", lambda: alerts('ALERTS{alertname="ComponentFaulty",alertstate="firing"}'))
    empty = [e for e in dashboard() if not alerts(e)]
    assert empty == ["sum(trusswatch_notify_pending)"], "what no notifier has"
    assert [(alert["metric"]["module"], alert["metric"]["component"]) for alert in firing] == [("module1", "sensor/g2")]
    plant.send_signal(signal.SIGSTOP)
    until("an alert", lambda: alerts('ALERTS{alertname="ModuleNotMonitored",module="module1"}'))
