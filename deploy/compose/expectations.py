"""What is expected and what was seen: waited for, required, printed in a table."""

import time

START = time.monotonic()


class Late(Exception):
    """Something did not happen in time."""


def until(what, seconds, probe):
    """Calls `probe` until it returns something true, and returns that."""
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
    """Reports at once what is as expected."""
    print(f"   {time.monotonic() - START:5.1f} s  ok: {': '.join([what, *map(str, details)])}", flush=True)


class Table:
    """What was done, what was expected of it and what was seen."""

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
