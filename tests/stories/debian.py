"""Makes the base Debian of the machines, once, with the host's release and mirror; prints its path."""

import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

PACKAGES = "systemd,systemd-sysv,dbus,iproute2,procps"
SUITE = platform.freedesktop_os_release().get("VERSION_CODENAME", "stable")
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "trusswatch"


def mirror():
    """The mirror of this computer's release in apt."""
    sources = ["apt-get", "indextargets", "--format", "$(RELEASE) $(COMPONENT) $(REPO_URI)", "Created-By: Packages"]
    for line in subprocess.run(sources, capture_output=True, text=True, check=True).stdout.splitlines():
        release, component, place = line.split()
        if (release, component) == (SUITE, "main"):
            return place
    raise RuntimeError(f"apt has no source of {SUITE} main")


def tree(packages=PACKAGES, architecture=None):
    """Its directory; of another architecture, whose programs this machine must be able to run."""
    tree = CACHE / "-".join(["debian", SUITE, *packages.split(","), *([architecture] if architecture else [])])
    if not tree.exists():
        making = tree.with_suffix(".part")
        shutil.rmtree(making, ignore_errors=True)
        making.parent.mkdir(parents=True, exist_ok=True)
        other = [f"--arch={architecture}"] if architecture else []
        command = ["debootstrap", "--variant=minbase", f"--include={packages}", *other, SUITE, making, mirror()]
        subprocess.run(command, stdout=sys.stderr, check=True)
        making.rename(tree)
    return tree


if __name__ == "__main__":
    print(tree())
