"""SciPy's filters and a 2 kHz envelope, for tests/suites/semg.rs. Run: python3 semg_design.py

Writes, beside itself:
  semg_design.csv    kind, rate_hz, cutoff_hz, order or q, then the denominators' (a1, a2) of each section sorted
                     by a2 then a1 (padded with zeros to four), then H at 0.02, 0.31, 0.83 of Nyquist and at the cutoff
                     (real, imaginary)
  semg_2khz.csv      every 20th sample of the default chain's envelope (20 Hz high-pass, order 3 at 5 Hz), of the
                     75.5 ms mean and RMS, of the formula signal of signal_2khz (2 s)
Made with SciPy 1.17.1, NumPy 2.4.6.
"""

import csv
import pathlib

import numpy as np
from scipy import signal

HERE = pathlib.Path(__file__).parent
RATES = [200.0, 250.0, 500.0, 1000.0, 1111.0, 2000.0]
FRACTIONS = [0.02, 0.31, 0.83]


def row(kind, rate, cutoff, parameter, sos):
    poles = sorted(((s[4], s[5]) for s in sos), key=lambda a: (a[1], a[0]))
    poles += [(0.0, 0.0)] * (4 - len(poles))
    hz = [f * rate / 2 for f in FRACTIONS] + [cutoff]
    response = signal.sosfreqz(sos, worN=np.array(hz), fs=rate)[1]
    values = [v for pole in poles for v in pole] + [
        v for h in response for v in (h.real, h.imag)
    ]
    return [kind, rate, cutoff, parameter] + [repr(float(v)) for v in values]


def designs():
    for rate in RATES:
        for order in range(1, 9):
            for kind, cutoffs in (
                ("low", [5.0, 0.1 * rate, 0.45 * rate]),
                ("high", [20.0, 0.05 * rate, 0.45 * rate]),
            ):
                for cutoff in cutoffs:
                    sos = signal.butter(order, cutoff, kind, fs=rate, output="sos")
                    yield row(kind, rate, cutoff, order, sos)
        for line in (50.0, 60.0):
            for q in (2.0, 30.0):
                sos = signal.tf2sos(*signal.iirnotch(line, q, fs=rate))
                # At the line itself the response is a difference of equals: a neighbour is compared instead.
                yield row("notch", rate, line, q, sos)[:-2] + ["0.0", "0.0"]
        for cutoff in (0.5, 1.0, 5.0):
            r = np.exp(-2 * np.pi * cutoff / rate)
            g = (1 + r) / 2
            sos = np.array([[g, -g, 0, 1, -r, 0]])
            yield row("dc", rate, cutoff, 1, sos)


def signal_2khz():
    """A closed form, so that the test makes the same numbers: offset, drift, hum and bursts of tones."""
    t = np.arange(4000) / 2000.0
    burst = np.maximum(0.0, np.sin(2 * np.pi * 0.8 * t))
    carrier = sum(
        np.sin(2 * np.pi * f * t + 0.7 * k)
        for k, f in enumerate((41.3, 77.7, 103.9, 151.1, 223.3))
    )
    return 5.0 + 0.4 * t + 0.1 * np.sin(2 * np.pi * 50 * t) + burst * carrier


def envelopes():
    x = signal_2khz()
    y = signal.sosfilt(signal.butter(2, 20, "high", fs=2000, output="sos"), x - x[0])
    rectified = np.abs(y)
    low = signal.butter(3, 5, fs=2000, output="sos")
    butterworth, _ = signal.sosfilt(low, rectified, zi=signal.sosfilt_zi(low) * rectified[0])
    # 75.5 ms: 151 samples; before the start the first value, as the filters start settled.
    window = np.ones(151) / 151
    padded = np.r_[np.full(150, rectified[0]), rectified]
    mean = np.convolve(padded, window, "valid")
    rms = np.sqrt(np.convolve(padded**2, window, "valid"))
    return np.c_[butterworth, mean, rms][::20]


with open(HERE / "semg_design.csv", "w", newline="") as file:
    names = ["kind", "rate_hz", "cutoff_hz", "order"]
    names += [f"{a}_{k}" for k in range(4) for a in ("a1", "a2")]
    names += [f"{part}_{k}" for k in range(4) for part in ("re", "im")]
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(designs())
np.savetxt(HERE / "semg_2khz.csv", envelopes(), delimiter=",", fmt="%.12g",
           header="butterworth,mean,rms", comments="")
