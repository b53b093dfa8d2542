"""A plant whose structure is OpenSees': the shipped diagnosers beside one and the same wind, forces, gages and faults.

    pip install -r requirements.txt ../../crates/python
    python opensees_plant.py [--scenarios 70] [--nominal 10] [--seed 42001] [--json]

OpenSees integrates the tower in time (Newmark, average acceleration) under the forces of the plant's hydraulics and wind,
step by step; controller, gages and pressure sensors of the plant measure what it answers. Nothing of the plant's own
structure is left in the loop. Each scenario runs twice, with OpenSees and with the plant's own structure, which is
integrated exactly in modes.
"""

import argparse
import json
import math
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import numpy as np
import openseespy.opensees as ops
from fe_reference import build, elongation
from scipy.stats import beta

ROOT = Path(__file__).resolve().parents[2]
TOWER = ROOT / "configs/tower.toml"
PLANT = ROOT / "configs/plant.toml"
MODULES = [ROOT / f"configs/module{number}.toml" for number in (1, 2)]
STEPS = 14_000


class Structure:
    """The tower in OpenSees, with live loads and Rayleigh damping, at rest under the loads of the start."""

    def __init__(self, export, damping, plant):
        heights = {node["name"]: round(node["position_m"][2], 6) for node in export["nodes"]}
        held = {fixed["node"]: set(fixed["directions"]) for fixed in export["fixed"]}
        free = {name for name in heights if not {"x", "y", "z"} <= held.get(name, set())}
        levels = [[name for name in heights if heights[name] == height] for height in sorted({heights[name] for name in free})]
        masses = list(export["nodal_masses_kg"])
        places = {node["name"]: place for place, node in enumerate(export["nodes"])}
        for level, live_load in zip(levels, plant.live_loads_kg, strict=True):
            for name in level:
                masses[places[name]] += live_load / len(level)
        nodes, members = build(export | {"nodal_masses_kg": masses})
        self.tags = [nodes[node["name"]] for node in export["nodes"]]
        positions = {node["name"]: node["position_m"] for node in export["nodes"]}
        # Nodal forces per force of an actuator, and per force on a level in x and y.
        columns = []
        for actuator in export["actuators"]:
            start, end = (np.array(positions[name]) for name in actuator["ends"])
            axis = (end - start) / np.linalg.norm(end - start)
            column = np.zeros((len(places), 3))
            for name, sign in zip(actuator["ends"], (-1.0, 1.0)):
                column[places[name]] += sign * axis
            columns.append(column)
        for level in levels:
            for direction in range(2):
                column = np.zeros((len(places), 3))
                column[[places[name] for name in level], direction] = 1.0 / len(level)
                columns.append(column)
        self.forces = np.array(columns)
        by_name = {member["name"]: member for member in export["members"]}
        self.gages = []
        for gage in export["gages"]:
            member = by_name[gage["member"]]
            span = math.dist(*(positions[name] for name in member["ends"]))
            self.gages.append((member, members[member["name"]], span))
        ops.rayleigh(damping["alpha_per_s"], damping["beta_s"], 0.0, 0.0)
        ops.timeSeries("Constant", 1)
        self.load(plant, first=True)
        self.analysis("Static", "LoadControl", 1.0)
        assert ops.analyze(1) == 0
        ops.wipeAnalysis()
        ops.setTime(0.0)
        # Average acceleration.
        self.analysis("Transient", "Newmark", 0.5, 0.25)

    def analysis(self, kind, *integrator):
        ops.constraints("Plain")
        ops.numberer("RCM")
        ops.system("BandGeneral")
        ops.algorithm("Linear", *(["-factorOnce"] if kind == "Transient" else []))
        ops.integrator(*integrator)
        ops.analysis(kind)

    def load(self, plant, first=False):
        actuators, levels = plant.loads()
        nodal = np.tensordot(np.concatenate([actuators, levels.ravel()]), self.forces, 1)
        if not first:
            ops.remove("loadPattern", 1)
        ops.pattern("Plain", 1, 1)
        for tag, force in zip(self.tags, nodal.tolist()):
            if any(force):
                ops.load(tag, *force, 0.0, 0.0, 0.0)

    def step(self, step_s):
        assert ops.analyze(1, step_s) == 0

    def elongations(self):
        return np.array([elongation(*gage) for gage in self.gages])


