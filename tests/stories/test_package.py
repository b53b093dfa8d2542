"""The Debian package: files, no lintian warning, valid shipped configurations, correct and confined units. The unit checks
are themselves tested on units that are broken on purpose.
"""

import re
import shutil
import subprocess

import package
import pytest
from conftest import ROOT, needs

UNITS = "lib/systemd/system"
DIAGNOSER = "trusswatch-diagnoser@module1.service"
# Highest permitted exposure, of 100.
EXPOSURE = 15

pytestmark = pytest.mark.timeout(package.LIMIT_S)


def run(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    """The directory of the package's files; its control files are in another one beside it."""
    needs("lintian", "systemd-analyze", "man", "dpkg-deb")
    folder = tmp_path_factory.mktemp("package")
    subprocess.run(["dpkg-deb", "--extract", package.built(), folder / "root"], check=True)
    subprocess.run(["dpkg-deb", "--control", package.built(), folder / "control"], check=True)
    return folder / "root"


def test_files_are_those_listed(unpacked):
    listed = (ROOT / "deploy/debian/files").read_text().splitlines()
    files = [(str(file.relative_to(unpacked)), file) for file in unpacked.rglob("*") if file.is_symlink() or not file.is_dir()]
    present = [f"{'link' if file.is_symlink() else format(file.stat().st_mode & 0o7777, 'o')} {name}" for name, file in sorted(files)]
    conffiles = (unpacked.parent / "control/conffiles").read_text().splitlines()
    assert present + sorted(f"conffile {name}" for name in conffiles) == listed


def test_lintian_finds_no_error(unpacked):
    done = run("lintian", "--fail-on", "error", "--display-info", "--allow-root", package.built())
    print(done.stdout)
    assert done.returncode == 0


def test_configurations_are_valid_as_shipped(unpacked):
    files = sorted(file for file in (unpacked / "etc/trusswatch").rglob("*") if file.is_file())
    done = run(unpacked / "usr/bin/trusswatch", "check", *files)
    assert files and done.returncode == 0, done.stdout


def test_manual_pages_and_completions_have_no_mistakes(unpacked):
    pages = list((unpacked / "usr/share/man/man1").glob("*.gz"))
    completions = list((unpacked / "usr/share/bash-completion/completions").iterdir())
    assert pages and completions
    for page in pages:
        done = subprocess.run(["man", "--warnings", "--local-file", page], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        assert not done.stderr, page
    for completion in completions:
        assert run("bash", "-n", completion).returncode == 0, completion


def problems(root, unit):
    """The problems of a unit: misspelled settings, a missing program, too much exposure."""
    checks = [["verify", f"--root={root}", "--man=no", "--recursive-errors=no", unit]]
    if unit.endswith(".service"):
        checks.append(["security", f"--root={root}", "--offline=true", f"--threshold={EXPOSURE}", unit])
    done = [run("systemd-analyze", *check) for check in checks]
    return [one.stdout for one in done if one.returncode != 0]


@pytest.mark.parametrize("unit", ["trusswatch.target", "trusswatch-router.service", "trusswatch-plant.service",
                                  "trusswatch-recorder.service", "trusswatch-web.service", "trusswatch-notify.service", DIAGNOSER])
def test_unit_is_good(unpacked, unit):
    assert not problems(unpacked, unit)


@pytest.mark.parametrize("old, new", [
    pytest.param("^WatchdogSec=", "WatchDogSec=", id="misspelt key"),
    pytest.param("^Restart=always", "Restart=allways", id="misspelt value"),
    pytest.param("^ExecStart=.*diagnoser run", "ExecStart=/usr/bin/trusswatch-diagnozer run", id="missing program"),
    pytest.param("^(DynamicUser|ProtectSystem|CapabilityBoundingSet|NoNewPrivileges)=.*\n", "", id="loosened sandbox"),
    pytest.param("^(SystemCallFilter|PrivateUsers)=.*\n", "", id="any system call, and the host's users"),
])
def test_broken_unit_is_refused(unpacked, tmp_path, old, new):
    shutil.copytree(unpacked, tmp_path / "root", symlinks=True)
    unit = tmp_path / "root" / UNITS / "trusswatch-diagnoser@.service"
    text, changes = re.subn(old, new, unit.read_text(), flags=re.M)
    assert changes
    unit.write_text(text)
    assert problems(tmp_path / "root", DIAGNOSER)
