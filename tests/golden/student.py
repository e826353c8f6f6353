"""SciPy's multivariate Student-t, for tests/suites/promp/student.rs. Run: python3 student.py

Writes student.json beside itself: cases of numbers y_i = mean_i + loading_i z + noise_i, jointly a Student-t of
`freedom` degrees of freedom and covariance loading loading^T + diag(noise). All but the last number are
observed. `log_density` is SciPy's joint log density of them; `mean` and `variance` are those of the last
number's noiseless part given them, from integrals of SciPy's joint density over it (no conditional formula).
`long` are log densities of many independent standardised numbers.
Made with SciPy 1.17.1, NumPy 2.4.6.
"""

import json
import pathlib

import numpy as np
from scipy import integrate, stats

RNG = np.random.default_rng(20260301)


def density(freedom, mean, covariance):
    scale = covariance * (freedom - 2) / freedom
    return stats.multivariate_t(loc=mean, shape=scale, df=freedom)


def case(freedom, rank, observed):
    loading = RNG.normal(size=(observed + 1, rank)) * RNG.uniform(0.2, 3.0)
    mean = RNG.normal(size=observed + 1)
    noise = np.append(RNG.uniform(0.01, 0.5, size=observed), 0.0)
    covariance = loading @ loading.T + np.diag(noise)
    spread = RNG.choice([0.3, 1.0, 3.0])  # what is seen may be nearer or further than expected
    seen = mean[:-1] + spread * np.linalg.cholesky(covariance[:-1, :-1]) @ RNG.normal(size=observed)
    joint = density(freedom, mean, covariance)
    part = density(freedom, mean[:-1], covariance[:-1, :-1])
    log_density = float(part.logpdf(seen))

    # x = centre + width tan(angle), so that the tails are inside the interval.
    centre = mean[-1] + covariance[-1, :-1] @ np.linalg.solve(covariance[:-1, :-1], seen - mean[:-1])
    width = np.sqrt(covariance[-1, -1])

    def moment(power):
        def integrand(angle):
            step = width * np.tan(angle)
            log_ratio = joint.logpdf(np.append(seen, centre + step)) - log_density
            return np.exp(log_ratio) * step**power * width / np.cos(angle) ** 2

        edge = np.pi / 2
        points = np.linspace(-edge, edge, 33)
        pieces = zip(points[:-1], points[1:])
        return sum(integrate.quad(integrand, a, b, epsabs=1e-13, epsrel=1e-12)[0] for a, b in pieces)

    assert abs(moment(0) - 1) < 1e-9
    first = moment(1)
    return {
        "freedom": freedom,
        "loading": loading.tolist(),
        "mean": mean.tolist(),
        "noise": noise[:-1].tolist(),
        "seen": seen.tolist(),
        "log_density": log_density,
        "posterior_mean": float(centre + first),
        "posterior_variance": float(moment(2) - first**2),
    }


def long(freedom, count):
    # y_i = sqrt(variance) * value_i, no latent part.
    values = RNG.normal(size=count) * 1.5
    joint = density(freedom, np.zeros(count), np.eye(count))
    return {"freedom": freedom, "seen": values.tolist(), "log_density": float(joint.logpdf(values))}


cases = [case(f, r, k) for f in (3.0, 4.5, 9.0, 27.0, 300.0) for r, k in ((1, 1), (2, 3), (4, 6))]
longs = [long(f, k) for f in (2.1, 3.5, 27.0, 1000.0) for k in (50, 301)]
here = pathlib.Path(__file__).parent
(here / "student.json").write_text(json.dumps({"cases": cases, "long": longs}, indent=0) + "\n")
