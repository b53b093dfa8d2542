"""The commands of a document and their computers, read from the document itself. A line `<!-- COMPUTER KIND -->` precedes
the commands; a text block directly after them is their expected output, with … for the parts that vary.

| kind | execution |
|---|---|
| `command` | once; every command succeeds |
| `look` | repeated until it prints the documented output |
| `refused` | once; every command fails |
"""

import re
from dataclasses import dataclass

from conftest import until

STEP = re.compile(r"^<!-- (?P<computer>[a-z0-9]+) (?P<kind>command|look|refused) -->\n"
                  r"```sh\n(?P<commands>.*?)^```\n(?:\n?```text\n(?P<printed>.*?)^```\n)?", re.M | re.S)
ANYTHING = "…"
EVERYWHERE = "everywhere"


@dataclass
class Step:
    computer: str
    kind: str
    commands: list
    printed: list

    def computers(self, machines):
        return machines.values() if self.computer == EVERYWHERE else [machines[self.computer]]


def steps(document):
    """The steps of a document, in order."""
    found = []
    for match in STEP.finditer(document):
        commands = match["commands"].replace("\\\n", "").splitlines()
        found.append(Step(match["computer"], match["kind"], commands, (match["printed"] or "").splitlines()))
    return found


def missing(printed, output):
    """The first documented line that is missing from the output, if any; other lines may be in between."""
    lines = iter(output.splitlines())
    for line in printed:
        if line.strip() in ("", ANYTHING):
            continue
        parts = re.split(rf"\s*{ANYTHING}\s*", line.strip())
        # The widths of a table's columns depend on their contents.
        pattern = ".*".join(r"\s+".join(map(re.escape, part.split())) for part in parts)
        if not any(re.fullmatch(pattern, seen.strip()) for seen in lines):
            return line
    return None


def type_in(machine, command):
    """Runs a command as root in its home directory; returns the exit code and the output."""
    done = machine.try_to("sh", "-c", f"cd && export HOME=$PWD && {command}")
    return done.returncode, done.stdout


def show(machine, command, output):
    # Progress that apt rewrites in one line.
    output = re.sub(r"(?m)^\(Reading database \.\.\. (\d+%)?\n", "", output)
    print(f"{machine.name}# {command}\n{output}", end="" if output.endswith("\n") or not output else "\n", flush=True)


def once(machine, step):
    whole = ""
    for command in step.commands:
        code, output = type_in(machine, command)
        show(machine, command, output)
        whole += output
        assert (code != 0) == (step.kind == "refused"), f"{machine.name}: `{command}` ended with {code}"
    line = missing(step.printed, whole)
    assert not line, f"{machine.name}: `{line}` was not printed by `{step.commands[-1]}`"


def again(machine, step):
    done = []

    def as_printed():
        done[:] = [(command, *type_in(machine, command)) for command in step.commands]
        return all(code == 0 for _, code, _ in done) and not missing(step.printed, "".join(output for *_, output in done))
    try:
        until(f"{machine.name}: `{step.commands[-1]}` prints what is documented", as_printed)
    finally:
        for command, _, output in done:
            show(machine, command, output)


def follow(step, machines):
    """Runs a step on its computers."""
    for machine in step.computers(machines):
        (again if step.kind == "look" else once)(machine, step)
