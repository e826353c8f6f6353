"""Runs the processes of tests/compare/run one after the other and prints medians, ratios and peak memory.

table.py PORTABLE NATIVE [--json] [--without-em]: the two builds of Tonus.
"""

import json
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).parent
REFERENCE = pathlib.Path(os.environ.get("TONUS_DATA", HERE / "../../../shared/data")) / "../reference"
TONUS = ["tonus", "tonus_native"]
PEERS = ["movement_primitives", "numpy_full", "numpy_latent"]
WORK = {
    "learn": "learn weights, mean, covariance",
    "em": "learn by EM over trajectories",
    "condition": "condition on one 3-DoF observation",
    "moments": "mean + std, 200 x 12",
    "recognise": "3 skills, 10 x 3 DoF: condition, posterior",
}
# Least ratios that the project asks of itself: (work, peer, ratio); and the most memory, MB.
TARGETS = [
    ("learn", "movement_primitives", 500),
    ("em", "movement_primitives", 500),
    ("condition", "movement_primitives", 1000),
    ("condition", "numpy_latent", 10),
    ("moments", "movement_primitives", 500),
    ("recognise", "numpy_latent", 50),
]
MOST_MB = 20
# Results may differ by this many standard deviations (posterior means and deviations), and by this in a log posterior:
# movement_primitives conditions on all DoFs, those not seen at a variance of 1e8, and subtracts 360 x 360 matrices.
AGREE = {"numpy_full": 1e-3, "numpy_latent": 1e-3, "movement_primitives": 1e-2}


def run(name, command):
    print(f"running {name}", file=sys.stderr)
    done = subprocess.run(command, stdout=subprocess.PIPE, check=True, text=True)
    return json.loads(done.stdout)


def difference(ours, theirs):
    """Largest difference of posterior means and deviations in posterior deviations, and of log posteriors."""
    ours, theirs = ours["results"], theirs["results"]
    worst = 0.0
    for name in ("mean", "std"):
        for a, b, std in zip(ours[name], theirs[name], ours["std"]):
            worst = max(worst, abs(a - b) / std)
    for a, b in zip(ours["log_posterior"], theirs["log_posterior"] or []):
        worst = max(worst, abs(a - b))
    return worst


def duration(seconds):
    if seconds is None:
        return "-"
    for unit, size in (("s", 1), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-6:.3g} us"


def line(cells):
    return "| " + " | ".join(cells) + " |"


def show(results, ratios, checks):
    columns = PEERS + TONUS
    print(line(["work (median)"] + columns))
    print(line(["---"] * (len(columns) + 1)))
    for work, words in WORK.items():
        print(line([words] + [duration(results[c]["seconds"].get(work)) for c in columns]))
    print(line(["peak memory"] + [f"{results[c]['peak_bytes'] / 1e6:.0f} MB" for c in columns]))
    print()
    print(line(["times faster", "than", "asked", "tonus", "tonus_native", ""]))
    print(line(["---"] * 6))
    for r in ratios:
        held = "holds" if r["tonus"] >= r["asked"] else "native only" if r["tonus_native"] >= r["asked"] else "missed"
        cells = [WORK[r["work"]], r["than"], str(r["asked"]), f"{r['tonus']:.0f}", f"{r['tonus_native']:.0f}", held]
        print(line(cells))
    memory = max(results[c]["peak_bytes"] for c in TONUS) / 1e6
    print(f"\nPeak memory of Tonus {memory:.1f} MB, at most {MOST_MB} asked: {'holds' if memory <= MOST_MB else 'missed'}.")
    for peer, worst in checks.items():
        print(f"Same results as {peer} within {worst:.1e} posterior standard deviations.")
    print(
        "tonus is the ordinary release build, tonus_native is built with -C target-cpu=native. One process after the"
        "\nother, one thread each. A Tonus model is learnt with all that inference needs: residual variance, labels, priors."
    )


def main():
    flags, builds = [a for a in sys.argv[1:] if a.startswith("--")], [a for a in sys.argv[1:] if a[0] != "-"]
    if set(flags) - {"--json", "--without-em"} or len(builds) != 2:
        sys.exit("usage: tests/compare/run [--json] [--without-em]")
    peer = lambda name: run(name, [sys.executable, HERE / "peers.py", name, REFERENCE])
    results = {name: peer(name) for name in PEERS}
    if "--without-em" not in flags:
        em = peer("movement_primitives_em")
        promp = results["movement_primitives"]
        promp["seconds"]["em"] = em["seconds"]["em"]
        promp["peak_bytes"] = max(promp["peak_bytes"], em["peak_bytes"])
    results |= {name: run(name, [build]) for name, build in zip(TONUS, builds)}

    checks = {peer: difference(results["tonus"], results[peer]) for peer in PEERS}
    for peer, worst in checks.items():
        if not worst <= AGREE[peer]:
            sys.exit(f"the results of {peer} differ by {worst:.1e} posterior standard deviations: the times compare nothing")
    ratios = []
    for work, than, asked in TARGETS:
        theirs = results[than]["seconds"].get(work)
        ours = [results[name]["seconds"].get(work) for name in TONUS]
        if theirs and all(ours):
            times = dict(zip(TONUS, (theirs / own for own in ours)))
            ratios.append({"work": work, "than": than, "asked": asked, **times})
    if "--json" in flags:
        for result in results.values():
            del result["results"]
        print(json.dumps({"implementations": results, "ratios": ratios, "differences": checks}, indent=2))
    else:
        show(results, ratios, checks)


main()
