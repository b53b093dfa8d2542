"""From a drawing to running diagnosers, as the README has it."""

import subprocess

from conftest import PROGRAMS, documented

NEW_AND_DEMO_S = 280


def test_a_bridge_is_drawn_up_diagnosed_and_studied_as_printed(tmp_path):
    commands = documented("structure").replace("./target/release", str(PROGRAMS))
    done = subprocess.run(["bash", "-ec", commands], cwd=tmp_path, capture_output=True, text=True, timeout=NEW_AND_DEMO_S)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert (tmp_path / "bridge/references/west.toml").is_file()
    # The demo's last table; its exit code says that nothing else was named.
    assert "verdict after" in done.stdout, done.stdout[-3000:]
