"""From a table of measurements to the first named fault: the commands of the README and of crates/cli/walkthrough, as printed,
in a directory with the programs and the page's tables.
"""

import os
import subprocess

import pytest
import walkthrough
from conftest import LIMIT_S, PROGRAMS, ROOT

PAGE = "crates/cli/walkthrough"


class Here:
    """This computer, in a directory that looks like the repository after a build."""

    name = "here"

    def __init__(self, folder):
        self.folder = folder
        (folder / "target").mkdir()
        (folder / "target/release").symlink_to(PROGRAMS)
        (folder / PAGE).mkdir(parents=True)
        for file in (ROOT / PAGE).iterdir():
            (folder / PAGE / file.name).symlink_to(file)

    def try_to(self, *command):
        environment = {**os.environ, "HOME": str(self.folder)}
        return subprocess.run(command, cwd=self.folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              text=True, timeout=LIMIT_S)


@pytest.mark.parametrize("document", ["README.md", f"{PAGE}/README.md"])
def test_from_a_table_to_the_first_named_fault_as_printed(document, tmp_path):
    here = Here(tmp_path)
    steps = [step for step in walkthrough.steps((ROOT / document).read_text()) if step.computer == here.name]
    assert steps and all(step.printed for step in steps if step.kind == "command"), "a command whose output is not shown"
    for step in steps:
        walkthrough.follow(step, {here.name: here})
    drawn, shown = (tmp_path / "suspect.svg").read_text(), ROOT / PAGE / "suspect.svg"
    if os.environ.get("BLESS"):
        shown.write_text(drawn)
    assert drawn == shown.read_text(), "the page shows another picture; BLESS=1 rewrites it"


def test_tables_are_small_and_whole():
    tables = sorted((ROOT / PAGE).glob("*.csv"))
    assert sum(table.stat().st_size for table in tables) < 300_000
    for table in tables:
        header, *rows = table.read_text().splitlines()
        assert len(rows) >= 720 and {row.count(",") for row in rows} == {header.count(",")}
