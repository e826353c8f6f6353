"""Runs the scenarios on the virtual air: `scenarios.py [--packets 3000] [name...]`; `--list` names them."""

import argparse
import asyncio
import logging
import sys
import tempfile
import time
import traceback
from pathlib import Path

import armband
import bonds
import hostile
import keeping
import links
import session
import streams
import trouble
from radio import Air

# Per scenario; a machine under load takes many times the usual second.
LIMIT_S = 120.0


async def run(scenario):
    with tempfile.TemporaryDirectory() as folder:
        air = Air(Path(folder))
        try:
            await asyncio.wait_for(scenario(air), scenario.limit_s if hasattr(scenario, "limit_s") else LIMIT_S)
            for wearable in air.wearables:
                assert wearable.is_running() or wearable.stopped, f"the wearable ended: {wearable.lines[-12:]}"
                assert not wearable.said(".*panicked"), wearable.lines[-12:]
                if not {"answers_phy", "interval"} & wearable.oddities.keys():
                    assert not wearable.said("notice (Restarted|NotGranted|RequestFailed)"), wearable.lines
        except BaseException:
            for program in air.programs:
                print(f"  the {program.name} said:", *program.lines[-15:], sep="\n    ")
            raise
        finally:
            await air.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--packets", type=int, default=3000, help="stream packets that must come without a gap")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    streams.PACKETS = options.packets
    # Bumble warns of what the scenarios do on purpose.
    logging.disable(logging.CRITICAL)
    chapters = (links, streams, bonds, keeping, trouble, session, armband, hostile)
    scenarios = {scenario.__name__: scenario for chapter in chapters for scenario in chapter.SCENARIOS}
    if options.list:
        print("\n".join(scenarios))
        return 0
    unknown = set(options.names) - set(scenarios)
    if unknown:
        print(f"no scenario {', '.join(sorted(unknown))}; --list names them", file=sys.stderr)
        return 2
    failed = []
    chosen = options.names or list(scenarios)
    for name in chosen:
        started = time.monotonic()
        try:
            asyncio.run(run(scenarios[name]))
            print(f"ok {name} ({time.monotonic() - started:.1f} s)", flush=True)
        except (Exception, asyncio.CancelledError) as error:  # Whatever it is, the scenario failed.
            failed.append(name)
            traceback.print_exception(error, limit=-4)
            print(f"FAILED {name}: {error!r}", flush=True)
    print(f"{len(chosen) - len(failed)} passed, {len(failed)} failed")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
