"""The rig of deploy/compose: built without pulling an image, started, given faults that must be isolated exactly, its
containers killed, stopped, paused and cut off, and removed completely. The same as a star around a router with mutual
TLS; the star without TLS is started, too.
"""

import os
import re
import subprocess
import sys

import pytest
from conftest import ROOT, cannot, documented

PEERS = ["--file", "deploy/compose/compose.yaml"]
STAR = [*PEERS, "--file", "deploy/compose/router.yaml"]
TLS = [*STAR, "--file", "deploy/compose/tls.yaml"]
IMAGE_BYTES = 50_000_000

# Compiling with full optimisation takes minutes.
pytestmark = pytest.mark.timeout(1800)


def run(*command, check=True):
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    print(f"$ {' '.join(command)}\n{done.stdout}")
    assert not check or done.returncode == 0, command
    return done.stdout


def everything():
    """All objects that docker has on this computer."""
    kinds = [("ps", "--all"), ("network", "ls"), ("volume", "ls"), ("images", "--all")]
    return {thing for kind in kinds for thing in run("docker", *kind, "--quiet").split()}


@pytest.fixture(scope="module")
def compose():
    """Runs docker compose, version 2 or 1.29, and removes the rig at the end."""
    def works(*command):
        try:
            return subprocess.run(command, capture_output=True).returncode == 0
        except FileNotFoundError:
            return False
    if os.geteuid() != 0 or not works("docker", "info"):
        cannot("compose rig", "needs docker, and root for kill -9 of a container's process")
    program = next((words for words in (["docker", "compose"], ["docker-compose"]) if works(*words, "version")), None)
    if not program:
        cannot("compose rig", "needs docker compose")
    assert not run("docker", "ps", "--all", "--quiet", "--filter", "label=com.docker.compose.project=trusswatch"), "a rig is up already"
    before = everything()
    yield lambda *words: run(*program, *words)
    run(*program, *TLS, "--profile", "setup", "down", "--volumes", "--remove-orphans", check=False)
    run("docker", "image", "rm", "--force", "trusswatch", check=False)
    assert not everything() - before, "left behind"


@pytest.fixture(scope="module")
def image(compose):
    build, bring_up = documented("compose").strip().split(" && ")
    assert bring_up == "docker compose -f deploy/compose/compose.yaml up --detach"
    run(build)


@pytest.fixture
def up(compose, image, request):
    """Runs the rig with these files until the story ends."""
    files = []

    def up(*words):
        files.extend(words)
        assert not re.search("pull(ing|ed)", compose(*words, "up", "--detach"), re.I), "an image was pulled"
    yield up
    if getattr(request.node, "failed", False):
        compose(*files, "ps")
        compose(*files, "logs", "--tail=40")
    if files:
        compose(*files, "down", "--volumes")


def played(script):
    run(sys.executable, "-B", f"deploy/compose/{script}")


@pytest.mark.nightly
def test_image_is_small(image):
    assert int(run("docker", "image", "inspect", "--format", "{{.Size}}", "trusswatch")) <= IMAGE_BYTES


def test_peers_name_every_fault_whatever_happens_to_containers(up):
    up(*PEERS)
    played("faults.py")
    played("chaos.py")


def test_star_around_a_router_comes_up(up):
    up(*STAR)


@pytest.mark.nightly
def test_star_with_mutual_tls_names_every_fault_whatever_happens_to_containers(up):
    run("deploy/compose/certificates")
    up(*TLS)
    played("chaos.py")
