#!/usr/bin/env python3
"""The three-bar truss (Schmit 1960): weight and stress constraints over two cross-sections, with exact gradients.

Reads lines {"x": [...], "want_gradient": bool} until the end of input and answers one line each.
"""

import json
import math
import sys

R2 = math.sqrt(2.0)


def stresses(a, b):
    """Stresses of the bars under a load of 20, and their gradients: (value, [d/da, d/db])."""
    den = 2.0 * a * b + R2 * a * a
    d_den = [2.0 * b + 2.0 * R2 * a, 2.0 * a]
    numerators = [
        (20.0 * (R2 * a + b), [20.0 * R2, 20.0]),
        (20.0 * R2 * a, [20.0 * R2, 0.0]),
        (-20.0 * b, [0.0, -20.0]),
    ]
    for n, d_n in numerators:
        yield n / den, [(d_n[k] * den - n * d_den[k]) / den**2 for k in range(2)]


def evaluate(x, want_gradient):
    a, b = x
    constraints, gradients = [], []
    for s, d_s in stresses(a, b):
        constraints += [-s / 15.0 - 1.0, s / 20.0 - 1.0]  # compression, tension
        gradients += [[-d / 15.0 for d in d_s], [d / 20.0 for d in d_s]]
    return {
        "objective": 2.0 * R2 * a + b,
        "constraints": constraints,
        "gradient": [2.0 * R2, 1.0] if want_gradient else None,
        "constraint_gradients": gradients if want_gradient else None,
    }


for line in sys.stdin:
    question = json.loads(line)
    print(json.dumps(evaluate(question["x"], question["want_gradient"])), flush=True)
