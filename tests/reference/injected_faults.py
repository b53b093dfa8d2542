"""Faults injected into recordings of real machines that no detector was taught with: `trusswatch learn` and `detect`
beside other detectors at equal false alarms. Prints the tables of crates/study/LEARNED.md. Needs NumPy.

    python tests/reference/injected_faults.py turbines openoa-3.2-py3-none-any.whl
    python tests/reference/injected_faults.py damper Dataset-Friction-Damper-with-Backlash

The first data set comes with `pip download openoa==3.2 --no-deps` (see crates/cli/walkthrough), the second with a clone of
github.com/ARTS-Laboratory/Dataset-Friction-Damper-with-Backlash.

Each split of the recordings has three parts: those that teach, healthy ones on which false alarms are counted, and those
that get faults. Every detector takes the same windows. The thresholds of the others are set to as many false alarms as
trusswatch has on the second part. A fault is found if an alarm comes while it lasts that does not come without it; right if that alarm names its channel.
"""

import argparse
import importlib.util
import json
import math
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("TRUSSWATCH_PROGRAMS", ROOT / "target/release")) / "trusswatch"
# Windows for which an injected fault lasts, those before it that are judged too, and alarms closer than this are one.
LASTS, BEFORE, APART = 300, 60, 30
# Sizes as a share of the channel's range; a drift reaches it at its end, a gain is lower by it.
FAULTS = [("jump", 0.02), ("jump", 0.05), ("jump", 0.1), ("jump", 0.2), ("jump", 0.5), ("drift", 0.1), ("drift", 0.2),
          ("drift", 0.5), ("gain", 0.1), ("gain", 0.2), ("gain", 0.5)]


@dataclass
class DataSet:
    """Recordings in windows: arrays of the shape (windows, channels), sensors first."""

    channels: list
    sensors: int
    window_s: float
    splits: list
    faulty: dict


def turbines(package):
    """The weeks of two years at La Haute Borne. Every sixth week of 2014 teaches; of 2015 the even ones count false alarms."""
    source = importlib.util.spec_from_file_location("prepare", ROOT / "crates/cli/walkthrough/prepare.py")
    prepare = importlib.util.module_from_spec(source)
    source.loader.exec_module(prepare)
    readings = prepare.measured(package)
    sensors = ["wind721", "wind736", "wind790", "temp721", "temp736", "temp790"]
    channels = [*sensors, "wind711", "temp711"]
    first, rows = min(readings), 7 * 24 * 6
    weeks = [np.full((rows, len(channels)), np.nan) for _ in range(104)]
    for instant, values in readings.items():
        week, row = divmod((instant - first) // prepare.STEP_S, rows)
        if week < len(weeks):
            weeks[week][row] = [math.nan if values.get(name, "") == "" else values[name] for name in channels]
    teach = {f"week{k}": weeks[k] for k in range(3, 52, 6)}
    count = {f"week{k}": weeks[k] for k in range(52, 104, 2)}
    judge = {f"week{k}": weeks[k] for k in range(53, 104, 2)}
    # 4 to 11 June 2014, when a thermometer failed.
    return DataSet(channels, len(sensors), prepare.STEP_S, [(teach, count, judge)], {"week22": weeks[22]})


def damper(clone):
    """Friction damper on a hydraulic actuator: 41 characterisation tests, in five of which its authors found the force of the
    band's actuators wrong. Six splits of the others.
    """
    channels, sensors, per_window = ["force", "band1", "band2", "displacement", "velocity"], 3, 51
    wrong = {"0.1", "0.25", "0.5", "1", "2"}
    healthy, faulty = {}, {}
    for file in sorted(Path(clone).glob("data/dataset-[23]/*/*Hz*.json")):
        try:
            rows = np.array(json.loads(file.read_text())["data"])
        except ValueError:
            # A file that was too large for the copy.
            continue
        windows = len(rows) // per_window
        medians = np.median(rows[: windows * per_window].reshape(windows, per_window, -1), axis=1)
        frequency, rest = file.stem.split("Hz")
        is_faulty = "dataset-2" in str(file) and (
            (rest == "0lbtension0.5amplitude" and frequency in wrong)
            or (rest == "0lbtension1amplitude" and frequency in {"0.1", "0.25"}))
        (faulty if is_faulty else healthy)[f"{file.parts[-3][-1]}-{file.stem}"] = medians[:, [2, 4, 5, 1, 3]]
    names = sorted(healthy)
    np.random.default_rng(1).shuffle(names)
    parts = [names[k::6] for k in range(6)]
    splits = []
    for k in range(6):
        judged, counted = parts[k], parts[(k + 1) % 6]
        taught = [name for name in names if name not in judged + counted]
        splits.append(tuple({name: healthy[name] for name in part} for part in (taught, counted, judged)))
    return DataSet(channels, sensors, per_window / 1024, splits, faulty)


def table(file, channels, samples, step_s):
    """A table of these samples, missing ones as empty cells."""
    lines = ["time_s," + ",".join(channels)]
    for k, row in enumerate(samples.tolist()):
        lines.append(f"{k * step_s:.9g}," + ",".join("" if math.isnan(x) else f"{x:.7g}" for x in row))
    file.write_text("\n".join(lines) + "\n")
    return file


def trusswatch(*words):
    done = subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"trusswatch {words[0]}: {done.stderr}")
    return done.stdout


