"""The Debian package, built once in a run of the stories; or the one that TRUSSWATCH_PACKAGE names."""

import functools
import os
import subprocess
from pathlib import Path

from conftest import ROOT, cannot
from debian import CACHE

# Compiling with full optimisation takes minutes.
LIMIT_S = 1800


@functools.cache
def built():
    if "TRUSSWATCH_PACKAGE" in os.environ:
        return Path(os.environ["TRUSSWATCH_PACKAGE"])
    cargo_deb = next(CACHE.glob("cargo-deb-*/bin"), None)
    if not cargo_deb:
        cannot("Debian package", "needs cargo-deb: run .ci/tools package")
    environment = {**os.environ, "PATH": f"{cargo_deb}:{os.environ['PATH']}"}
    done = subprocess.run([ROOT / "deploy/debian/build", "--fast"], env=environment, stdout=subprocess.PIPE, text=True, check=True)
    return ROOT / done.stdout.strip().splitlines()[-1]
