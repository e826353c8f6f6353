"""Python packages' answers for tests/suites/baselines.rs. Run: python3 baselines.py

Writes baselines.json beside itself:
  mixture     gmr: log density, and mean and covariance of a Gaussian mixture given two of its four numbers
  markov      hmmlearn: log-likelihood and state probabilities of a left-to-right model that ends in its last state
  semi_markov the same over durations that are not geometric, by listing every cut (itertools)
  warp        dtaidistance: multivariate DTW distances
  dmp         movement_primitives: a DMP with given weights; SciPy's solution of its differential equation
Made with NumPy 2.4.6, SciPy 1.17.1, gmr 2.0.3, hmmlearn 0.3.3, dtaidistance 2.5.1, movement_primitives 0.9.1.
"""

import itertools
import json
import pathlib

import numpy as np
from dtaidistance import dtw_ndim
from gmr import GMM
from hmmlearn import _hmmc
from movement_primitives.dmp import DMP
from scipy import integrate, stats

rng = np.random.default_rng(11)


def spd(n):
    a = rng.normal(size=(n, n))
    return a @ a.T + 0.3 * np.eye(n)


def mixture():
    priors = np.array([0.5, 0.2, 0.3])
    means = rng.normal(size=(3, 4))
    covariances = np.array([spd(4) for _ in range(3)])
    gmm = GMM(n_components=3, priors=priors, means=means, covariances=covariances)
    seen = np.array([0.4, -0.8])
    # The package returns the conditional mixture of the numbers not given: 0 and 2.
    rest = gmm.condition(np.array([1, 3]), seen)
    mean = rest.priors @ rest.means
    apart = rest.means - mean
    covariance = sum(p * (c + np.outer(a, a)) for p, c, a in zip(rest.priors, rest.covariances, apart))
    point = np.array([0.1, 0.4, -0.3, -0.8])
    density = float(gmm.to_probability_density(point[None])[0])
    assert np.allclose(mean, gmm.predict(np.array([1, 3]), seen[None])[0])
    return dict(priors=priors, means=means, covariances=covariances, seen=seen, mean=mean, covariance=covariance,
                point=point, log_density=np.log(density))


def emissions(states, instants):
    means = np.cumsum(rng.normal(1.0, 0.5, size=(states, 2)), axis=0)
    covariances = [spd(2) for _ in range(states)]
    points = np.linspace(means[0], means[-1], instants) + rng.normal(0, 0.4, size=(instants, 2))
    logs = np.array([stats.multivariate_normal(m, c).logpdf(points) for m, c in zip(means, covariances)])
    return dict(means=means, covariances=np.array(covariances), points=points), logs


def markov(states=3, instants=12):
    model, logs = emissions(states, instants)
    stay = np.array([0.7, 0.8, 1.0])
    transitions = np.diag(stay) + np.diag(1 - stay[:-1], 1)
    start = np.array([1.0, 0, 0])
    frames = logs.T.copy()
    frames[-1, :-1] = -1e300  # it must have arrived
    log_likelihood, forward = _hmmc.forward_log(start, transitions, frames)
    backward = _hmmc.backward_log(start, transitions, frames)
    gamma = np.exp(forward + backward - log_likelihood).T
    return dict(**model, log_emission=logs, stay=stay, log_likelihood=log_likelihood, occupancy=gamma)


def semi_markov(states=3, instants=9):
    _, logs = emissions(states, instants)
    durations = rng.normal(size=(states, instants))
    total, occupancy, lasting = 0.0, np.zeros((states, instants)), np.zeros((states, instants))
    for cuts in itertools.combinations(range(1, instants), states - 1):
        edges = (0, *cuts, instants)
        score = 0.0
        for q in range(states):
            score += durations[q, edges[q + 1] - edges[q] - 1] + logs[q, edges[q]:edges[q + 1]].sum()
        weight = np.exp(score)
        total += weight
        for q in range(states):
            occupancy[q, edges[q]:edges[q + 1]] += weight
            lasting[q, edges[q + 1] - edges[q] - 1] += weight
    return dict(log_emission=logs, log_duration=durations, log_likelihood=np.log(total), occupancy=occupancy / total,
                lasting=lasting / total)


def warp():
    pairs = []
    for n, m in ((7, 9), (10, 10), (1, 1), (1, 4)):
        one, other = rng.normal(size=(n, 3)), rng.normal(size=(m, 3))
        pairs.append(dict(one=one, other=other, distance=dtw_ndim.distance(one, other)))
    return pairs


def dmp(weights=np.array([3.0, -8, 15, 20, -10, 4, 9, -6, 2, 5])):
    start, goal = 0.3, -0.25
    package = DMP(n_dims=1, execution_time=1.0, dt=1e-4, n_weights_per_dim=len(weights), smooth_scaling=True)
    package.set_weights(weights)
    package.configure(start_y=np.array([start]), goal_y=np.array([goal]))
    _, path = package.open_loop(step_function="rk4")
    term = package.forcing_term

    def rate(t, state):
        z = term.phase(t)
        force = float(np.squeeze(term.forcing_term(z)))
        pull = 6.25 * (goal - state[0]) - state[1] - 6.25 * (goal - start) * z
        return [state[1], 25 * pull + force]

    exact = integrate.solve_ivp(rate, (0, 1), [start, 0], "DOP853", t_eval=np.linspace(0, 1, 11), rtol=1e-11, atol=1e-12)
    return dict(weights=weights, start=start, goal=goal, package=path[::1000, 0], exact=exact.y[0])


def plain(value):
    if isinstance(value, dict):
        return {key: plain(v) for key, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value


answers = dict(mixture=mixture(), markov=markov(), semi_markov=semi_markov(), warp=warp(), dmp=dmp())
lines = [f'"{key}": {json.dumps(plain(value))}' for key, value in answers.items()]
(pathlib.Path(__file__).parent / "baselines.json").write_text("{\n" + ",\n".join(lines) + "\n}\n")