def lines(*words):
    """What `detect --json` prints."""
    return [json.loads(line) for line in trusswatch(*words, "--json").splitlines()]


class Learned:
    """`trusswatch learn` and `detect`."""

    name = "trusswatch learn, detect"

    def __init__(self, data, taught, folder):
        self.data, self.folder, self.module = data, folder, folder / "module.toml"
        files = [table(folder / f"{name}.csv", data.channels, samples, data.window_s) for name, samples in taught.items()]
        names = ["--inputs", ",".join(data.channels[data.sensors:]), "--sensors", ",".join(data.channels[: data.sensors])]
        out = ["--out", self.module, "--window", data.window_s, "--json"]
        self.said = json.loads(trusswatch("learn", *files, *names, *out))

    def alarms(self, samples):
        """The window at which each begins, and its channel."""
        file = table(self.folder / "judged.csv", self.data.channels, samples, self.data.window_s)
        said = lines("detect", file, "--config", self.module)
        verdicts = [line["verdict"] for line in said if "verdict" in line]
        # Rows that are missing are no signal, rightly.
        named = [verdict for verdict in verdicts if verdict["state"] == "faulty"]
        # Two windows show a fault, the first of which is its onset.
        return sorted((verdict["first_index"] + 1, self.data.channels.index(verdict["component"])) for verdict in named)


class Scored:
    """Detectors with a score for each window and channel, and one threshold."""

    threshold = math.inf

    def alarms(self, samples):
        score = np.nan_to_num(self.score(samples), nan=0.0)
        return grouped(np.flatnonzero(score.max(axis=1) > self.threshold), score)

    def calibrate(self, healthy, allowed):
        """The lowest threshold with no more false alarms than allowed in these recordings."""
        scores = [np.nan_to_num(self.score(samples), nan=0.0) for samples in healthy]
        largest = [score.max(axis=1) for score in scores]

        def alarms(threshold):
            return sum(len(grouped(np.flatnonzero(one > threshold), score)) for one, score in zip(largest, scores))

        # From above, for below some threshold alarms merge and become fewer.
        for value in np.unique(np.concatenate(largest))[::-1]:
            if alarms(value) > allowed:
                break
            self.threshold = value


def grouped(places, score):
    """Alarms of windows close together are one, of the channel with the largest score at its begin."""
    found = []
    for place in places.tolist():
        if not found or place - found[-1][1] > APART:
            found.append([place, place, int(score[place].argmax())])
        found[-1][1] = place
    return [(first, channel) for first, _, channel in found]


def complete(taught):
    rows = np.concatenate(list(taught.values()))
    return rows[np.isfinite(rows).all(axis=1)]


def held(score):
    """The smaller score of two windows, one after the other."""
    return np.vstack([np.zeros(score.shape[1]), np.minimum(score[1:], score[:-1])])


class ZScore(Scored):
    name = "z-score of each channel"

    def __init__(self, data, taught, folder):
        rows = complete(taught)
        self.mean, self.deviation = rows.mean(axis=0), rows.std(axis=0)

    def score(self, samples):
        return held(abs(samples - self.mean) / self.deviation)


