"""The package for Python: the same bits as the programs, errors, types, speed, and the notebook."""

import csv
import json
import os
import shutil
import subprocess
import sys
import time
import tomllib
import zipfile

import numpy as np
import pytest
from conftest import ROOT, documented, trusswatch

CRATE = ROOT / "crates/python"
TARGET = ROOT / "target/python"
MODULES = [ROOT / "configs/module1.toml", ROOT / "configs/module2.toml"]
CONFIGS = [word for module in MODULES for word in ("--config", module)]
SEED = 20261127
BUILD_S = 600


def built(*command, **options):
    environment = {**os.environ, "CARGO_TARGET_DIR": str(TARGET)}
    done = subprocess.run([*map(str, command)], cwd=CRATE, env=environment, capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="session")
def wheel(tmp_path_factory):
    """The wheel as it would be shipped."""
    out = tmp_path_factory.mktemp("wheel")
    built(sys.executable, "-m", "maturin", "build", "--release", "--locked", "--quiet", "--out", out, timeout=BUILD_S)
    (found,) = out.glob("*.whl")
    return found


@pytest.fixture(scope="session")
def site(wheel, tmp_path_factory):
    """A directory of packages with the wheel installed."""
    folder = tmp_path_factory.mktemp("site")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--disable-pip-version-check"]
    built(*pip, "--target", folder, wheel)
    return folder


@pytest.fixture(scope="session")
def tw(site):
    sys.path.insert(0, str(site))
    import trusswatch

    return trusswatch


# Builds the wheel, which takes minutes.
pytestmark = [pytest.mark.nightly, pytest.mark.timeout(BUILD_S)]


def same(found, expected):
    """The same bits, whatever kind of NaN."""
    found, expected = np.asarray(found, float), np.asarray(expected, float)
    assert found.shape == expected.shape
    assert np.array_equal(found, expected, equal_nan=True)


def lines(text):
    return [json.loads(line) for line in text.splitlines()]


def write_table(file, columns):
    """CSV with the shortest text of each number; NaN is empty."""
    with open(file, "w", newline="") as out:
        table = csv.writer(out)
        table.writerow(columns)
        for row in zip(*(np.asarray(column).tolist() for column in columns.values())):
            table.writerow(["" if value != value else repr(value) for value in row])


def test_wheel_is_for_every_python_and_has_the_repositorys_versions(wheel):
    assert "-cp310-abi3-" in wheel.name
    with zipfile.ZipFile(wheel) as packed:
        names = {name.rsplit("/", 1)[-1] for name in packed.namelist()}
    assert {"__init__.py", "_trusswatch.pyi", "py.typed", "METADATA"} <= names

    def versions(lock):
        found = {}
        for package in tomllib.loads(lock.read_text())["package"]:
            found.setdefault(package["name"], set()).add(package["version"])
        return found

    ours, theirs = versions(ROOT / "Cargo.lock"), versions(CRATE / "Cargo.lock")
    assert not [name for name in theirs if name.startswith(("zenoh", "tokio"))]
    other = {name: (theirs[name], ours[name]) for name in theirs if name in ours and not theirs[name] <= ours[name]}
    assert not other, "cp Cargo.lock crates/python/ and let cargo remove what is not used"


