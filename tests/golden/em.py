"""Golden values of the suite `em`: maximum likelihood over dense weights, by EM in numpy.

One skill of two DoFs with a Bernstein basis of four functions, thirty demonstrations, irregular samples, gaps, and
the second DoF missing altogether in seven of them. The full 8 x 8 covariance is estimated, nothing is scaled and no
subspace is used. Run: python3 tests/golden/em.py > tests/golden/em.json
"""
import json
import sys
from math import comb

import numpy as np

DOFS, FUNCTIONS, COUNT, STEPS = 2, 4, 30, 20000
random = np.random.default_rng(20260123)


def basis(s):
    n = FUNCTIONS - 1
    return np.stack([comb(n, k) * s**k * (1 - s) ** (n - k) for k in range(FUNCTIONS)], -1)


mean = random.normal(size=DOFS * FUNCTIONS)
half = random.normal(size=(DOFS * FUNCTIONS, DOFS * FUNCTIONS)) * 0.5
noise = np.array([0.05, 0.2])
demonstrations, rows, values, kinds = [], [], [], []
for number in range(COUNT):
    t = np.sort(random.uniform(0, 2, 20 + number % 5))
    s = (t - t[0]) / (t[-1] - t[0])
    psi = basis(s)
    w = mean + half @ random.normal(size=mean.size)
    y = np.stack([psi @ w[d * FUNCTIONS:(d + 1) * FUNCTIONS] for d in range(DOFS)])
    y += noise[:, None] * random.normal(size=y.shape)
    seen = random.uniform(size=y.shape) < 0.8
    seen[:, [0, -1]] = True
    start = random.integers(2, 10)
    seen[0, start:start + 9] = False
    if number % 4 == 3:
        seen[1] = False
    demonstrations.append({
        "t_s": t.tolist(),
        "values": [[v if k else None for v, k in zip(y[d], seen[d])] for d in range(DOFS)],
    })
    phi = np.concatenate([np.kron(np.eye(DOFS)[d], psi[seen[d]]) for d in range(DOFS)])
    rows.append(phi)
    values.append(np.concatenate([y[d][seen[d]] for d in range(DOFS)]))
    kinds.append(np.concatenate([np.full(seen[d].sum(), d) for d in range(DOFS)]))

m, c, v = np.zeros(mean.size), np.eye(mean.size), np.ones(DOFS)
for _ in range(STEPS):
    log, means, covariances, left = 0.0, [], [], np.zeros(DOFS)
    for phi, y, kind in zip(rows, values, kinds):
        total = phi @ c @ phi.T + np.diag(v[kind])
        gain = np.linalg.solve(total, phi @ c).T
        off = y - phi @ m
        log -= 0.5 * (off @ np.linalg.solve(total, off) + np.linalg.slogdet(2 * np.pi * total)[1])
        w, p = m + gain @ off, c - gain @ phi @ c
        means.append(w)
        covariances.append(p)
        square = (y - phi @ w) ** 2 + np.einsum("ij,jk,ik->i", phi, p, phi)
        left += np.bincount(kind, square, DOFS)
    means = np.array(means)
    m = means.mean(0)
    c = (means - m).T @ (means - m) / COUNT + np.mean(covariances, 0)
    v = left / np.sum([np.bincount(kind, minlength=DOFS) for kind in kinds], 0)

json.dump({
    "demonstrations": demonstrations, "log_likelihood": log, "mean": m.tolist(),
    "covariance": c.tolist(), "noise": v.tolist(),
}, sys.stdout)
print()
