#!/usr/bin/env python3
"""Writes what clustering is tested against: adjusted_rand.csv (two groupings, their adjusted Rand index) and
mixture_points.csv (points of three overlapping groups; the first line holds the log-likelihood of the best mixture of
three Gaussians with one shared covariance). Needs numpy and scikit-learn 1.9."""

from pathlib import Path

import numpy as np
from sklearn.metrics import adjusted_rand_score
from sklearn.mixture import GaussianMixture

here = Path(__file__).parent
rng = np.random.default_rng(11)

pairs = [([0, 0, 1, 1], [1, 1, 0, 0]), ([0, 0, 1, 1], [0, 1, 0, 1]), ([0, 0, 0, 0], [3, 3, 3, 3]),
         ([0, 1, 2, 3], [3, 2, 1, 0]), ([0, 0, 0, 0], [0, 1, 2, 3]), ([0, 0, 1, 2], [0, 0, 1, 1])]
for n, a, b in [(20, 3, 3), (50, 4, 2), (150, 3, 3), (150, 3, 6), (7, 5, 5)]:
    one = rng.integers(0, a, n)
    other = np.where(rng.random(n) < 0.7, one, rng.integers(0, b, n))
    pairs.append((one.tolist(), other.tolist()))
with open(here / "adjusted_rand.csv", "w") as out:
    out.write("one,other,index\n")
    for one, other in pairs:
        text = [" ".join(map(str, grouping)) for grouping in (one, other)]
        out.write(f"{text[0]},{text[1]},{float(adjusted_rand_score(one, other))!r}\n")

root = np.array([[1.0, 0.0], [0.5, 0.8]])
centres = np.array([[0.0, 0.0], [4.0, 1.0], [1.0, 5.0]])
points = np.concatenate([centre + rng.standard_normal((40, 2)) @ root.T for centre in centres])
mixture = GaussianMixture(3, covariance_type="tied", reg_covar=0.0, tol=1e-12, max_iter=10000, n_init=20, random_state=0)
mixture.fit(points)
with open(here / "mixture_points.csv", "w") as out:
    out.write(f"log_likelihood,{float(mixture.score(points) * len(points))!r}\n")
    for x, y in points:
        out.write(f"{float(x)!r},{float(y)!r}\n")
