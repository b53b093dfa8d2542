"""The schemas of the messages, checked with an independent validator.

  messages.py schemas             examples, counter-examples, kept inputs of the fuzzer: valid by the schema
                                  if and only if the programs take them
  messages.py bus SECONDS ENDPOINT...   every kind of message as it is really sent, which must be valid
"""

import collections
import copy
import json
import pathlib
import re
import subprocess
import sys
import threading
import time

import jsonschema

TRUSSWATCH = "target/release/trusswatch"
SCHEMAS = json.loads(subprocess.check_output([TRUSSWATCH, "schema"]))
VALIDATORS = {name: jsonschema.Draft202012Validator(schema) for name, schema in SCHEMAS.items()}


def taken(name, messages):
    """Whether the programs would take each of these texts."""
    command = [TRUSSWATCH, "schema", name, "--check", "-"]
    done = subprocess.run(command, input="\n".join(messages), capture_output=True, text=True)
    assert done.returncode in (0, 3), done
    refused = {int(line.split(":")[2]) for line in done.stderr.splitlines()}
    return [number not in refused for number in range(1, len(messages) + 1)]


def places(value, path=()):
    """The paths to everything within a message."""
    inside = {dict: lambda: value.items(), list: lambda: enumerate(value)}
    for key, item in inside.get(type(value), tuple)():
        yield path + (key,)
        yield from places(item, path + (key,))


def counter_examples(example):
    """The example with one place left out, or filled with something else."""
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
    """What the fuzzer found, as far as it is one line of JSON without a field given twice."""

    def once(pairs):
        if len(dict(pairs)) < len(pairs):
            raise ValueError("given twice")
        return dict(pairs)

    def never(constant):
        raise ValueError(constant)

    folder = pathlib.Path("tests/fuzz/corpus/message_" + name.replace("-", "_"))
    for file in sorted(folder.iterdir()):
        try:
            text = file.read_bytes().decode()
            value = json.loads(text, object_pairs_hook=once, parse_constant=never)
        except (ValueError, RecursionError):
            continue
        if len(text.splitlines()) == 1:
            yield text, value


def agree(name, texts, values):
    """The schema and the programs agree on these."""
    verdicts = taken(name, texts)
    for text, value, verdict in zip(texts, values, verdicts, strict=True):
        if VALIDATORS[name].is_valid(value) != verdict:
            errors = [error.message for error in VALIDATORS[name].iter_errors(value)]
            sys.exit(f"{name}: the schema says {errors or 'valid'}, the program {verdict}: {text}")
    return verdicts


def schemas():
    for name, schema in SCHEMAS.items():
        jsonschema.Draft202012Validator.check_schema(schema)
        example = schema["examples"][0]
        tried = [example, *counter_examples(example)]
        verdicts = agree(name, [json.dumps(message) for message in tried], tried)
        assert verdicts[0] and not all(verdicts), name
        kept = list(kept_inputs(name))
        agree(name, [text for text, _ in kept], [value for _, value in kept])
        made = f"{len(tried)} made from the example, {sum(verdicts)} of them taken"
        print(f"{name}: {made}; {len(kept)} kept inputs")


