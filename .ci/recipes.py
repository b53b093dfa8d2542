"""Checks the output of the README's recipes.

  recipes.py demo DIRECTORY             what was watched and queried during the demo
  recipes.py inject FILE                the reply of the plant
  recipes.py present FILE COMPONENT...  these components are faulty, and no others
"""

import json
import pathlib
import sys

STATES = {"normal", "unknown", "tentative", "unconfirmed", "explained", "latched", "acknowledged"}


def messages(file):
    return [json.loads(line) for line in file.read_text().splitlines()]


def latched(transitions):
    return {item["component"] for item in transitions if item["state"] == "latched"}


def demo(directory):
    summary = messages(directory / "demo.jsonl")[-1]
    injected = {fault["component"] for fault in summary["injected"]}
    assert summary["exact"] and len(injected) >= 5, summary

    watched = [line.split(" ", 1) for line in (directory / "watch.txt").read_text().splitlines()]
    transitions = [(key, json.loads(value)) for key, value in watched]
    for key, item in transitions:
        module, component = item["component"].split("/", 1)
        assert key == f"trusswatch/tower/{module}/fault/{component}", (key, item)
    assert latched(item for _, item in transitions) == injected, (transitions, injected)

    found = [json.loads(line.split(" ", 1)[1]) for line in (directory / "kinds.txt").read_text().splitlines()]
    decided = {(item["component"], item["candidates"][0]["kind"]) for item in found if item["decided"]}
    kinds = {(fault["component"], fault["fault"]["kind"]) for fault in summary["injected"]}
    assert kinds <= decided, (kinds, decided)

    lines = [line.split() for line in (directory / "transitions.txt").read_text().splitlines()]
    assert {line[0] for line in lines if line[1:4] == ["latched", "since", "step"]} == injected, lines

    states = messages(directory / "present.txt")
    assert len({item["component"] for item in states}) == len(states) == 24, states
    assert latched(states) and latched(states) <= injected, states

    pages = messages(directory / "history.txt")
    assert {page["module"] for page in pages} == {"module1", "module2"}, pages
    journalled = latched(item for page in pages for item in page["transitions"])
    assert journalled and journalled <= injected, pages
    print(f"watched: {sorted(injected)}; when queried: {sorted(latched(states))} of {len(states)}")


def inject(file):
    [reply] = messages(file)
    assert reply["component"] == "module1/sensor/g2" and reply["effective_step"] > 0, reply
    print(reply)


def present(file, *components):
    states = messages(file)
    assert {item["state"] for item in states} <= STATES, states
    faulty = {item["component"] for item in states if item["state"] in ("latched", "acknowledged")}
    # A fault that was not injected is wrong at any time; an injected one may still be pending.
    assert faulty <= set(components), states
    if faulty != set(components):
        sys.exit(1)
    print("faulty:", *sorted(faulty))


if __name__ == "__main__":
    what, file, *rest = sys.argv[1:]
    {"demo": demo, "inject": inject, "present": present}[what](pathlib.Path(file), *rest)
