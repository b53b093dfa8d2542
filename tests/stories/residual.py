"""The residual of one gage, recomputed from a recording and the exported model with numpy and the library mcap.

No code of trusswatch runs. From the export only geometry, sections, masses, supports, damping, actuators and gages are
read. The residual of a gage is its elongation y minus that of the module's local model (eq. 14 of the paper):

    r_k = y_k - l^T u_k,    M u'' + D u' + K u = F f,    D = alpha M + beta K,

with f the observed forces, f = p_A A_A - p_B A_B, whose mean over each step acts during it; the first sample of a
run settles the model, u = K^-1 F f. K is condensed to the translations, because rotations have no mass. In modes
phi_j of K phi = w^2 M phi each step is exact: with x = zeta w dt and th^2 = (w dt)^2 - x^2,
S = e^-x sin th / th, C = e^-x cos th,

    q <- (C + x S) q + dt S v + (1 - C - x S) / w^2 p,    v <- -w^2 dt S q + (C - x S) v + dt S p.
"""

import json

import numpy as np
from mcap.reader import make_reader

# After a longer gap the model is settled again [s].
LONGEST_GAP_S = 0.2
DIRECTIONS = ["x", "y", "z", "rx", "ry", "rz"]


def stiffness_of(member, start, end):
    """12 x 12 stiffness in global coordinates: translations and rotations of both ends."""
    length = np.linalg.norm(end - start)
    axis = (end - start) / length
    axial = member["e_pa"] * member["area_m2"] / length
    if member["kind"] == "rod":
        whole = np.zeros((12, 12))
        block = axial * np.outer(axis, axis)
        whole[0:3, 0:3] = whole[6:9, 6:9] = block
        whole[0:3, 6:9] = whole[6:9, 0:3] = -block
        return whole
    local = np.zeros((12, 12))
    torsion = member["g_pa"] * member["j_m4"] / length
    for first, stiffness in ((0, axial), (3, torsion)):
        local[first, first] = local[first + 6, first + 6] = stiffness
        local[first, first + 6] = local[first + 6, first] = -stiffness
    # About local z the beam moves along y; about local y along z, with the other sign of the rotation.
    for inertia, move, turn, sign in ((member["iz_m4"], 1, 5, 1.0), (member["iy_m4"], 2, 4, -1.0)):
        bending = member["e_pa"] * inertia / length**3
        places = [move, turn, move + 6, turn + 6]
        half = sign * length
        pattern = bending * np.array([
            [12.0, 6 * half, -12.0, 6 * half],
            [6 * half, 4 * length**2, -6 * half, 2 * length**2],
            [-12.0, -6 * half, 12.0, -6 * half],
            [6 * half, 2 * length**2, -6 * half, 4 * length**2],
        ])
        local[np.ix_(places, places)] += pattern
    turned = np.array([axis, member["local_y"], member["local_z"]])
    rotation = np.kron(np.eye(4), turned)
    return rotation.T @ local @ rotation