class Components(Scored):
    """T² and Q of the components that make 90 % of the variance, each in units of its 99 % quantile, with contributions."""

    name = "PCA T² + Q, contributions"

    def __init__(self, data, taught, folder):
        rows = complete(taught)
        self.mean, self.deviation = rows.mean(axis=0), rows.std(axis=0)
        values, vectors = np.linalg.eigh(np.corrcoef(rows.T))
        order = values.argsort()[::-1]
        self.values, self.vectors = values[order], vectors[:, order]
        self.kept = 1 + int(np.searchsorted(self.values.cumsum() / self.values.sum(), 0.9))
        self.limits = [np.quantile(part.sum(axis=1), 0.99) for part in self.contributions(rows)]

    def contributions(self, samples):
        scaled = (samples - self.mean) / self.deviation
        main, values = self.vectors[:, : self.kept], self.values[: self.kept]
        t2 = np.maximum(scaled * ((scaled @ main / values) @ main.T), 0.0)
        return t2, (scaled - scaled @ main @ main.T) ** 2

    def score(self, samples):
        parts = [part / limit for part, limit in zip(self.contributions(samples), self.limits)]
        sums = np.nan_to_num(np.array([part.sum(axis=1) for part in parts]))
        larger = np.where((sums[0] > sums[1])[:, None], *parts)
        share = np.nan_to_num(larger / np.nansum(larger, axis=1, keepdims=True))
        total = held(sums.max(axis=0)[:, None])
        # All of a window's statistic for its largest contribution, less for the others.
        return total * share / np.maximum(share.max(axis=1, keepdims=True), 1e-300)


class Autoregression(Scored):
    """The error of each channel's prediction from its last five windows."""

    name = "autoregression of each channel"
    ORDER = 5

    def __init__(self, data, taught, folder):
        self.models = []
        for channel in range(len(data.channels)):
            lagged = np.concatenate([self.lagged(samples[:, channel]) for samples in taught.values()])
            lagged = lagged[np.isfinite(lagged).all(axis=1)]
            design = np.column_stack([np.ones(len(lagged)), lagged[:, :-1]])
            weights = np.linalg.lstsq(design, lagged[:, -1], rcond=None)[0]
            self.models.append((weights, (lagged[:, -1] - design @ weights).std()))

    def lagged(self, series):
        return np.lib.stride_tricks.sliding_window_view(series, self.ORDER + 1)

    def score(self, samples):
        score = np.zeros(samples.shape)
        for channel, (weights, deviation) in enumerate(self.models):
            lagged = self.lagged(samples[:, channel])
            error = lagged[:, -1] - weights[0] - lagged[:, :-1] @ weights[1:]
            score[self.ORDER:, channel] = abs(error) / deviation
        return score


class Divergence(Scored):
    """`trusswatch detect` without a module on what a regression on the inputs leaves, in standard deviations."""

    name = "KL of a running Gaussian, residual from the inputs"

    def __init__(self, data, taught, folder):
        self.data, self.folder = data, folder
        rows = complete(taught)
        self.slopes = np.linalg.lstsq(self.design(rows), rows[:, : data.sensors], rcond=None)[0]
        residual = self.residual(rows)
        self.mean, self.deviation = residual.mean(axis=0), residual.std(axis=0)

    def design(self, rows):
        return np.column_stack([np.ones(len(rows)), rows[:, self.data.sensors:]])

    def residual(self, rows):
        sensors = rows[:, : self.data.sensors] - self.design(rows) @ self.slopes
        return np.column_stack([sensors, rows[:, self.data.sensors:]])

    def score(self, samples):
        scaled = (self.residual(samples) - self.mean) / self.deviation
        file = table(self.folder / "residual.csv", self.data.channels, scaled, 1.0)
        flags = ["--window", 2, "--lag", 2, "--interval", 20, "--prior-scatter", 0.01, "--time", "none", "--columns",
                 ",".join(self.data.channels)]
        score = np.zeros(samples.shape)
        for row in lines("detect", file, *flags):
            score[row["index"]] = [row["channels"][name].get("divergence") or 0.0 for name in self.data.channels]
        # The first ones of any series are large.
        score[:25] = 0.0
        return score


def injected(samples, channel, onset, kind, amount):
    """`amount` in the channel's unit, of a gain the share by which it is lower."""
    broken = samples.copy()
    part = broken[onset : onset + LASTS, channel]
    if kind == "jump":
        part += amount
    elif kind == "drift":
        part += amount * np.arange(1, len(part) + 1) / len(part)
    else:
        part *= 1.0 - amount
    return broken


def interval(found, cases):
    """95 % interval of a share (Wilson), in percent."""
    if not cases:
        return 0, 100
    share, z2 = found / cases, 1.96**2
    middle, spread = share + z2 / (2 * cases), 1.96 * math.sqrt(share * (1 - share) / cases + z2 / (4 * cases**2))
    return tuple(round(100 * (middle + sign * spread) / (1 + z2 / cases)) for sign in (-1, 1))


