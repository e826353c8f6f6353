"""Holds instruction counts to those recorded and to what was asked: compare.py COUNTS (what `run` printed).

A count may not grow by more than 5 % unnoticed: record the new one in instructions.txt if it is meant.
"""

import pathlib
import sys

GROWTH = 0.05
CLOCK_HZ = 64e6
UPDATES_HZ = 50


def read(path):
    lines = pathlib.Path(path).read_text().splitlines()
    pairs = (line.split() for line in lines if line and not line.startswith("#"))
    return {name: int(count) for name, count in pairs}


def asked(counts):
    """What, its figure and the most it may be."""
    acquisition = counts["pipeline_second_4_channels"]
    bank = (counts["bank_step_3x8_r16_6dof"] * UPDATES_HZ + acquisition) / CLOCK_HZ
    mixture = (counts["mixture_step_3x1_r16_6dof"] * UPDATES_HZ + acquisition) / CLOCK_HZ
    return [
        ("one conditioning at r = 29, instructions", counts["condition_r29"], 7500),
        ("recognition with 1 hypothesis a skill and acquisition, of the clock", mixture, 0.10),
        ("recognition with 8 hypotheses a skill and acquisition, of the clock", bank, 0.50),
        ("one scan of four channels, instructions", counts["scan_4_channels"], 700),
    ]


def main():
    counts = read(sys.argv[1])
    recorded = read(pathlib.Path(__file__).with_name("instructions.txt"))
    wrong = []
    if counts.keys() != recorded.keys():
        wrong.append(f"counted and recorded names differ: {sorted(counts.keys() ^ recorded.keys())}")
    for name in counts.keys() & recorded.keys():
        change = counts[name] / recorded[name] - 1
        if change > GROWTH:
            wrong.append(f"{name} grew by {change:.0%}, from {recorded[name]} to {counts[name]} instructions")
        if change < -GROWTH:
            print(f"{name} fell by {-change:.0%} to {counts[name]}: record it in instructions.txt")
    if not wrong:
        for what, figure, most in asked(counts):
            print(f"{what}: {figure:.4g} (asked: at most {most:.4g})")
            if figure > most:
                wrong.append(f"{what}: {figure:.4g}, more than the {most:.4g} that were asked")
    for sentence in wrong:
        print(sentence, file=sys.stderr)
    sys.exit(bool(wrong))


main()
