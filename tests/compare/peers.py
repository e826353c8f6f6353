"""Times one way of doing the work of tests/src/work.rs in Python: peers.py NAME REFERENCE-FOLDER.

    movement_primitives     its ProMP class; it conditions on all DoFs only, so those not seen get a variance of 1e8
    movement_primitives_em  its EM over trajectories (`imitate` with its defaults), once
    numpy_full              the textbook's D K x D K matrices, written with care
    numpy_latent            the same latent form as Tonus, batch formulas in latent coordinates

Prints medians in seconds, a few results for the cross-check, and peak memory as one JSON object.
"""

import csv
import json
import pathlib
import resource
import sys
import time

import numpy as np

FUNCTIONS, RIDGE, SAMPLES = 30, 1e-8, 200
UNSEEN = 1e8


def read(folder):
    stated = json.loads((folder / "reference.json").read_text())
    names = stated["convention"]["dofs"]
    with open(folder / "demos.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    values = np.array([[float(row[name]) for name in names] for row in rows])
    labels = np.array([int(float(row["label"])) for row in rows[::SAMPLES]])
    return values.reshape(-1, SAMPLES, len(names)), labels, stated


def median(work, repeats):
    work()
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return sorted(seconds)[repeats // 2]


class Basis:
    def __init__(self):
        self.centres = np.linspace(0, 1, FUNCTIONS)
        self.twice_width = 2 * -1 / (8 * FUNCTIONS**2 * np.log(0.7))

    def __call__(self, phases):
        psi = np.exp(-((np.asarray(phases)[..., None] - self.centres) ** 2) / self.twice_width)
        return psi / psi.sum(-1, keepdims=True)


BASIS = Basis()
PHASES = np.linspace(0, 1, SAMPLES)


def learn(demos):
    """Weights, mean and covariance by shared normal equations."""
    psi = BASIS(PHASES)
    stacked = demos.transpose(1, 0, 2).reshape(SAMPLES, -1)
    weights = np.linalg.solve(psi.T @ psi + RIDGE * np.eye(FUNCTIONS), psi.T @ stacked)
    weights = weights.reshape(FUNCTIONS, len(demos), -1).transpose(1, 2, 0).reshape(len(demos), -1)
    return weights, weights.mean(0), np.cov(weights.T)


def scales(centred):
    blocks = centred.reshape(len(centred), -1, FUNCTIONS)
    return np.repeat(np.sqrt((blocks**2).mean((0, 2))), FUNCTIONS)


def loading(centred, rank):
    """Directions in which the (scaled) weights differ, and the coordinates along them."""
    scale = scales(centred)
    u, s, vt = np.linalg.svd(centred / scale, full_matrices=False)
    directions = vt[:rank].T * scale[:, None]
    return directions.reshape(-1, FUNCTIONS, rank), u[:, :rank] * s[:rank]


def log_density(residual, factor):
    whitened = np.linalg.solve(factor, residual)
    logarithms = np.log(np.diag(factor)).sum()
    return -0.5 * whitened @ whitened - logarithms - 0.5 * len(residual) * np.log(2 * np.pi)


def normalised(log_joint):
    largest = log_joint.max()
    return log_joint - largest - np.log(np.exp(log_joint - largest).sum())


def step(mean, covariance, rows, residual, noise):
    """Conditions on several numbers at once; log density of them."""
    seen = rows @ covariance
    spread = seen @ rows.T + noise
    factor = np.linalg.cholesky(spread)
    gain = np.linalg.solve(spread, seen).T
    return mean + gain @ residual, covariance - gain @ seen, log_density(residual, factor)


def full(demos, labels, stated):
    weights, mean, covariance = learn(demos)
    dofs = demos.shape[2]
    one = stated["one_observation"]
    some, noise, values = len(one["dofs"]), np.diag(one["R_diag"]), np.array(one["y"])

    def rows(psi):
        h = np.zeros((some, dofs * FUNCTIONS))
        for dof in range(some):
            h[dof, dof * FUNCTIONS : (dof + 1) * FUNCTIONS] = psi
        return h

    def condition():
        h = rows(BASIS(one["s"]))
        seen = h @ covariance
        gain = np.linalg.solve(seen @ h.T + noise, seen).T
        return mean + gain @ (values - h @ mean), covariance - gain @ seen

    after_mean, after = condition()

    def moments():
        psi = BASIS(PHASES)
        blocks = after.reshape(dofs, FUNCTIONS, dofs, FUNCTIONS)
        variance = [((psi @ blocks[d, :, d]) * psi).sum(1) for d in range(dofs)]
        return psi @ after_mean.reshape(dofs, FUNCTIONS).T, np.sqrt(np.maximum(np.array(variance).T, 0))

    classes = [weights[labels == label] for label in sorted(set(labels))]
    priors = [(own.mean(0), np.cov(own.T)) for own in classes]
    sequence = stated["mixture_pos3"]
    sequence_noise = np.diag(sequence["R_diag"])

    def recognise():
        beliefs, log_joint = list(priors), np.full(len(priors), -np.log(len(priors)))
        for phase, seen in zip(sequence["s"], sequence["y"]):
            h = rows(BASIS(phase))
            for skill, (m, c) in enumerate(beliefs):
                m, c, told = step(m, c, h, seen - h @ m, sequence_noise)
                beliefs[skill] = m, c
                log_joint[skill] += told
            posterior = normalised(log_joint)
        return posterior

    seconds = {
        "learn": median(lambda: learn(demos), 21),
        "condition": median(condition, 101),
        "moments": median(moments, 101),
        "recognise": median(recognise, 21),
    }
    return seconds, *moments(), recognise()


def latent(demos, labels, stated):
    weights, mean, _ = learn(demos)
    dofs = demos.shape[2]
    one = stated["one_observation"]
    some, noise, values = len(one["dofs"]), np.diag(one["R_diag"]), np.array(one["y"])

    def learn_latent():
        weights = learn(demos)[0]
        return loading(weights - weights.mean(0), len(demos) - 1)

    lines, coordinates = learn_latent()
    lines = lines * (coordinates.std(0) * np.sqrt(len(demos) / (len(demos) - 1)))
    rank = len(demos) - 1
    identity, means = np.eye(rank), mean.reshape(dofs, FUNCTIONS)

    def condition():
        psi = BASIS(one["s"])
        rows = psi @ lines[:some]
        gain = np.linalg.solve(rows @ rows.T + noise, rows).T
        return gain @ (values - means[:some] @ psi), identity - gain @ rows

    z, after = condition()

    def moments():
        psi = BASIS(PHASES)
        rows = psi @ lines
        variance = ((rows @ after) * rows).sum(2)
        return psi @ (means + lines @ z).T, np.sqrt(np.maximum(variance.T, 0))

    members = [labels == label for label in sorted(set(labels))]
    skill_means = [weights[own].mean(0) for own in members]
    within = weights - np.array(skill_means)[np.searchsorted(sorted(set(labels)), labels)]
    shared, coordinates = loading(within, len(demos) - len(members))
    priors = [np.cov(coordinates[own].T) for own in members]
    skill_means = [m.reshape(dofs, FUNCTIONS) for m in skill_means]
    sequence = stated["mixture_pos3"]
    sequence_noise = np.diag(sequence["R_diag"])

    def recognise():
        beliefs = [(np.zeros(len(prior)), prior) for prior in priors]
        log_joint = np.full(len(priors), -np.log(len(priors)))
        for phase, seen in zip(sequence["s"], sequence["y"]):
            psi = BASIS(phase)
            rows = psi @ shared[:some]
            for skill, (z, p) in enumerate(beliefs):
                residual = seen - skill_means[skill][:some] @ psi - rows @ z
                z, p, told = step(z, p, rows, residual, sequence_noise)
                beliefs[skill] = z, p
                log_joint[skill] += told
            posterior = normalised(log_joint)
        return posterior

    seconds = {
        "learn": median(learn_latent, 21),
        "condition": median(condition, 501),
        "moments": median(moments, 101),
        "recognise": median(recognise, 101),
    }
    return seconds, *moments(), recognise()


def movement_primitives(demos, labels, stated):
    from movement_primitives.promp import ProMP

    dofs = demos.shape[2]

    def learn_promp():
        promp = ProMP(dofs, FUNCTIONS)
        # A copy of the times at each call: it normalises the caller's in place.
        weights = np.array([promp.weights(PHASES.copy(), demo, RIDGE) for demo in demos])
        return promp.from_weight_distribution(weights.mean(0), np.cov(weights.T))

    promp = learn_promp()
    one = stated["one_observation"]
    some = len(one["dofs"])
    # DoFs not seen are where they are expected, so that they pull at nothing.
    values, noise = learn(demos)[1].reshape(dofs, FUNCTIONS) @ BASIS(one["s"]), np.full(dofs, UNSEEN)
    values[:some], noise[:some] = one["y"], one["R_diag"]
    noise = np.diag(noise)

    def condition():
        return promp.condition_position(values, noise, one["s"], 1.0)

    after = condition()

    def moments():
        return after.mean_trajectory(PHASES.copy()), np.sqrt(after.var_trajectory(PHASES.copy()))

    seconds = {
        "learn": median(learn_promp, 3),
        "condition": median(condition, 51),
        "moments": median(moments, 7),
        "recognise": None,
    }
    return seconds, *moments(), None


def movement_primitives_em(demos, labels, stated):
    from movement_primitives.promp import ProMP

    promp = ProMP(demos.shape[2], FUNCTIONS)
    start = time.perf_counter()
    promp.imitate([PHASES.copy() for _ in demos], list(demos))
    return {"em": time.perf_counter() - start}, None, None, None


PEERS = {
    "movement_primitives": movement_primitives,
    "movement_primitives_em": movement_primitives_em,
    "numpy_full": full,
    "numpy_latent": latent,
}


def main():
    name, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    seconds, mean, std, log_posterior = PEERS[name](*read(folder))
    flat = lambda values: None if values is None else np.asarray(values).T.ravel().tolist()
    print(
        json.dumps(
            {
                "seconds": seconds,
                "results": {"mean": flat(mean), "std": flat(std), "log_posterior": flat(log_posterior)},
                "peak_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
            }
        )
    )


if __name__ == "__main__":
    main()
