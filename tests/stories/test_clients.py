"""Third-party clients: the recipes of crates/vocabulary/README.md run as printed, every message conforms to its
schema, and other programs compute the same numbers from a recording.
"""

import collections
import copy
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import zenoh
from conftest import LIMIT_S, PROGRAMS, ROOT, documented, trusswatch, until
from residual import residuals

STATES = {"normal", "unknown", "tentative", "unconfirmed", "explained", "latched", "acknowledged"}
# Finds the programs of the PyPI packages; their output is not buffered.
ENVIRONMENT = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}", "PYTHONUNBUFFERED": "1"}


@pytest.fixture(scope="module")
def schemas():
    return json.loads(trusswatch("schema"))


def recipe(name, endpoint=""):
    """The documents' command, adapted to the programs under test."""
    text = documented(name).replace("tcp/HOST:PORT", endpoint).replace("./target/release", str(PROGRAMS))
    return [sys.executable, "-c", text] if text.startswith("import") else ["bash", "-c", text]


def ask(name, endpoint):
    """The output of a recipe that ends by itself: one message per line."""
    command = recipe(name, endpoint)
    done = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT, cwd=ROOT, timeout=LIMIT_S)
    assert done.returncode == 0, f"{name}: {done.stderr}"
    return [json.loads(line) for line in done.stdout.splitlines()]


def only_faulty(endpoint, *components):
    """Whether these components are faulty by now; no other may ever be."""
    states = ask("present", endpoint)
    assert {item["state"] for item in states} <= STATES, states
    faulty = {item["component"] for item in states if item["state"] in ("latched", "acknowledged")}
    assert faulty <= set(components), states
    return faulty == set(components)


def latched(transitions):
    return {item["component"] for item in transitions if item["state"] == "latched"}


def named_exactly(printed):
    """The components that the demo made faulty, with their kinds: it isolated all of them and no others."""
    summary = json.loads(printed.splitlines()[-1])
    assert summary["event"] == "summary" and summary["exact"] is True, summary
    assert len(set(summary["pids"])) >= 3, summary["pids"]
    injected = [fault["component"] for fault in summary["injected"]]
    assert sorted(injected) == sorted(fault["component"] for fault in summary["diagnosed"]), summary
    assert len(set(injected)) >= 5, injected
    decided = {fault["component"]: fault["decided_step"] for fault in summary["diagnosed"]}
    return decided, {fault["component"]: fault["fault"]["kind"] for fault in summary["injected"]}


def decided_since(decided, steps):
    """The faulty components that a subscriber hears of from its first message on: that it connected before the first
    fault is not certain.
    """
    first = min(steps)
    return {component for component, step in decided.items() if step >= first}


def test_recipes_give_what_the_demo_did(rig):
    demo = rig.start("demo", PROGRAMS / "trusswatch", "demo", "--json")
    printed = rig.folder / "demo.out"
    endpoint = until("the demo's address", lambda: re.search(r"tcp/127\.0\.0\.1:\d+", printed.read_text()))[0]
    for name in ("watch", "kinds", "transitions"):
        rig.start(name, *recipe(name, endpoint), env=ENVIRONMENT)

    def lines(name):
        return (rig.folder / f"{name}.out").read_text().rpartition("\n")[0].splitlines()

    def watched():
        pairs = [line.split(" ", 1) for line in lines("watch")]
        return [(key, json.loads(message)) for key, message in pairs]

    until("a fault", lambda: latched(item for _, item in watched()))
    pages = ask("history", endpoint)
    states = ask("present", endpoint)
    assert demo.wait(timeout=2 * LIMIT_S) == 0
    decided, kinds = named_exactly(printed.read_text())
    injected = set(decided)

    # The injected faults were received and no others, each under its own key.
    expected = decided_since(decided, [item["decided_step"] for _, item in watched()])
    assert len(expected) >= 3, (expected, decided)
    until("every fault was watched", lambda: latched(item for _, item in watched()) >= expected)
    assert latched(item for _, item in watched()) <= injected
    for key, item in watched():
        module, component = item["component"].split("/", 1)
        assert key == f"trusswatch/tower/{module}/fault/{component}", (key, item)

    found = [json.loads(line.split(" ", 1)[1]) for line in lines("kinds")]
    named = {(item["component"], item["candidates"][0]["kind"]) for item in found if item["decided"]}
    expected = decided_since(decided, [item["as_of_step"] for item in found])
    assert len(expected) >= 3 and {(component, kinds[component]) for component in expected} <= named, found

    since = [line.split() for line in lines("transitions")]
    assert {line[0] for line in since if line[1:4] == ["latched", "since", "step"]} == injected, since

    # Queries meanwhile: every component once, every module's journal.
    assert len({item["component"] for item in states}) == len(states) == 24, states
    assert latched(states) and latched(states) <= injected, states
    assert {page["module"] for page in pages} == {"module1", "module2"}, pages
    journalled = latched(item for page in pages for item in page["transitions"])
    assert journalled and journalled <= injected, pages