class Bus:
    """A client that subscribes to everything and sends every kind of query."""

    def __init__(self, session):
        import zenoh

        self.zenoh, self.session = zenoh, session
        self.seen, self.wrong, self.lock = collections.Counter(), [], threading.Lock()
        self.phases, self.stroke_over, self.injected = {}, None, False
        self.travels = [
            (zenoh.KeyExpr(re.sub(r"{\w+}", "*", use["key"])), use["as"], name)
            for name, schema in SCHEMAS.items()
            for use in schema["x-keys"]
        ]
        # plant/status before {module}/status
        self.travels.sort(key=lambda travels: str(travels[0]).count("*"))
        self.subscriber = session.declare_subscriber("trusswatch/**", self.published)

    def name_of(self, key, how):
        return next(name for keys, use, name in self.travels if use == how and keys.includes(key))

    def check(self, name, payload):
        self.seen[name] += 1
        # Samples come a thousand times a second; every hundredth is enough.
        if name == "sample" and self.seen[name] % 100 != 1:
            return None
        message = json.loads(payload.to_string())
        with self.lock:
            errors = VALIDATORS[name].iter_errors(message)
            self.wrong += [f"{name}: {error.message}: {message}" for error in errors]
        return message

    def published(self, sample):
        name = self.name_of(sample.key_expr, "publication")
        message = self.check(name, sample.payload)
        if name == "module-status":
            self.phases[message["module"]] = message["phase"]

    def ask(self, selector, message=None):
        """Replies and refusals, each valid."""
        if message is not None:
            name = self.name_of(self.zenoh.KeyExpr(selector), "query")
            assert VALIDATORS[name].is_valid(message), message
            self.seen[name] += 1
        payload = None if message is None else json.dumps(message)
        replies = []
        for reply in self.session.get(selector, payload=payload, timeout=5):
            if reply.ok:
                replies.append(self.check(self.name_of(reply.ok.key_expr, "reply"), reply.ok.payload))
            else:
                self.check("refused", reply.err.payload)
        return replies


def bus(limit, endpoints):
    import zenoh

    config = zenoh.Config()
    config.insert_json5("connect/endpoints", json.dumps(endpoints))
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config) as session:
        listener = Bus(session)
        everything = set(SCHEMAS)
        deadline = time.monotonic() + limit
        while time.monotonic() < deadline and set(listener.seen) != everything:
            ask_everything(listener)
            time.sleep(0.5)
        assert not listener.wrong, "\n".join(listener.wrong[:10])
        missing = everything - set(listener.seen)
        assert not missing, f"not seen within {limit} s: {sorted(missing)}; seen: {dict(listener.seen)}"
        print("seen:", ", ".join(f"{count} × {name}" for name, count in sorted(listener.seen.items())))


def ask_everything(listener):
    """Makes a stroke; makes a fault and acknowledges it; asks every module for what it knows."""
    tower = "trusswatch/tower"
    fault = {"kind": "bias", "offset_m": 3e-4}
    faults = listener.ask(f"{tower}/*/fault/**")
    listener.ask(f"{tower}/*/identification/**")
    listener.ask(f"{tower}/*/history?limit=3")
    listener.ask(f"{tower}/*/input?to=9")
    listener.ask(f"{tower}/*/configuration")
    listener.ask(f"{tower}/*/freeze-frame")
    latched = [fault["component"] for fault in faults if fault["state"] == "latched"]
    in_service = list(listener.phases.values()) == ["in_service"] * 2
    if listener.stroke_over is None and in_service:
        # The controller is out of action for two seconds; a fault in them would be answered late.
        listener.stroke_over = time.monotonic() + 3
        stroke = {"v": 1, "component": "module1/actuator/a3", "force_n": 100, "duration_s": 2}
        assert listener.ask(f"{tower}/plant/command/stroke", stroke), "the plant did not begin the stroke"
    elif in_service and not listener.injected and time.monotonic() > listener.stroke_over:
        listener.injected = True
        listener.ask(f"{tower}/plant/command/inject", {"v": 1, "component": "module2/sensor/g7", "fault": fault})
    for component in latched:
        module, component = component.split("/", 1)
        order = {"v": 1, "component": component, "by": "a client"}
        listener.ask(f"{tower}/{module}/command/acknowledge", order)
        listener.ask(f"{tower}/{module}/command/acknowledge", {**order, "component": "sensor/g99"})
        listener.ask(f"{tower}/{module}/state?from=1&step=2")


if __name__ == "__main__":
    if sys.argv[1] == "schemas":
        schemas()
    else:
        bus(float(sys.argv[2]), sys.argv[3:])
