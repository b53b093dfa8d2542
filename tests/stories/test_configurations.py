"""The shipped configurations, checked without starting anything."""

import re
import shutil
import subprocess
import tomllib

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


def test_the_package_for_python_knows_every_key_of_modules_and_plant():
    """It reads the files by types of its own, and refuses what these do not name."""
    files = (ROOT / "crates/python/src/files.rs").read_text()
    for name, table in (("module1.toml", "ModuleFile"), ("module2.toml", "ModuleFile"), ("plant.toml", "PlantDocument")):
        fields = re.search(rf"struct {table} {{(.*?)^}}", files, re.M | re.S)[1]
        known = set(re.findall(r'rename = "(\w+)"', fields)) | set(re.findall(r"^    (\w+):", fields, re.M))
        keys = set(tomllib.loads((ROOT / "configs" / name).read_text()))
        assert keys <= known, f"{name}: {keys - known} are not fields of {table}"
