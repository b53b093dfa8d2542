"""The shipped configurations, checked without starting anything."""

import shutil
import subprocess

from conftest import PROGRAMS, ROOT


def check(program, *files):
    command = [PROGRAMS / program, "check", *map(str, files)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=ROOT)
    return done.returncode, done.stdout


def test_configurations_are_valid_and_a_misspelt_key_is_named(tmp_path):
    configs = shutil.copytree(ROOT / "configs", tmp_path / "configs")
    plants = [*(configs / name for name in ("plant.toml", "small/plant.toml", "storm.toml")), *configs.glob("weather/*.toml")]
    small = [configs / "small/lower.toml", configs / "small/upper.toml"]
    diagnosers = [*configs.glob("module*.toml"), *configs.glob("paper/*.toml"), *small]
    everything = [*configs.rglob("*.toml"), *configs.rglob("*.json5")]
    for program, files in (("-plant", plants), ("-diagnoser", diagnosers), ("", everything)):
        code, said = check(f"trusswatch{program}", *files)
        assert code == 0, said

    module1 = configs / "module1.toml"
    module1.write_text(module1.read_text().replace("\ngage_noise_strain", "\ngage_noise_strian"))
    code, said = check("trusswatch-diagnoser", module1)
    assert code == 3 and "gage_noise_strian" in said, said
