"""Repeats a structure's model in OpenSees, an outside finite-element program.

    pip install -r requirements.txt
    cargo run --release -p truss --example export -- configs/tower.toml > tower_export.json
    cargo run --release -p truss --example export -- configs/tower.toml module2 > module2_export.json
    python fe_reference.py tower_export.json > tower.json

Only geometry, sections, masses, supports, actuators and gages are taken from the export; its own
results are not read. Nothing is condensed here: rotations stay in the eigenvalue problem, without
mass. The output is what the tests of the crate `truss` compare with.
"""

import json
import math
import sys

import openseespy.opensees as ops

DIRECTIONS = ["x", "y", "z", "rx", "ry", "rz"]
FREQUENCIES = 12


def build(export):
    """Builds the model; returns the tag of each node and member by name."""
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    nodes = {node["name"]: tag for tag, node in enumerate(export["nodes"], 1)}
    members = {member["name"]: tag for tag, member in enumerate(export["members"], 1)}
    for node in export["nodes"]:
        ops.node(nodes[node["name"]], *node["position_m"])
    fix(export, nodes)
    for node, mass in zip(export["nodes"], export["nodal_masses_kg"]):
        ops.mass(nodes[node["name"]], mass, mass, mass, 0.0, 0.0, 0.0)
    for member in export["members"]:
        add_member(member, members[member["name"]], [nodes[end] for end in member["ends"]])
    return nodes, members


def fix(export, nodes):
    """Supports; and rotations where no beam ends, which are no degrees of freedom."""
    turning = {end for m in export["members"] if m["kind"] == "beam" for end in m["ends"]}
    held = {fixed["node"]: set(fixed["directions"]) for fixed in export["fixed"]}
    for name, tag in nodes.items():
        directions = set(held.get(name, ()))
        if name not in turning:
            directions |= {"rx", "ry", "rz"}
        if directions:
            ops.fix(tag, *[int(d in directions) for d in DIRECTIONS])


def add_member(member, tag, ends):
    if member["kind"] == "rod":
        ops.uniaxialMaterial("Elastic", tag, member["e_pa"])
        # Damped as beams are, if there is damping.
        ops.element("Truss", tag, *ends, member["area_m2"], tag, "-doRayleigh", 1)
        return
    # OpenSees takes a vector in the plane of local x and z.
    ops.geomTransf("Linear", tag, *member["local_z"])
    ops.element(
        "elasticBeamColumn", tag, *ends, member["area_m2"], member["e_pa"], member["g_pa"],
        member["j_m4"], member["iy_m4"], member["iz_m4"], tag,
    )


def elongation(member, tag, length):
    """Elongation from the axial force that OpenSees finds in the member."""
    response = "axialForce" if member["kind"] == "rod" else "basicForce"
    force = ops.eleResponse(tag, response)[0]
    return force * length / (member["e_pa"] * member["area_m2"])


def static_response(export, actuator):
    """Readings of all gages under one newton that pushes the actuator's ends apart."""
    nodes, members = build(export)
    positions = {node["name"]: node["position_m"] for node in export["nodes"]}
    start, end = (positions[name] for name in actuator["ends"])
    length = math.dist(start, end)
    axis = [(b - a) / length for a, b in zip(start, end)]
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for name, sign in zip(actuator["ends"], (-1.0, 1.0)):
        ops.load(nodes[name], *[sign * a for a in axis], 0.0, 0.0, 0.0)
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system("FullGeneral")
    ops.algorithm("Linear")
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    if ops.analyze(1) != 0:
        sys.exit(f"static analysis of {actuator['path']} failed")
    by_name = {member["name"]: member for member in export["members"]}
    readings = []
    for gage in export["gages"]:
        member = by_name[gage["member"]]
        span = math.dist(*(positions[name] for name in member["ends"]))
        readings.append(elongation(member, members[member["name"]], span))
    return readings


def frequencies(export):
    build(export)
    free = 3 * len(export["nodes"]) - sum(
        len({"x", "y", "z"} & set(fixed["directions"])) for fixed in export["fixed"]
    )
    eigenvalues = ops.eigen("-genBandArpack", min(FREQUENCIES, free // 2))
    return [math.sqrt(value) / (2.0 * math.pi) for value in eigenvalues]


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        export = json.load(file)
    reference = {
        "source": f"OpenSees {ops.version()} by fe_reference.py",
        "name": export["name"],
        "modules": sorted({member["module"] for member in export["members"]}),
        "natural_frequencies_hz": frequencies(export),
        "gages": [gage["path"] for gage in export["gages"]],
        "static_responses": [
            {
                "actuator": actuator["path"],
                "static_elongations_m_per_n": static_response(export, actuator),
            }
            for actuator in export["actuators"]
        ],
    }
    json.dump(reference, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
