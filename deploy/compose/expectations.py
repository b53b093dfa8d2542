"""Expectations: wait for them, require them, and print them in a table."""

import time

START = time.monotonic()


class Late(Exception):
    """An expected event did not happen in time."""


def until(what, seconds, probe):
    """Calls `probe` until it returns a true value, and returns that value."""
    end = time.monotonic() + seconds
    while not (answer := probe()):
        if time.monotonic() > end:
            raise Late(f"{what}: not within {seconds} s")
        time.sleep(0.02)
    return answer


def require(holds, otherwise):
    if not holds:
        raise AssertionError(otherwise)


def seen(what, *details):
    """Reports a fulfilled expectation at once."""
    print(f"   {time.monotonic() - START:5.1f} s  ok: {': '.join([what, *map(str, details)])}", flush=True)


class Table:
    """One row: action, expectation and observation."""

    HEADING = ("what", "expected", "seen")

    def __init__(self):
        self.rows = []

    def row(self, what, expected, saw):
        self.rows.append((what, expected, saw))
        seen(what, saw)

    def fail(self, error):
        self.rows.append(("FAILED", "", (str(error).splitlines() or [repr(error)])[-1][:120]))

    def print(self):
        rows = [self.HEADING, *self.rows]
        widths = [max(len(row[column]) for row in rows) for column in range(3)]
        line = "  ".join("─" * width for width in widths)
        print(line)
        for number, row in enumerate(rows):
            print("  ".join(text.ljust(width) for text, width in zip(row, widths)).rstrip())
            if number == 0:
                print(line)
        print(line, flush=True)
