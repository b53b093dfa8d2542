#!/usr/bin/env python3
"""Processor time of a diagnoser of the shipped tower at 1 kHz in real time, of several builds in turns.

    cargo build --profile dist --locked
    tests/reference/processor_time.py 45dc66c=../former .

Each build is a checkout with its programs in `target/dist` (`CHECKOUT:PROGRAMS` if they are elsewhere); `NAME=` is what
it is called in the table. One after the other, round by round, each runs its own configurations for some seconds without
a fault, in the environment of its units; the least of all rounds counts, since other load only adds. Ratios are to the first build, of the same form.
"""

import argparse
import contextlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

# What becomes of the plant's configuration; a build without blocks sends them as bursts.
FORMS = {
    "singles": {"burst_steps": 1},
    "bursts of 4": {"burst_steps": 4},
    "bursts of 10": {"burst_steps": 10},
    "blocks of 10": {"burst_steps": 10, "blocks": True},
    "blocks of 10, CBOR": {"burst_steps": 10, "blocks": True, "encoding": "cbor"},
}
MODULES = ("module1", "module2")
UNIT = "deploy/systemd/trusswatch-diagnoser@.service"
WARM_UP_S = 6


class Build:
    def __init__(self, argument):
        name, _, place = argument.rpartition("=")
        checkout, _, programs = place.partition(":")
        self.checkout = pathlib.Path(checkout).resolve()
        self.programs = pathlib.Path(
            programs or self.checkout / "target/dist"
        ).resolve()
        self.name = name or self.checkout.name
        if not (self.programs / "trusswatch-plant").exists():
            raise argparse.ArgumentTypeError(
                f"{self.programs}: no trusswatch-plant; run `cargo build --profile dist --locked` there first"
            )
        unit = (self.checkout / UNIT).read_text()
        self.environment = dict(re.findall(r'(?m)^Environment="(\w+)=(.*)"$', unit))
        self.environment["RUST_LOG"] = "warn"


def configure(folder, build, form):
    """A copy of the configurations, with the form of samples."""
    configs = folder / "configs"
    shutil.copytree(build.checkout / "configs", configs)
    plant = configs / "plant.toml"
    text = plant.read_text()
    known = "blocks" in text
    for key, value in FORMS[form].items():
        if key in text and (known or key == "burst_steps"):
            text = re.sub(
                rf"(?m)^(# )?{key} = .*$", f"{key} = {json.dumps(value)}", text
            )
    plant.write_text(text)
    return configs


def spent(pid):
    """Processor time [s] and context switches of all threads."""
    ticks = os.sysconf("SC_CLK_TCK")
    words = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    switches = 0
    for thread in pathlib.Path(f"/proc/{pid}/task").iterdir():
        with contextlib.suppress(FileNotFoundError):
            lines = (thread / "status").read_text()
            switches += sum(map(int, re.findall(r"ctxt_switches:\s+(\d+)", lines)))
    return (int(words[11]) + int(words[12])) / ticks, switches


def memory_mib(pid):
    rollup = pathlib.Path(f"/proc/{pid}/smaps_rollup").read_text()
    return sum(int(kib) for kib in re.findall(r"(?m)^Pss:\s+(\d+)", rollup)) / 1024


def measure(build, form, seconds):
    """Mean over the diagnosers: share of a core [%], switches a second, memory [MiB]."""
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        configs = configure(pathlib.Path(folder), build, form)

        def start(program, config):
            log = (pathlib.Path(folder) / f"{config}.log").open("w")
            stack.enter_context(log)
            process = subprocess.Popen(
                [build.programs / program, "run", configs / f"{config}.toml"],
                env=os.environ | build.environment,
                stdout=log,
                stderr=log,
            )
            stack.callback(process.wait)
            stack.callback(process.terminate)
            return process

        diagnosers = [start("trusswatch-diagnoser", module) for module in MODULES]
        plant = start("trusswatch-plant", "plant")
        time.sleep(WARM_UP_S)
        begun = time.monotonic()
        before = [spent(process.pid) for process in diagnosers]
        time.sleep(seconds)
        after = [spent(process.pid) for process in diagnosers]
        elapsed = time.monotonic() - begun
        for process in [*diagnosers, plant]:
            if process.poll() is not None:
                logs = [path.read_text() for path in pathlib.Path(folder).glob("*.log")]
                sys.exit(f"{build.name}, {form}: a process ended\n" + "\n".join(logs))
        count = len(diagnosers)
        times = sum(
            late[0] - early[0] for early, late in zip(before, after, strict=True)
        )
        switches = sum(
            late[1] - early[1] for early, late in zip(before, after, strict=True)
        )
        memory = sum(memory_mib(process.pid) for process in diagnosers) / count
        return 100 * times / elapsed / count, switches / elapsed / count, memory


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument(
        "builds", nargs="+", type=Build, metavar="[NAME=]CHECKOUT[:PROGRAMS]"
    )
    parser.add_argument("--forms", default=";".join(FORMS), help="some of: %(default)s")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    forms = arguments.forms.split(";")
    unknown = [form for form in forms if form not in FORMS]
    if unknown:
        parser.error(
            f"--forms: no `{'; '.join(unknown)}`; use some of: {';'.join(FORMS)}"
        )
    least = {}
    for number in range(arguments.rounds):
        for form in forms:
            for build in arguments.builds:
                figures = measure(build, form, arguments.seconds)
                print(
                    f"round {number + 1} of {arguments.rounds}: {build.name}, {form}: {figures[0]:.2f} %",
                    file=sys.stderr,
                )
                key = (form, build.name)
                least[key] = min(least.get(key, figures), figures)
    rows = []
    for form in forms:
        first = least[form, arguments.builds[0].name][0]
        for build in arguments.builds:
            percent, switches, memory = least[form, build.name]
            rows.append(
                {
                    "samples": form,
                    "build": build.name,
                    "percent_of_a_core": round(percent, 2),
                    "ratio": round(percent / first, 2),
                    "switches_per_s": round(switches),
                    "mib": round(memory, 1),
                }
            )
    if arguments.json:
        print(json.dumps({"v": 1, "rows": rows}))
        return
    print(
        "| samples | build | % of a core | ratio | switches a second | MiB |\n|---|---|---|---|---|---|"
    )
    for row in rows:
        print("| " + " | ".join(map(str, row.values())) + " |")


if __name__ == "__main__":
    main()
