"""Reads MCAP files with the reader of PyPI, finished or not: of each its messages and their bytes, as JSON."""

import json
import sys

from mcap.exceptions import EndOfFile
from mcap.records import Message
from mcap.stream_reader import StreamReader


def read(path):
    messages = size = 0
    with open(path, "rb") as file:
        try:
            for record in StreamReader(file, validate_crcs=True).records:
                if isinstance(record, Message):
                    messages += 1
                    size += len(record.data)
        except EndOfFile:
            pass
    return [messages, size]


print(json.dumps({path: read(path) for path in sys.argv[1:]}))
