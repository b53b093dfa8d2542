"""ARM processors under emulation: the pure crates pass their tests, the programs compute the same bytes as on this machine, and
the package installs and runs on Debian for that architecture.
"""

import functools
import json
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

import debian
import pytest
from conftest import PROGRAMS, ROOT, needs, trusswatch

# Everything is compiled, and emulation is ten to twenty times slower.
LIMIT_S = 5400
# The crates that decide. What a test says of allocations holds for this machine's library.
CRATES = ["truss", "vocabulary", "diagnosis", "process", "replay"]
BINFMT = Path("/proc/sys/fs/binfmt_misc")
STEPS = 16_000
SCHEDULE = """
[[faults]]
at_step = 5000
until_step = 9000
component = "module2/sensor/g3"
fault = { kind = "bias", offset_m = 5e-5 }

[[faults]]
at_step = 13000
component = "module1/actuator/a2"
fault = { kind = "hard_over" }
"""

pytestmark = [pytest.mark.nightly, pytest.mark.timeout(LIMIT_S)]


@dataclass(frozen=True)
class Processor:
    name: str
    target: str
    gnu: str
    qemu: str

    def environment(self):
        target = self.target.replace("-", "_")
        return os.environ | {
            f"CARGO_TARGET_{target.upper()}_LINKER": f"{self.gnu}-gcc",
            f"CARGO_TARGET_{target.upper()}_RUNNER": " ".join(self.emulator()),
            f"CC_{target}": f"{self.gnu}-gcc",
            f"CXX_{target}": f"{self.gnu}-g++",
        }

    def emulator(self):
        return [self.qemu, "-L", f"/usr/{self.gnu}"]

    def trusswatch(self, *words):
        command = [*self.emulator(), programs(self) / "trusswatch", *map(str, words)]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, f"{words}: {done.stdout}\n{done.stderr}"
        return done.stdout


def cargo(processor, *words):
    needs(processor.qemu, f"{processor.gnu}-gcc")
    subprocess.run(["rustup", "target", "add", processor.target], check=True, cwd=ROOT)
    command = ["cargo", words[0], "--locked", "--target", processor.target, *words[1:]]
    subprocess.run(command, check=True, cwd=ROOT, env=processor.environment())


@functools.cache
def programs(processor):
    """The directory of its programs."""
    cargo(processor, "build", "--profile", PROGRAMS.name)
    return ROOT / "target" / processor.target / PROGRAMS.name


ARM64 = Processor("arm64", "aarch64-unknown-linux-gnu", "aarch64-linux-gnu", "qemu-aarch64-static")
ARMHF = Processor("armhf", "armv7-unknown-linux-gnueabihf", "arm-linux-gnueabihf", "qemu-arm-static")
EACH = pytest.mark.parametrize("processor", [ARM64, ARMHF], ids=lambda processor: processor.name)


@EACH
def test_what_decides_passes_its_tests_there(processor):
    crates = [word for crate in CRATES for word in ("-p", crate)]
    cargo(processor, "test", "--release", *crates, "--", "--skip", "allocates")


@EACH
def test_a_simulated_world_has_the_same_history_to_the_last_byte(processor):
    words = ["simulate", "--show", "17"]
    assert processor.trusswatch(*words) == trusswatch(*words, timeout=LIMIT_S)


@EACH
def test_a_campaign_has_the_same_cases_to_the_last_byte(processor, tmp_path):
    words = ["study", "run", "--scenarios", "6", "--nominal", "2", "--mismatch", "0.1", "--seed", "20261130"]
    there, here = tmp_path / "there", tmp_path / "here"
    processor.trusswatch(*words, "--out", there)
    trusswatch(*words, "--out", here, timeout=LIMIT_S)
    cases = (here / "cases.jsonl").read_text()
    assert len(cases.splitlines()) >= 8
    assert (there / "cases.jsonl").read_text() == cases


@EACH
def test_a_recording_made_here_is_replayed_to_the_same_verdicts_and_divergences(processor, rig):
    configs = rig.with_free_ports()
    (configs / "faults.toml").write_text(SCHEDULE)
    recordings = rig.folder / "recordings"
    network = ["--structure", "tower", "--mode", "peer", *(f"--connect={endpoint}" for endpoint in rig.endpoints())]
    rig.start("recorder", PROGRAMS / "trusswatch", "record", "--into", recordings, *network)
    rig.diagnoser("module1", configs)
    rig.diagnoser("module2", configs)
    words = ["run", configs / "plant.toml", "--steps", STEPS, "--speed", "max", "--schedule", configs / "faults.toml"]
    plant = rig.start("plant", PROGRAMS / "trusswatch-plant", *words)
    assert plant.wait(timeout=600) == 0
    del rig.processes["plant"]
    assert rig.end("recorder") == 0
    rig.end_all()
    [recording] = recordings.glob("*.mcap")
    # The exit code says that every verdict, divergence and identification was compared and is the same.
    here, there = (json.loads(run("replay", recording, "--verify", "--json")) for run in (trusswatch, processor.trusswatch))
    assert len(here["modules"]) == 2
    assert here["modules"] == there["modules"]


def enable(processor):
    """Lets the kernel start that processor's programs, as Debian's own configuration of the emulator says."""
    if not (BINFMT / "register").exists():
        subprocess.run(["mount", "-t", "binfmt_misc", "none", BINFMT], check=True)
    name = processor.qemu.removesuffix("-static")
    if not (BINFMT / name).exists():
        (BINFMT / "register").write_text(Path(f"/usr/lib/binfmt.d/{name}.conf").read_text())


@EACH
def test_the_package_installs_in_that_debian_and_its_demo_names_every_fault(processor, tmp_path):
    needs("cargo-deb", "debootstrap", processor.qemu)
    enable(processor)
    built = subprocess.run(
        [ROOT / "deploy/debian/build", "--target", processor.target], stdout=subprocess.PIPE, text=True, check=True, cwd=ROOT,
    )
    package = ROOT / built.stdout.strip().splitlines()[-1]
    assert package.name.endswith(f"_{processor.name}.deb")
    root = tmp_path / "root"
    subprocess.run(["cp", "--archive", "--reflink=auto", debian.tree("procps", processor.name), root], check=True)
    (root / "tmp/trusswatch.deb").write_bytes(package.read_bytes())

    def there(*command):
        done = subprocess.run(["chroot", root, *command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert done.returncode == 0, f"{command}: {done.stdout}"
        return done.stdout

    there("dpkg", "--install", "/tmp/trusswatch.deb")
    installed = int(there("dpkg-query", "--show", "--showformat", "${Installed-Size}", "trusswatch"))
    print(f"{processor.name}: {package.stat().st_size / 2**20:.1f} MiB, installed {installed / 1024:.1f} MiB")
    assert installed <= 30 * 1024
    there("sh", "-c", "trusswatch check /etc/trusswatch/*.toml")
    there("trusswatch", "demo", "--speed", "max")