def joined(blocks):
    """Samples of single steps as one block."""
    first = blocks[0]
    return {module: {signal: np.concatenate([block[module][signal] for block in blocks]) for signal in first[module]} for module in first}


def run(tw, export, damping, modules, seed, fault, steps, coupled):
    """Runs the diagnosers on a plant; returns the states in the end and the samples."""
    plant = tw.Plant(PLANT, seed=seed)
    group = tw.Diagnosers(modules)
    structure = Structure(export, damping, plant) if coupled else None
    at = fault["at"] if fault else steps
    blocks = []
    for step in range(steps):
        if step == at:
            plant.inject(fault["component"], fault["fault"])
        if not coupled:
            # As many steps at once as have the same faults.
            until = at if step < at else steps
            if step in (0, at):
                blocks.append(plant.advance(until - step))
            continue
        plant.respond(structure.elongations())
        blocks.append(plant.advance(1))
        structure.load(plant)
        structure.step(plant.step_s)
    samples = joined(blocks)
    verdicts = group.push(samples).verdicts
    return group.states, verdicts, samples


def outcome(states, component):
    """What was made of a fault in this component."""
    named = {path for path, state in states.items() if state == "latched"}
    if named - {component}:
        return "wrong"
    return "exact" if component in named else "missed"


def interval(count, of):
    """Clopper and Pearson's interval of 95 %."""
    low = beta.ppf(0.025, count, of - count + 1) if count else 0.0
    high = beta.ppf(0.975, count + 1, of - count) if count < of else 1.0
    return [float(low), float(high)]


def compare(tw, program, scenarios, nominal, seed, progress):
    export = json.loads(subprocess.run([program, "model", TOWER, "--json"], capture_output=True, check=True, text=True).stdout)
    damping = tomllib.loads(TOWER.read_text())["damping"]
    modules = [tw.Module(module) for module in MODULES]
    study = tw.Study(PLANT, modules, seed=seed)
    counts = {plant: {"exact": 0, "wrong": 0, "missed": 0, "false_alarms": 0} for plant in ("opensees", "own")}
    rows, largest, begun = [], 0.0, time.monotonic()
    for number in range(scenarios + nominal):
        case = study.scenario(number) if number < scenarios else study.nominal(number - scenarios)
        fault, row = case.fault, {"number": number, "fault": case.fault}
        readings = {}
        for plant in counts:
            states, verdicts, samples = run(tw, export, damping, modules, case.seed, fault, STEPS, plant == "opensees")
            readings[plant] = np.concatenate([samples[module]["elongations_m"] for module in samples], axis=1)
            if fault:
                row[plant] = outcome(states, fault["component"])
                counts[plant][row[plant]] += 1
            else:
                row[plant] = [verdict["component"] for verdict in verdicts if verdict["state"] == "latched"]
                counts[plant]["false_alarms"] += len(row[plant])
        if not fault:
            largest = max(largest, float(np.nanmax(np.abs(readings["opensees"] - readings["own"]))))
        rows.append(row)
        if progress:
            print(f"{number + 1} of {scenarios + nominal}, {time.monotonic() - begun:.0f} s: {json.dumps(row)}", file=sys.stderr)
    for plant in counts:
        counts[plant]["exact_share"] = interval(counts[plant]["exact"], scenarios) if scenarios else None
    return {"v": 1, "opensees": ops.version(), "scenarios": scenarios, "nominal": nominal, "largest_difference_m": largest,
            "plants": counts, "rows": rows}


def table(found):
    lines = ["| structure | exact | wrong | missed | share exact (95 %) | false alarms |", "|---|---|---|---|---|---|"]
    for plant, of in found["plants"].items():
        low, high = of["exact_share"] or (0.0, 1.0)
        lines.append(f"| {plant} | {of['exact']} of {found['scenarios']} | {of['wrong']} | {of['missed']} | {low:.1%} to {high:.1%} | "
                     f"{of['false_alarms']} in {found['nominal']} runs |")
    lines.append(f"\nReadings without a fault differ by at most {found['largest_difference_m'] * 1e6:.2f} µm.")
    return "\n".join(lines)


def main():
    import trusswatch

    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scenarios", type=int, default=70)
    parser.add_argument("--nominal", type=int, default=10)
    parser.add_argument("--seed", type=int, default=42001)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    found = compare(trusswatch, ROOT / "target/release/trusswatch", given.scenarios, given.nominal, given.seed, True)
    print(json.dumps(found, indent=1) if given.json else table(found))


if __name__ == "__main__":
    main()
