"""Reference solutions of the discrete-time algebraic Riccati equation, from SciPy.

    X = A'XA - A'XB (R + B'XB)^-1 B'XA + Q

Run with `python riccati_scipy.py > riccati_scipy.json`. The numbers are committed; the test of the
plant's own solver (crates/plant/tests/riccati_reference.rs) reads them. Matrices are lists of rows.
"""

import json
import sys

import numpy as np
import scipy
from scipy.linalg import expm, solve_discrete_are


def double_integrator():
    """One mass on no spring, 0.1 s steps: the textbook case."""
    step = 0.1
    a = np.array([[1.0, step], [0.0, 1.0]])
    b = np.array([[step**2 / 2], [step]])
    return a, b, np.eye(2), np.array([[0.5]])


def unstable_random():
    """Dense, with eigenvalues outside the unit circle."""
    rng = np.random.default_rng(7)
    a = rng.normal(size=(6, 6)) * 0.6
    b = rng.normal(size=(6, 2))
    q = np.diag(rng.uniform(0.1, 2.0, size=6))
    return a, b, q, np.diag([0.3, 2.0])


def oscillators(frequencies_hz, step):
    """Lightly damped modes in energy coordinates (omega * eta, d eta / dt), zero-order hold."""
    modes = len(frequencies_hz)
    rng = np.random.default_rng(11)
    shapes = rng.normal(size=(modes, 8)) * 2e-3
    a = np.zeros((2 * modes, 2 * modes))
    b = np.zeros((2 * modes, 8))
    for mode, frequency in enumerate(frequencies_hz):
        omega = 2 * np.pi * frequency
        damping = 0.025 / omega + 0.0025 * omega
        block = np.zeros((3, 3))
        block[0, 1] = omega
        block[1, :] = [-omega, -2 * damping * omega, 1.0]
        discrete = expm(block * step)
        rows = slice(2 * mode, 2 * mode + 2)
        a[rows, rows] = discrete[:2, :2]
        b[rows, :] = discrete[:2, 2:] @ shapes[mode : mode + 1, :]
    return a, b


TOWER_LIKE_HZ = [1.70, 1.70, 2.52, 4.79, 4.9, 7.1, 8.0, 8.3, 9.9, 11.2, 12.7, 15.0]


def tower_like_controller():
    """Twelve modes, eight actuators, 1 ms: the shape of the tower's controller."""
    a, b = oscillators(TOWER_LIKE_HZ, 1e-3)
    return a, b, np.eye(24), 5e-8 * np.eye(8)


def tower_like_filter():
    """The dual problem: (A', C') with white forces and gage noise."""
    a, b = oscillators(TOWER_LIKE_HZ, 1e-3)
    rng = np.random.default_rng(13)
    gages = np.zeros((16, 24))
    gages[:, 0::2] = rng.normal(size=(16, 12)) * 1e-4
    noise = np.diag((5 * np.where(np.arange(16) % 2 == 0, 0.9e-6, 3.05e-6)) ** 2)
    return a.T, gages.T, b @ b.T * 1e3, noise


def case(name, matrices):
    a, b, q, r = matrices
    x = solve_discrete_are(a, b, q, r)
    residual = a.T @ x @ a - x + q - a.T @ x @ b @ np.linalg.solve(r + b.T @ x @ b, b.T @ x @ a)
    relative = float(np.abs(residual).max() / np.abs(x).max())
    lists = {key: value.tolist() for key, value in zip("abqrx", (a, b, q, r, x))}
    return {"name": name, "relative_residual": relative, **lists}


CASES = [double_integrator, unstable_random, tower_like_controller, tower_like_filter]

document = {
    "solver": f"scipy {scipy.__version__} scipy.linalg.solve_discrete_are",
    "cases": [case(make.__name__, make()) for make in CASES],
}
json.dump(document, sys.stdout, indent=None)
sys.stdout.write("\n")
