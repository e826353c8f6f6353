"""The simulated arm and its controller by NumPy and SciPy, for tests/suites/teleoperation.rs. Run: python3 teleoperation.py

The arm's axes and lengths are written down here again (product of exponentials), not read from its description.
Writes, beside itself:
  arm_poses.csv        24 postures (seven angles, radians) and the tool's position there (metres)
  teleoperation.csv    every 5th sample at 100 Hz of a minimum-jerk path of 1.6 s (metres, one axis) and of the tool
                       behind it: the controller's sampled transfer function with the default gains, by scipy.signal.lfilter
Made with NumPy 2.4.6 and SciPy 1.17.1.
"""

import pathlib

import numpy as np
from scipy import linalg, signal

HERE = pathlib.Path(__file__).parent
Y, Z = np.array([0.0, 1, 0]), np.array([0.0, 0, 1])
# Axis and a point on it, arm stretched upwards.
AXES = [
    (Z, (0, 0, 0.15)),
    (Y, (0, 0, 0.33)),
    (Z, (0, 0, 0.55)),
    (Y, (0.03, 0, 0.76)),
    (Z, (0, 0, 0.96)),
    (Y, (0, 0, 1.17)),
    (Z, (0, 0, 1.23)),
]
TOOL = np.array([0, 0, 1.33, 1])
LIMITS = np.array([(-2.9, 2.9), (-2, 2), (-2.9, 2.9), (0.35, 2.6), (-2.9, 2.9), (-1.9, 2.1), (-2.9, 2.9)])
P, I, D, DT = 15.0, 0.5, 0.05, 0.01


def tool(angles):
    """Product of exponentials (Brockett 1984): exp(S1 q1) ... exp(S7 q7) M."""
    pose = np.eye(4)
    for (axis, point), angle in zip(AXES, angles):
        twist = np.zeros((4, 4))
        twist[:3, :3] = np.cross(np.eye(3), axis)
        twist[:3, 3] = -np.cross(axis, point)
        pose = pose @ linalg.expm(twist * angle)
    return (pose @ TOOL)[:3]


def follow(desired):
    """x[k+1] = x[k] + dt (P e[k] + I sum e dt) + D (e[k] - e[k-1]), as a filter from desired to x; at rest before."""
    # Open loop G(z) = C(z) / (z - 1), C = P dt + I dt^2 z / (z - 1) + D (1 - 1/z), all times z (z - 1).
    numerator = np.polyadd(np.polyadd([P * DT, -P * DT, 0], [I * DT**2, 0, 0]), D * np.array([1, -2, 1]))
    denominator = np.polymul([1, 0], np.polymul([1, -1], [1, -1]))
    closed = np.polyadd(denominator, numerator)
    return signal.lfilter(np.r_[0, numerator], closed, desired)


rng = np.random.default_rng(7)
postures = rng.uniform(LIMITS[:, 0], LIMITS[:, 1], (22, 7))
postures = np.vstack([np.array([0, 0, 0, 2.1, 0, 0.6, 0]), LIMITS[:, 1], postures])
poses = np.array([tool(p) for p in postures])
np.savetxt(HERE / "arm_poses.csv", np.c_[postures, poses], delimiter=",", fmt="%.17g",
           header=",".join([f"q{k}" for k in range(7)] + list("xyz")), comments="")

u = np.clip(np.arange(200) * DT / 1.6, 0, 1)
path = u**3 * (10 - 15 * u + 6 * u**2)
np.savetxt(HERE / "teleoperation.csv", np.c_[path, follow(path)][::5], delimiter=",", fmt="%.17g",
           header="desired,tool", comments="")