def test_stubs_are_those_of_the_package(tw, site):
    check = [sys.executable, "-m", "mypy.stubtest", "trusswatch", "--concise", "--ignore-disjoint-bases"]
    done = subprocess.run(check, env={**os.environ, "MYPYPATH": str(site), "PYTHONPATH": str(site)}, cwd=site, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_everything_has_a_docstring(tw):
    for name in tw.__all__:
        of = getattr(tw, name)
        assert of.__doc__, name
        for member in (m for m in getattr(of, "__dict__", {}) if not m.startswith("_")):
            assert getattr(of, member).__doc__, f"{name}.{member}"


def test_divergences_meet_the_golden_values(tw):
    cases = json.loads((ROOT / "crates/diagnosis/tests/data/kl_divergence.json").read_text())
    for case in cases:
        detector = tw.Detector(
            case["regularization"], window=case["window"], lag=case["lag"], interval=case["interval"] or None
        )
        found = detector.push(np.array(case["samples"])[:, None]).divergence[:, 0]
        index, expected = np.array(case["divergence"]).T
        np.testing.assert_allclose(found[index.astype(int)], expected, rtol=1e-9, atol=1e-9)


@pytest.fixture(scope="session")
def walk():
    """Five channels with a jump, gaps of one channel and of all."""
    draw = np.random.default_rng(7)
    samples = draw.normal(size=(3000, 5)) + 0.05 * draw.normal(size=(3000, 5)).cumsum(axis=0)
    samples[1500:, 2] += 6.0
    samples[700:705, 1] = np.nan
    samples[900:903] = np.nan
    samples[2000, 4] = np.nan
    return samples


def test_divergences_and_changes_are_those_of_detect_in_blocks_of_any_length(tw, walk, tmp_path):
    table = tmp_path / "walk.csv"
    write_table(table, {f"x{k}": column for k, column in enumerate(walk.T)})
    flags = ["--window", 8, "--lag", 4, "--interval", 600, "--prior-scatter", 0.5, "--threshold", 0.03, "--warm-up", 700, "--quiet-steps", 5]
    rows = lines(trusswatch("detect", table, "--json", *flags))
    expected = [[row["channels"][f"x{k}"] for k in range(5)] for row in rows]
    detector = tw.Detector(
        0.5, channels=5, window=8, lag=4, interval=600, threshold=0.03, warm_up=700, quiet_steps=5
    )
    blocks = [detector.push(block) for block in np.split(walk, [1, 2, 40, 901, 902, 2500])]
    divergence = np.concatenate([block.divergence for block in blocks])
    same(divergence, [[np.nan if c["divergence"] is None else c["divergence"] for c in row] for row in expected])
    for name in "change", "leaving":
        found = np.concatenate([getattr(block, name) for block in blocks])
        assert found.dtype == bool and found.any()
        assert found.tolist() == [[c.get(name, False) for c in row] for row in expected]
    assert detector.steps == len(walk)
    whole = tw.Detector([0.5] * 5, window=8, lag=4, interval=600).push(np.asfortranarray(walk))
    same(whole.divergence, divergence)


def loaded(seed, minutes=24, most=100.0):
    """A structure that two jacks load by steps, at 5 Hz: seven sensors follow."""
    draw, samples = np.random.default_rng(seed), minutes * 300
    force, target, forces = np.zeros(2), np.zeros(2), np.empty((samples, 2))
    for sample in range(samples):
        if sample % 450 == 0:
            level = most * np.sin(np.pi * sample / samples)
            target = level * (np.array([0.8, 0.1]) + draw.uniform(0.0, [0.2, 0.9]))
        force += np.clip(target - force, -0.02 * most, 0.02 * most)
        forces[sample] = force
    angle = np.arange(7.0)
    load = forces[:, :1] * (1 + np.cos(angle)) + forces[:, 1:] * (0.7 + np.sin(angle))
    wander = 0.002 * draw.normal(size=load.shape).cumsum(axis=0)
    sensors = load + 2e-4 * load**2 + 0.3 * draw.normal(size=7) + wander + 0.1 * draw.normal(size=load.shape)
    columns = {f"s{k + 1}": column for k, column in enumerate((sensors / 0.05).round().T * 0.05)}
    noise = 0.05 * draw.normal(size=forces.shape)
    return {**columns, "u1": forces[:, 0] + noise[:, 0], "u2": forces[:, 1] + noise[:, 1]}


SENSORS, INPUTS = [f"s{k}" for k in range(1, 8)], ["u1", "u2"]


@pytest.fixture(scope="session")
def healthy(tmp_path_factory):
    """Recordings by the path of their table."""
    folder = tmp_path_factory.mktemp("healthy")
    recordings = {str(folder / f"day{seed}.csv"): loaded(seed) for seed in range(1, 5)}
    for file, recording in recordings.items():
        write_table(file, recording)
    return recordings


@pytest.fixture(scope="session")
def learned(tw, healthy):
    return tw.learn(healthy, sensors=SENSORS, inputs=INPUTS, rate=5)


def test_what_is_learnt_is_the_file_of_the_command_line_and_back(tw, healthy, learned, tmp_path):
    file = tmp_path / "module.toml"
    report = json.loads(trusswatch(
        "learn", *healthy, "--sensors", ",".join(SENSORS), "--inputs", ",".join(INPUTS), "--rate", 5, "--out", file, "--json"
    ))
    assert file.read_text() == learned.to_toml()
    assert {**learned.report, "v": report["v"]} == report
    again = tw.LearnedModule(file)
    assert again.to_toml() == tw.LearnedModule.from_toml(file.read_text()).to_toml() == learned.to_toml()
    assert again.sensors == SENSORS and again.inputs == INPUTS and again.window_s == 1.0


def test_verdicts_are_those_of_detect(tw, learned, tmp_path):
    today = loaded(9)
    today["s3"][4000:] += 6.0
    today["s5"][2000:2400] = np.nan
    table, module = tmp_path / "today.csv", tmp_path / "module.toml"
    write_table(table, today)
    learned.save(module)
    printed = lines(trusswatch("detect", table, "--config", module, "--rate", 5, "--json"))
    verdicts, summary = learned.detect(today, 5)
    assert verdicts == [line["verdict"] for line in printed[:-1]]
    assert summary == printed[-1]["summary"]["components"]
    assert {v["component"] for v in verdicts if v["state"] == "faulty"} == {"s3"}
    assert summary["s5"]["state"] == "no_signal"
    judge = learned.judge(5)
    block = np.stack([today[name] for name in judge.channels], axis=1)
    streamed = [verdict for part in np.array_split(block, 17) for verdict in judge.push(part)]
    last, same_summary = judge.finish()
    assert streamed + last == verdicts and same_summary == summary


@pytest.fixture(scope="session")
def modules(tw):
    return [tw.Module(file) for file in MODULES]


@pytest.fixture(scope="session")
def study(tw, modules):
    return tw.Study(ROOT / "configs/plant.toml", modules, seed=SEED)


@pytest.fixture(scope="session")
def scenarios(study):
    return [study.scenario(number) for number in range(7)]


def test_configurations_are_read_and_refused_as_by_the_program(tw, tmp_path):
    configs = shutil.copytree(ROOT / "configs", tmp_path / "configs")
    small = [configs / "small/lower.toml", configs / "small/upper.toml"]
    for file in [*configs.glob("module*.toml"), *configs.glob("paper/*.toml"), *small]:
        module = tw.Module(file)
        assert len(module.thresholds) == len(module.components) == module.detector().channels
    assert tw.Module(MODULES[0]).has_reference and tw.Module(MODULES[0]).peers == ["module2"]
    for file in [configs / name for name in ("plant.toml", "small/plant.toml", "storm.toml")] + [*configs.glob("weather/*.toml")]:
        tw.Plant(file).advance(2)
    for of, name, was, wrong in [
        (tw.Module, "module1.toml", "\ngage_noise_strain", "\ngage_noise_strian"),
        (tw.Module, "module1.toml", "\nwindow = 12", "\nwindow = 13"),
        (tw.Module, "module2.toml", "\nroot_ratio = 30", "\nroot_ratio = 0.5"),
        (tw.Plant, "plant.toml", "\nseed = 1", "\nseeed = 1"),
    ]:
        file = configs / name
        assert was in file.read_text()
        file.write_text(file.read_text().replace(was, wrong, 1))
        said = trusswatch("check", file, check=False)
        assert said.returncode == 3
        with pytest.raises(ValueError) as refused:
            of(file)
        # But for the list of known keys, whose order differs.
        assert str(refused.value).split(", expected one of")[0] in said.stderr, said


def test_scenarios_are_those_of_the_study(study, scenarios, tmp_path):
    out = tmp_path / "run"
    of = ["--seed", SEED, "--scenarios", 7, "--nominal", 1]
    trusswatch("study", "export", tmp_path, *of)
    trusswatch("study", "run", *of, "--out", out)
    cases = [json.loads(line) for line in (out / "cases.jsonl").read_text().splitlines()]
    cases = {case["case"]: case["row"] for case in cases if "case" in case}
    with open(tmp_path / "changes.csv", newline="") as table:
        changes = list(csv.DictReader(table))
    files = [f"scenario-{number:05}.csv" for number in range(7)] + ["nominal-00000.csv"]
    for file, scenario in zip(files, [*scenarios, study.nominal(0)]):
        diagnosis = scenario.diagnosis
        with open(tmp_path / file, newline="") as table:
            header, *rows = csv.reader(table)
        assert header[2:] == [f"{component}/residual" for component in diagnosis.components]
        same(diagnosis.residual, [[float(value) for value in row[2:]] for row in rows])
        true = [diagnosis.components[np.flatnonzero(row)[0]] if row.any() else "" for row in scenario.faulty]
        assert true == [row[1] for row in rows]
        expected = [(change["component"], int(change["step"])) for change in changes if change["file"] == file]
        assert [(change["component"], change["step"]) for change in diagnosis.changes] == expected
    latched = [
        [(v["component"], v["detection_step"], v["decided_step"]) for v in scenario.diagnosis.verdicts if v["state"] == "latched"]
        for scenario in scenarios
    ]
    assert latched == [[(d["component"], d["detection"], d["decided"]) for d in row["diagnosed"]] for row in map(cases.get, range(7))]
    assert sum(map(len, latched)) >= 6


def test_diagnosers_of_one_process_answer_each_other_as_in_the_study(tw, modules, scenarios):
    scenario = scenarios[3]
    group = tw.Diagnosers(modules, run=scenario.seed, identify=True)
    plain = tw.Study(ROOT / "configs/plant.toml", modules, seed=SEED)
    assert plain.scenario(3).seed == scenario.seed
    parts = [{name: {key: np.array_split(value, 11)[k] for key, value in signals.items()} for name, signals in scenario.samples.items()} for k in range(11)]
    found = [group.push(part) for part in parts]
    same(np.concatenate([part.residual for part in found]), scenario.diagnosis.residual)
    same(np.concatenate([part.divergence for part in found]), scenario.diagnosis.divergence)
    assert group.step == len(scenario.faulty)
    assert group.components == scenario.diagnosis.components
    named = [v["component"] for part in found for v in part.verdicts if v["state"] == "latched"]
    assert named == [scenario.fault["component"]]
    kinds = [i["candidates"][0]["kind"] for part in found for i in part.identifications]
    assert kinds[-1] == scenario.fault["fault"]["kind"]
    assert group.states[named[0]] == "latched"
    alone = tw.Diagnosers(modules[:1]).push({"module1": scenario.samples["module1"]})
    same(alone.residual, scenario.diagnosis.residual[:, : len(alone.components)])


def test_plant_gives_the_same_samples_again_and_takes_faults(tw, modules):
    plant, other = (tw.Plant(ROOT / "configs/plant.toml", seed=3) for _ in range(2))
    first = plant.advance(500)
    halves = [other.advance(200), other.advance(300)]
    for module, signals in first.items():
        for key, values in signals.items():
            same(np.concatenate([half[module][key] for half in halves]), values)
    assert first["module1"]["pressures_pa"].shape == (500, 4, 2)
    gage = next(name for name in plant.components if "/sensor/" in name)
    plant.inject(gage, {"kind": "bias", "offset_m": 0.5})
    assert plant.step == 500
    module, _, name = gage.split("/")
    shift = plant.advance(1)[module]["elongations_m"] - other.advance(1)[module]["elongations_m"]
    assert sorted(shift[0].round(6).tolist())[-1] == 0.5
    plant.clear(gage)

    # Another structure in place of its own, for one step.
    actuators_n, levels_n = plant.loads()
    assert actuators_n.shape == (8,) and levels_n.shape == (len(plant.live_loads_kg), 2)
    rigid, own = np.zeros(16), plant.advance(1)
    plant.respond(rigid)
    still = plant.advance(1)
    assert all(np.abs(still[module]["elongations_m"]).max() < np.abs(own[module]["elongations_m"]).max() for module in own)
    with pytest.raises(ValueError, match="give one of each gage"):
        plant.respond(rigid[1:])


def test_recordings_are_the_tables_of_export(tw, tmp_path):
    from mcap.writer import Writer

    samples = tw.Plant(ROOT / "configs/plant.toml", seed=5).advance(400)
    file = tmp_path / "tower.mcap"
    with open(file, "wb") as stream:
        writer = Writer(stream)
        writer.start()
        for module, signals in samples.items():
            schema = writer.register_schema("sample", "jsonschema", b"{}")
            channel = writer.register_channel(f"trusswatch/tower/{module}/sample", "json", schema)
            for step in range(400):
                time_ns = 1_700_000_000_000_000_000 + 1_000_000 * step
                head = {"v": 1, "module": module, "run": 8, "step": step, "time_unix_ns": time_ns}
                values = {key: value[step].tolist() for key, value in signals.items()}
                if step == 7:
                    values["elongations_m"][0] = None
                writer.add_message(channel, time_ns, json.dumps({**head, **values}).encode(), time_ns, step)
        writer.finish()
    trusswatch("export", file, "--csv", tmp_path / "tables")
    tables, verdicts = tw.read_recording([file])
    assert verdicts == [] and set(tables) == {f"{module}-run-8" for module in samples}
    for name, columns in tables.items():
        with open(tmp_path / "tables" / f"{name}.csv", newline="") as table:
            rows = list(csv.DictReader(table))
        assert set(rows[0]) - {"published_s"} == set(columns) - {"published_ns"}
        for column, values in columns.items():
            if column != "published_ns":
                same(values, [float(row[column] or "nan") for row in rows])
        seconds = [f"{ns // 10**9}.{ns % 10**9:09}" for ns in columns["published_ns"].tolist()]
        assert seconds == [row["published_s"] for row in rows]
    with pytest.raises(ValueError, match="no residuals of `module1`"):
        tw.read_recording([file], residuals=True)


WRONG = {
    "window is 0; use 1 to 256 samples": lambda tw: tw.Detector(1.0, window=0),
    "expected a whole number from 0": lambda tw: tw.Detector(1.0, window=-1),
    "lag is 18446744073709551615; use 1 to 4096 steps": lambda tw: tw.Detector(1.0, lag=2**64 - 1),
    "interval is 1 vectors": lambda tw: tw.Detector(1.0, interval=1),
    "prior scatter is NaN": lambda tw: tw.Detector(float("nan")),
    "threshold is -1": lambda tw: tw.Detector(1.0, threshold=-1.0),
    "prior_scatter has 2 values for 3 channels": lambda tw: tw.Detector([1.0, 1.0], channels=3),
    "0 channels": lambda tw: tw.Detector([]),
    r"the block has the shape \(3, 3\); use \(steps, 2\)": lambda tw: tw.Detector([1.0, 1.0]).push(np.zeros((3, 3))),
    r"the block has the shape \(\)": lambda tw: tw.Detector(1.0).push(3.0),
    "could not convert string to float": lambda tw: tw.Detector(1.0).push([["x"]]),
    "missing.toml: cannot be read": lambda tw: tw.Module("missing.toml"),
    "unknown field `detection`": lambda tw: tw.LearnedModule(MODULES[0]),
    "no module; give at least one": lambda tw: tw.Diagnosers([]),
    "`module1` is given twice": lambda tw: tw.Diagnosers([tw.Module(MODULES[0])] * 2),
    "samples of `module1` are missing": lambda tw: tw.Diagnosers([tw.Module(MODULES[0])]).push({}),
    "`demands_n` of `module1` is missing": lambda tw: tw.Diagnosers([tw.Module(MODULES[0])]).push({"module1": {}}),
    "mismatch is 2; use 0 to 0.9": lambda tw: tw.Study(ROOT / "configs/plant.toml", [tw.Module(MODULES[0])], mismatch=2),
    "but the plant has `module1, module2`": lambda tw: tw.Study(ROOT / "configs/plant.toml", [tw.Module(MODULES[0])]),
    "unknown variant `rust`": lambda tw: tw.Plant(ROOT / "configs/plant.toml").inject("module1/sensor/g1", {"kind": "rust"}),
    "module1/sensor/none": lambda tw: tw.Plant(ROOT / "configs/plant.toml").clear("module1/sensor/none"),
    "no recording": lambda tw: tw.learn({}, sensors=["s1"], inputs=["u1"], rate=5),
    "name at least one": lambda tw: tw.learn({"a": {}}, sensors=[], inputs=["u1"], rate=5),
    "a: missing column `s1`": lambda tw: tw.learn({"a": {}}, sensors=["s1"], inputs=["u1"], rate=5),
    "column `u1` has 3 rows, the first one 2": lambda tw: tw.learn({"a": {"s1": [1, 2], "u1": [1, 2, 3]}}, sensors=["s1"], inputs=["u1"], rate=5),
    "complete windows": lambda tw: tw.learn({"a": {"s1": [1, 2], "u1": [1, 2]}}, sensors=["s1"], inputs=["u1"], rate=5),
    "rate: expected": lambda tw: tw.learn({"a": {}}, sensors=["s1"], inputs=["u1"], rate=0),
    "tower.toml": lambda tw: tw.read_recording([ROOT / "configs/tower.toml"]),
}


@pytest.mark.parametrize("message", WRONG)
def test_what_cannot_be_used_is_a_value_error(tw, message):
    with pytest.raises(ValueError, match=message):
        WRONG[message](tw)


def test_bits_that_are_no_samples_end_no_process(tw, learned):
    """Any float64 is taken, and nothing panics."""
    draw = np.random.default_rng(1)
    wild = np.frombuffer(draw.bytes(8 * 4 * 3000), float).reshape(3000, 4)
    readings = tw.Detector(1.0, channels=4, interval=50, threshold=1.0).push(wild)
    assert readings.divergence.shape == wild.shape and not np.isinf(readings.divergence).any()
    judge = learned.judge(5)
    judge.push(np.resize(wild, (3000, 9)))
    judge.finish()
    with pytest.raises(ValueError, match="has finished"):
        judge.push(np.zeros((1, 9)))
    group = tw.Diagnosers([tw.Module(file) for file in MODULES])
    plant = tw.Plant(ROOT / "configs/plant.toml")
    samples = plant.advance(1000)
    for signals in samples.values():
        for values in signals.values():
            values[500:] = np.resize(wild, values[500:].shape)
    group.push(samples)


def test_a_channel_sample_costs_little_more_than_in_rust_and_less_than_adwin(tw, tmp_path):
    from river.drift import ADWIN

    channels, settings = 8, {"window": 10, "lag": 10, "interval": 2000}
    samples = np.random.default_rng(2).normal(size=(20_000, channels))
    file = tmp_path / "samples"
    samples.tofile(file)
    rust = ["cargo", "run", "--release", "--locked", "--quiet", "--example", "channel_sample", "--"]
    rust = [*rust, file, channels, *settings.values(), 1.0]

    def lower_quartile_ns(blocks, take):
        times = []
        for block in blocks:
            begin = time.perf_counter()
            take(block)
            times.append((time.perf_counter() - begin) / block.size)
        return 1e9 * np.quantile(times, 0.25)

    def of_package():
        return lower_quartile_ns(np.split(samples, 20), tw.Detector(1.0, channels=channels, **settings).push)

    def of_river():
        """As its documentation has it, for each channel."""
        adwins, changes = [ADWIN() for _ in range(channels)], []

        def take(block):
            for step, row in enumerate(block):
                for channel, (adwin, value) in enumerate(zip(adwins, row)):
                    adwin.update(value)
                    if adwin.drift_detected:
                        changes.append((step, channel))

        return lower_quartile_ns(np.split(samples[:8000], 16), take)

    # A busy machine interrupts some blocks, and is faster in some seconds than in others: rounds in turns.
    rounds = [(float(built(*rust).split()[0]), of_package(), of_river()) for _ in range(6)]
    in_rust, in_python, adwin = np.median(rounds, axis=0)
    print(f"a channel-sample: Rust {in_rust:.0f} ns, package {in_python:.0f} ns, ADWIN {adwin:.0f} ns")
    assert in_python <= 1.5 * in_rust
    assert in_python < adwin


def test_recipe_of_the_readme_runs_as_printed(site):
    environment = {**os.environ, "PYTHONPATH": str(site)}
    command = [sys.executable, "-c", documented("python")]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=BUILD_S)
    assert (done.returncode, done.stdout) == (0, "{'temp721'}\n"), done.stderr


def test_notebook_runs_as_printed(tw, site, monkeypatch):
    import nbformat
    from nbclient import NotebookClient

    monkeypatch.setenv("PYTHONPATH", str(site))
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    notebook = nbformat.read(CRATE / "compare.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "clear the outputs before you commit"
    NotebookClient(notebook, timeout=120, kernel_name="python3", resources={"metadata": {"path": str(CRATE)}}).execute()
    printed = "".join(output.get("text", "") for cell in notebook.cells for output in cell.get("outputs", []))
    assert "own detector" in printed, printed
