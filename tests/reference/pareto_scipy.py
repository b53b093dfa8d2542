"""Reference values of the generalised Pareto distribution, from SciPy.

Run with `python pareto_scipy.py > pareto_scipy.json`. The numbers are committed; the test of the tail
fit (crates/study/tests/pareto_reference.rs) reads them. SciPy's `c` is the shape; it fits by maximum
likelihood.
"""

import json
import sys

import numpy as np
import scipy
from scipy.stats import genpareto

SHAPES = [-0.4, -0.1, 0.0, 0.1, 0.5, 1.2]
SCALE = 3e-4


def values(shape):
    x = SCALE * np.array([0.01, 0.5, 1.0, 2.0, 8.0, 300.0])
    survival = np.array([0.9, 0.5, 1e-2, 1e-5, 1e-9])
    return {
        "shape": shape,
        "scale": SCALE,
        "x": x.tolist(),
        "survival_of_x": genpareto.sf(x, shape, scale=SCALE).tolist(),
        "survival": survival.tolist(),
        "x_of_survival": genpareto.isf(survival, shape, scale=SCALE).tolist(),
    }


def sample(shape, size, seed):
    x = genpareto.rvs(shape, scale=1.0, size=size, random_state=seed)
    fitted, _, scale = genpareto.fit(x, floc=0)
    likelihood = float(genpareto.logpdf(x, fitted, scale=scale).sum())
    return {
        "true_shape": shape,
        "x": x.tolist(),
        "likeliest": {"shape": fitted, "scale": scale, "log_likelihood": likelihood},
    }


document = {
    "solver": f"scipy {scipy.__version__} scipy.stats.genpareto",
    "values": [values(shape) for shape in SHAPES],
    "samples": [
        sample(shape, size, 100 * size + int(10 * shape))
        for size in (50, 150, 500)
        for shape in (-0.2, 0.0, 0.2, 0.5)
    ],
}
json.dump(document, sys.stdout, indent=None)
sys.stdout.write("\n")
