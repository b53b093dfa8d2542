"""Makes the Debian that machines begin with, once, and prints its path."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

PACKAGES = "systemd,systemd-sysv,dbus,iproute2,procps"
MIRROR = "http://deb.debian.org/debian"


def suite():
    """The host's own release, so that what is built here runs there."""
    release = dict(line.split("=", 1) for line in Path("/etc/os-release").read_text().splitlines() if "=" in line)
    return release.get("VERSION_CODENAME", "stable").strip('"')


def bootstrap():
    """The disk that all machines begin with; made once and kept."""
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "trusswatch"
    tree = cache / f"debian-{suite()}-{PACKAGES.replace(',', '-')}"
    if not tree.exists():
        making = tree.with_suffix(".part")
        shutil.rmtree(making, ignore_errors=True)
        making.parent.mkdir(parents=True, exist_ok=True)
        command = ["debootstrap", "--variant=minbase", f"--include={PACKAGES}", suite(), making, MIRROR]
        subprocess.run(command, stdout=sys.stderr, check=True)
        making.rename(tree)
    return tree


if __name__ == "__main__":
    print(bootstrap())