def test_messages_on_the_bus_and_their_recording(rig, own_network, schemas):
    endpoints, module1 = rig.endpoints(), rig.endpoints()[1]
    rig.diagnoser("module1")
    rig.diagnoser("module2")
    recordings = rig.folder / "recordings"
    network = ["--structure", "tower", "--mode", "peer", *(f"--connect={endpoint}" for endpoint in endpoints)]
    rig.start("recorder", PROGRAMS / "trusswatch", "record", "--into", recordings, *network)

    # Every kind of message is seen, and is valid.
    client = zenoh.Config()
    client.insert_json5("connect/endpoints", json.dumps(endpoints))
    client.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(client) as session:
        bus = Bus(session, schemas)
        rig.plant()
        until("every kind of message", bus.has_seen_all, 90, pause_s=0.5)
        assert not bus.wrong, "\n".join(bus.wrong[:10])

    # A fault injected by another client; the other faulty gage is that of the bus.
    [reply] = ask("inject", module1)
    assert reply["component"] == "module1/sensor/g2" and reply["effective_step"] > 0, reply
    until("both are faulty", lambda: only_faulty(module1, "module1/sensor/g2", "module2/sensor/g7"))

    # Replay gives the same verdicts, and the Python computation the same residuals.
    assert rig.end("recorder", signal.SIGINT) == 0
    rig.end_all()
    [recording] = recordings.glob("*.mcap")
    trusswatch("replay", recording, "--verify", timeout=2 * LIMIT_S)
    for gage in ("module1/sensor/g1", "module2/sensor/g5"):
        model = json.loads(trusswatch("model", ROOT / "configs/tower.toml", "--module", gage.split("/")[0],
                                      "--held", "clamped", "--json"))
        recorded, computed = residuals(recording, model, gage)
        assert np.max(np.abs(recorded - computed)) <= 1e-9 * np.max(np.abs(recorded)), gage


def test_data_acquisition_in_python(rig, own_network):
    assert len(documented("acquisition").splitlines()) <= 20
    rig.start("diagnosers", *recipe("diagnosers"))
    rig.start("acquisition", *recipe("acquisition"), env=ENVIRONMENT)
    module1 = rig.endpoints()[1]

    def in_service():
        faults = trusswatch("faults", "--connect", module1, "--json", check=False)
        return faults.stdout.count('"in_service"') == 2

    until("both modules in service", in_service)
    until("the loose gage is found", lambda: only_faulty(module1, "module1/sensor/g5"))


class Bus:
    """A client that subscribes to everything and sends every kind of query."""

    def __init__(self, session, schemas):
        self.session = session
        self.validators = {name: jsonschema.Draft202012Validator(schema) for name, schema in schemas.items()}
        self.seen, self.wrong, self.lock = collections.Counter(), [], threading.Lock()
        self.phases, self.run, self.stroke_over, self.injected = {}, None, None, False
        self.travels = [
            (zenoh.KeyExpr(re.sub(r"{\w+}", "*", use["key"])), use["as"], name)
            for name, schema in schemas.items()
            for use in schema["x-keys"]
        ]
        # plant/status before {module}/status
        self.travels.sort(key=lambda travels: str(travels[0]).count("*"))
        self.subscriber = session.declare_subscriber("trusswatch/**", self.published)

    def name_of(self, key, how):
        return next(name for keys, use, name in self.travels if use == how and keys.includes(key))

    def check(self, name, payload):
        self.seen[name] += 1
        # These arrive a thousand times a second; every hundredth is enough.
        if name in ("sample", "corrected") and self.seen[name] % 100 != 1:
            return None
        message = json.loads(payload.to_string())
        with self.lock:
            self.wrong += [f"{name}: {error.message}: {message}" for error in self.validators[name].iter_errors(message)]
        return message

    def published(self, sample):
        name = self.name_of(sample.key_expr, "publication")
        message = self.check(name, sample.payload)
        if name == "module-status":
            self.phases[message["module"]] = message["phase"]
            self.run = message["run"]

    def ask(self, key, message=None):
        """The replies; these and refusals are checked."""
        selector = f"trusswatch/tower/{key}"
        if message is not None:
            name = self.name_of(zenoh.KeyExpr(selector), "query")
            assert self.validators[name].is_valid(message), message
            self.seen[name] += 1
        payload = None if message is None else json.dumps(message)
        replies = []
        for reply in self.session.get(selector, payload=payload, timeout=5):
            if reply.ok:
                replies.append(self.check(self.name_of(reply.ok.key_expr, "reply"), reply.ok.payload))
            else:
                self.check("refused", reply.err.payload)
        return replies

    def has_seen_all(self):
        """Strokes a cylinder, injects and acknowledges a fault, and sends every query to every module."""
        faults = self.ask("*/fault/**")
        for key in ("identification/**", "history?limit=3", "input?to=9", "configuration", "freeze-frame"):
            self.ask(f"*/{key}")
        in_service = list(self.phases.values()) == ["in_service"] * 2
        if self.stroke_over is None and in_service:
            # The controller is inactive for two seconds; the response to a fault then would be late.
            self.stroke_over = time.monotonic() + 3
            stroke = {"v": 1, "component": "module1/actuator/a3", "force_n": 100, "duration_s": 2}
            assert self.ask("plant/command/stroke", stroke), "the plant did not begin the stroke"
        elif in_service and not self.injected and time.monotonic() > self.stroke_over:
            self.injected = True
            fault = {"kind": "bias", "offset_m": 3e-4}
            self.ask("plant/command/inject", {"v": 1, "component": "module2/sensor/g7", "fault": fault})
        for component in latched(faults):
            module, component = component.split("/", 1)
            order = {"v": 1, "component": component, "by": "a client"}
            self.ask(f"{module}/command/acknowledge", order)
            self.ask(f"{module}/command/acknowledge", {**order, "component": "sensor/g99"})
            self.ask(f"{module}/state?run={self.run}&from=1&step=2")
        missing = set(self.validators) - set(self.seen)
        print("not seen yet:", sorted(missing))
        return not missing


