"""Distributed fault diagnosis for adaptive structures, on arrays of NumPy.

Nothing is computed in Python: results are the same bits as those of the programs. Whatever cannot be used is a
`ValueError` with the program's message.
"""

from ._trusswatch import (
    Detector,
    Diagnosers,
    Diagnosis,
    Judge,
    LearnedModule,
    Module,
    Plant,
    Readings,
    Scenario,
    Study,
    learn,
    read_recording,
)

__all__ = [
    "Detector",
    "Diagnosers",
    "Diagnosis",
    "Judge",
    "LearnedModule",
    "Module",
    "Plant",
    "Readings",
    "Scenario",
    "Study",
    "learn",
    "read_recording",
]
