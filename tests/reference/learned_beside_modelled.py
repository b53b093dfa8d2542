"""A learned module of the shipped tower beside the modelled diagnosers, on the same simulated faults.

    python tests/reference/learned_beside_modelled.py DIRECTORY [--program trusswatch] [--faults 300] [--seed 1]

The learned module knows fault-free recordings only: the chamber pressures of all cylinders are its inputs, the elongations
of all gages its sensors. The modelled diagnosers have the exact structural model, and no reference. Prints the tables of
`crates/study/LEARNED.md`. Needs nothing but Python and some ten gigabytes in DIRECTORY.
"""

import argparse
import collections
import csv
import json
import math
import pathlib
import subprocess

LEARN, JUDGE, SECONDS, RATE, WINDOW_S = 40, 40, 60, 1000, 0.5
GOOD = {"normal", "unknown", "not_judged"}


def call(program, *words):
    print("+", program, *words[:4], "…", flush=True)
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stderr)
    return done.stdout


def component(column):
    return column.rsplit("/", 1)[0]


def learned_verdicts(program, module, table):
    """Who was named, who may be, and whether nothing could be told, with the rows from which on."""
    done = subprocess.run(
        [program, "detect", str(table), "--rate", str(RATE), "--config", str(module), "--json"],
        capture_output=True, text=True,
    )
    if done.returncode not in (0, 5, 6):
        raise SystemExit(f"{table}: {done.stderr}")
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    return [line["verdict"] for line in lines if "verdict" in line]


def interval(count, of):
    """95 %, Wilson's."""
    if of == 0:
        return "-"
    z, p = 1.96, count / of
    middle, spread = p + z * z / 2 / of, z * math.sqrt(p * (1 - p) / of + z * z / 4 / of / of)
    low, high = ((middle - spread) / (1 + z * z / of), (middle + spread) / (1 + z * z / of))
    return f"{100 * p:.0f} ({100 * low:.0f}-{100 * high:.0f})"


def size(parameters):
    """The one figure of a fault, if it has one."""
    values = [abs(float(text.split("=")[1])) for text in parameters.split()]
    return values[0] if len(values) == 1 else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", type=pathlib.Path)
    parser.add_argument("--program", default="trusswatch")
    parser.add_argument("--faults", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    directory, program = given.directory, given.program
    directory.mkdir(parents=True, exist_ok=True)
    of = ["--seed", given.seed, "--scenarios", given.faults, "--nominal", LEARN + JUDGE, "--nominal-seconds", SECONDS,
          "--weather", "alike"]
    call(program, "study", "export", directory / "tables", "--readings", *of)
    call(program, "study", "run", "--out", directory / "run", *of)
    tables = directory / "tables"
    with open(tables / "nominal-00000.csv") as first:
        names = next(csv.reader(first))
    inputs = [name for name in names if "/pressure_" in name]
    sensors = [name for name in names if name.endswith("/elongation_m")]
    module = directory / "learned.toml"
    nominal = [tables / f"nominal-{number:05}.csv" for number in range(LEARN + JUDGE)]
    print(call(program, "learn", "--rate", RATE, "--window", WINDOW_S, "--inputs", ",".join(inputs),
               "--sensors", ",".join(sensors), "--out", module, *nominal[:LEARN]))

    modelled = {}
    with open(directory / "run" / "cases.jsonl") as lines:
        for line in map(json.loads, lines):
            if "case" in line:
                modelled[line["case"]] = line["row"]["diagnosed"]
    false_alarms = {
        "modelled": sum(len(modelled[given.faults + number]) for number in range(LEARN, LEARN + JUDGE)),
        "learned": sum(
            verdict["state"] not in GOOD
            for table in nominal[LEARN:]
            for verdict in learned_verdicts(program, module, table)
        ),
    }

    outcomes = collections.defaultdict(collections.Counter)
    sizes = collections.defaultdict(list)
    with open(tables / "truth.csv") as file:
        for row in csv.DictReader(file):
            if not row["component"]:
                continue
            case, onset = int(row["number"]), int(row["onset"])
            group = row["kind"]
            named = {
                "modelled": {one["component"]: one["decided"] for one in modelled[case]},
                "learned": {},
            }
            cannot_tell = None
            for verdict in learned_verdicts(program, module, tables / row["file"]):
                if verdict["last_index"] < onset:
                    continue
                if verdict["component"] is None:
                    cannot_tell = verdict["first_index"]
                elif verdict["state"] not in GOOD:
                    named["learned"].setdefault(component(verdict["component"]), verdict["last_index"])
            for who, components in named.items():
                others = set(components) - {row["component"]}
                found = row["component"] in components
                if found and not others:
                    outcome = "right"
                elif others:
                    outcome = "another"
                elif who == "learned" and cannot_tell is not None:
                    outcome = "unknown"
                else:
                    outcome = "missed"
                outcomes[group, who][outcome] += 1
                if size(row["parameters"]) is not None:
                    sizes[group, who].append((size(row["parameters"]), outcome))

    hours = JUDGE * SECONDS / 3600
    print(f"\nfalse alarms in {hours:.2f} h: {false_alarms}\n")
    print("| fault | cases | modelled: right % (95 %) | another named | not found | learned: right % (95 %) | another named "
          "| unknown | not found | smallest right, modelled / learned | largest not found, modelled / learned |")
    print("|" + "---|" * 11)
    for group in sorted({group for group, _ in outcomes}):
        a, b = outcomes[group, "modelled"], outcomes[group, "learned"]
        count = a.total()

        def extreme(who, outcome, pick):
            found = [size for size, known in sizes[group, who] if known == outcome]
            return f"{pick(found):.2g}" if found else "-"

        smallest, largest = (
            " / ".join(extreme(who, outcome, pick) for who in ("modelled", "learned"))
            for outcome, pick in (("right", min), ("missed", max))
        )
        print(f"| {group.replace('_', ' ')} | {count} | {interval(a['right'], count)} | {a['another']} | {a['missed']} "
              f"| {interval(b['right'], count)} | {b['another']} | {b['unknown']} | {b['missed']} | {smallest} | {largest} |")


if __name__ == "__main__":
    main()
