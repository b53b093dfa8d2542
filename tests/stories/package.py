"""The Debian package: built once per run of the stories, or the file TRUSSWATCH_PACKAGE."""

import functools
import os
import subprocess
from pathlib import Path

from conftest import ROOT, needs

# Compiling with full optimisation takes minutes.
LIMIT_S = 1800


@functools.cache
def built():
    if "TRUSSWATCH_PACKAGE" in os.environ:
        return Path(os.environ["TRUSSWATCH_PACKAGE"])
    needs("cargo-deb")
    done = subprocess.run([ROOT / "deploy/debian/build", "--fast"], stdout=subprocess.PIPE, text=True, check=True)
    return ROOT / done.stdout.strip().splitlines()[-1]