def compare(data, seed, onsets):
    draw = np.random.default_rng(seed)
    kinds = [Learned, Divergence, Autoregression, Components, ZScore]
    tally = {kind.name: {fault: [0, 0, 0] for fault in FAULTS} for kind in kinds}
    false = {kind.name: [0, 0] for kind in kinds}
    hours = [0.0, 0.0]
    try:
        inject(data, kinds, draw, onsets, (tally, false, hours))
    except KeyboardInterrupt:
        print("interrupted: the figures are those of the cases until then")
    return tally, false, hours


def inject(data, kinds, draw, onsets, results):
    tally, false, hours = results
    for taught, counted, judged in data.splits:
        with tempfile.TemporaryDirectory() as folder:
            detectors = [kind(data, taught, Path(folder)) for kind in kinds]
            ours = detectors[0]
            allowed = sum(len(ours.alarms(samples)) for samples in counted.values())
            for detector in detectors[1:]:
                detector.calibrate(counted.values(), allowed)
            for place, part in enumerate((counted, judged)):
                hours[place] += sum(len(samples) for samples in part.values()) * data.window_s / 3600
                for detector in detectors:
                    false[detector.name][place] += sum(len(detector.alarms(samples)) for samples in part.values())
            ranges = [channel["highest"] - channel["lowest"] for channel in ours.said["channels"]]
            for samples in judged.values():
                # An alarm that comes without the fault finds nothing.
                before = {detector.name: detector.alarms(samples) for detector in detectors}
                for channel, width in enumerate(ranges):
                    for kind, size in FAULTS * onsets:
                        onset = int(draw.integers(len(samples) // 5, max(len(samples) // 2, len(samples) - LASTS)))
                        amount = size * (1.0 if kind == "gain" else width * draw.choice([-1.0, 1.0]))
                        start = max(0, onset - BEFORE)
                        broken = injected(samples, channel, onset, kind, amount)[start : onset + LASTS]
                        for detector in detectors:
                            alarms = [(start + place, named) for place, named in detector.alarms(broken)]
                            alarms = [one for one in alarms if one[0] >= onset and one not in before[detector.name]]
                            of = tally[detector.name][kind, size]
                            of[0] += 1
                            of[1] += bool(alarms)
                            of[2] += bool(alarms) and alarms[0][1] == channel


def report(tally, false, hours):
    print(f"false alarms in {hours[0]:.3g} h on which thresholds rest, in {hours[1]:.3g} h of the judged recordings:")
    for name, (counted, judged) in false.items():
        print(f"  {name}: {counted}, {judged}")
    print("\n| found % (95 %) / right % of found | " + " | ".join(f"{kind} {size:.0%}" for kind, size in FAULTS) + " |")
    print("|---" * (1 + len(FAULTS)) + "|")
    for name, of in tally.items():
        cells = []
        for cases, found, right in of.values():
            low, high = interval(found, cases)
            named = f"{100 * right / found:.0f}" if found else "-"
            cells.append(f"{100 * found / cases:.0f} ({low}-{high}) / {named}")
        print(f"| {name} | " + " | ".join(cells) + " |")
    print(f"\n{next(iter(next(iter(tally.values())).values()))[0]} cases in each cell")


def real_faults(data):
    """Recordings with documented faults, judged by all healthy ones."""
    parts = data.splits[0] if len(data.splits) > 1 else data.splits[0][:1]
    taught = {name: samples for part in parts for name, samples in part.items()}
    with tempfile.TemporaryDirectory() as folder:
        ours = Learned(data, taught, Path(folder))
        for channel in ours.said["channels"]:
            share = channel["smallest_found"] / (channel["highest"] - channel["lowest"])
            print(f"  {channel['name']}: found from {channel['smallest_found']:.3g}, {share:.0%} of its range")
        print(f"  left out: {ours.said['left_out']}")
        for name, samples in data.faulty.items():
            named = [(first, data.channels[channel]) for first, channel in ours.alarms(samples)]
            print(f"  {name}: {named or 'nothing named'}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", choices=["turbines", "damper"])
    parser.add_argument("path", help="OpenOA's wheel, or a clone of the damper's repository")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--onsets", type=int, default=1, help="of each fault, channel and judged recording")
    given = parser.parse_args()
    data = {"turbines": turbines, "damper": damper}[given.data](given.path)
    print("recordings with documented faults:")
    real_faults(data)
    report(*compare(data, given.seed, given.onsets))


if __name__ == "__main__":
    main()