def test_a_message_is_valid_by_its_schema_if_the_programs_take_it(schemas, tmp_path):
    """The examples, counter-examples derived from them, and the kept inputs of the fuzzer."""
    for name, schema in schemas.items():
        jsonschema.Draft202012Validator.check_schema(schema)
        example = schema["examples"][0]
        tried = [(json.dumps(message), message) for message in (example, *counter_examples(example))]
        taken = agreed(name, schema, tried, tmp_path)
        assert taken[0] and not all(taken), name
        agreed(name, schema, list(kept_inputs(name)), tmp_path)


def agreed(name, schema, tried, folder):
    """Whether the programs accept each of these texts; the schema must agree."""
    valid = jsonschema.Draft202012Validator(schema)
    file = folder / "messages"
    file.write_text("\n".join(text for text, _ in tried))
    done = trusswatch("schema", name, "--check", file, check=False)
    assert done.returncode in (0, 3), done
    refused = {int(line.split(":")[2]) for line in done.stderr.splitlines()}
    taken = [number not in refused for number in range(1, len(tried) + 1)]
    for (text, message), verdict in zip(tried, taken, strict=True):
        errors = [error.message for error in valid.iter_errors(message)]
        assert verdict == (not errors), f"{name}: the schema says {errors or 'valid'}, the programs {verdict}: {text}"
    return taken


def places(value, path=()):
    """The paths of all values within a message."""
    inside = {dict: lambda: value.items(), list: lambda: enumerate(value)}
    for key, item in inside.get(type(value), tuple)():
        yield path + (key,)
        yield from places(item, path + (key,))


def counter_examples(example):
    """The example with one value removed or replaced."""
    numbers, texts = [0, 2, -1, 1.5, 1e300, 2**64], ["", "x", "11 µm", "a/b"]
    others = [None, True, *numbers, *texts, [], [1.5], {}, {"kind": "bias"}]
    for path in places(example):
        for other in [...] + others:
            changed = copy.deepcopy(example)
            holder = changed
            for key in path[:-1]:
                holder = holder[key]
            if other is ...:
                del holder[path[-1]]
            else:
                holder[path[-1]] = other
            yield changed
    yield {**example, "a field of a later version": 1}
    yield from (None, [], "x", 1)


def kept_inputs(name):
    """The fuzzer's inputs that are one line of JSON without duplicate fields."""

    def once(pairs):
        if len(dict(pairs)) < len(pairs):
            raise ValueError("given twice")
        return dict(pairs)

    def never(constant):
        raise ValueError(constant)

    folder = ROOT / "tests/fuzz/corpus" / f"message_{name.replace('-', '_')}"
    for file in sorted(folder.iterdir()):
        try:
            text = file.read_bytes().decode()
            value = json.loads(text, object_pairs_hook=once, parse_constant=never)
        except (ValueError, RecursionError):
            continue
        if len(text.splitlines()) == 1:
            yield text, value