class Model:
    """The local model of a module in modes."""

    def __init__(self, export, gage, step_s):
        names = [node["name"] for node in export["nodes"]]
        place = {name: index for index, name in enumerate(names)}
        position = {node["name"]: np.array(node["position_m"]) for node in export["nodes"]}
        size = 6 * len(names)
        stiffness = np.zeros((size, size))
        for member in export["members"]:
            first, second = member["ends"]
            freedoms = [6 * place[end] + d for end in (first, second) for d in range(6)]
            stiffness[np.ix_(freedoms, freedoms)] += stiffness_of(
                member, position[first], position[second]
            )
        turning = {end for m in export["members"] if m["kind"] == "beam" for end in m["ends"]}
        held = {6 * place[f["node"]] + DIRECTIONS.index(d)
                for f in export["fixed"] for d in f["directions"]}
        moves = [6 * place[n] + d for n in names for d in range(3)]
        turns = [6 * place[n] + d for n in names if n in turning for d in range(3, 6)]
        moves = [freedom for freedom in moves if freedom not in held]
        turns = [freedom for freedom in turns if freedom not in held]
        mass = np.array([export["nodal_masses_kg"][freedom // 6] for freedom in moves])
        condensed = stiffness[np.ix_(moves, moves)]
        if turns:
            across = stiffness[np.ix_(moves, turns)]
            condensed = condensed - across @ np.linalg.solve(
                stiffness[np.ix_(turns, turns)], across.T
            )
        scale = 1.0 / np.sqrt(mass)
        squares, vectors = np.linalg.eigh(scale[:, None] * condensed * scale)
        shapes = scale[:, None] * vectors

        def apart(ends):
            axis = position[ends[1]] - position[ends[0]]
            whole = np.zeros(size)
            for end, sign in zip(ends, (-1.0, 1.0)):
                whole[6 * place[end]:6 * place[end] + 3] = sign * axis / np.linalg.norm(axis)
            return whole[moves]

        self.inputs = shapes.T @ np.array([apart(a["ends"]) for a in export["actuators"]]).T
        member = next(g["member"] for g in export["gages"] if g["path"] == gage)
        ends = next(m["ends"] for m in export["members"] if m["name"] == member)
        self.output = shapes.T @ apart(ends)
        self.squares = squares
        self.over(step_s, export["alpha_per_s"], export["beta_s"])

    def over(self, step_s, alpha, beta):
        """The coefficients of a step."""
        turn = np.sqrt(self.squares) * step_s
        decay = 0.5 * (alpha + beta * self.squares) * step_s
        angle = np.sqrt((turn**2 - decay**2).astype(complex))
        slow, fast = np.exp(1j * angle - decay), np.exp(-1j * angle - decay)
        cosine = (0.5 * (slow + fast)).real
        sine = (0.5 * (slow - fast) / (1j * angle)).real
        # 1 - C - x S without cancellation for short steps.
        short = turn < 1.0
        few = np.where(short, angle, 0.1)
        careful = -np.expm1(-decay) + np.exp(-decay) * (
            2.0 * np.sin(0.5 * few) ** 2 - decay * np.sin(few) / few
        ).real
        rise = np.where(short, careful, 1.0 - cosine - decay * sine)
        self.keep = (cosine + decay * sine, cosine - decay * sine)
        self.cross = (step_s * sine, -self.squares * step_s * sine)
        self.force = (rise / self.squares, step_s * sine)

    def settle(self, forces):
        self.moved = self.inputs @ forces / self.squares
        self.speed = np.zeros_like(self.moved)

    def step(self, forces):
        pushed = self.inputs @ forces
        moved = self.keep[0] * self.moved + self.cross[0] * self.speed + self.force[0] * pushed
        self.speed = self.cross[1] * self.moved + self.keep[1] * self.speed + self.force[1] * pushed
        self.moved = moved

    def elongation(self):
        return self.output @ self.moved


def read(file, module):
    """Samples and recorded residuals by run and step, the setup, starts of runs, and losses."""
    samples, messages, setup, begins, lost = {}, [], None, set(), set()
    with open(file, "rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            parts = channel.topic.split("/")
            if parts[2:3] != [module]:
                continue
            topic = "/".join(parts[3:])
            if topic not in ("sample", "divergence", "configuration", "input"):
                continue
            data = json.loads(message.data)
            if topic == "sample":
                samples[data["run"], data["step"]] = data
            elif topic == "divergence":
                messages.append(data)
            elif topic == "configuration":
                setup = data["setup"]
            elif topic == "input" and data["taken"]["input"] == "run_began":
                begins.add((data["taken"]["run"], data["taken"]["step"]))
            elif topic == "input" and data["taken"]["input"] == "gap":
                first = data["taken"]["from"]
                lost.update((data["run"], first + i) for i in range(data["taken"]["missing"]))
    return samples, messages, setup, begins, lost


def residuals(file, export, gage):
    """Recorded and computed residuals."""
    module, _, name = gage.split("/")
    samples, messages, setup, begins, lost = read(file, module)
    step_s, hydraulics = setup["step_s"], setup["hydraulics"]
    areas = np.array([hydraulics["area_a_m2"], -hydraulics["area_b_m2"]])
    model = Model(export, gage, step_s)
    place = [g["path"] for g in export["gages"]].index(gage)
    computed, last, before = {}, None, None
    for at in sorted(samples):
        if at in lost:
            continue
        if last is None and begins and at not in begins:
            continue
        sample = samples[at]
        forces = np.array(sample["pressures_pa"]) @ areas
        steps = at[1] - last[1] if last and last[0] == at[0] else None
        if at in begins or steps is None or (steps - 1) * step_s > LONGEST_GAP_S + 0.5 * step_s:
            model.settle(forces)
        else:
            for number in range(steps):
                model.step(before + (number + 0.5) / steps * (forces - before))
        computed[at] = sample["elongations_m"][place] - model.elongation()
        last, before = at, forces
    pairs = [
        (channel["residual"], computed[message["run"], message["step"]])
        for message in messages
        for channel in message["channels"]
        if channel["component"] == f"sensor/{name}" and (message["run"], message["step"]) in computed
    ]
    assert pairs, f"{file} has no residual of {gage}"
    return np.array(pairs).T
