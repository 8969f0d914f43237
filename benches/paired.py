#!/usr/bin/env python3
"""Two programs' frames in turn, so that what else the machine does falls on both: how much longer the second takes.

    benches/paired.py OLD_PROGRAM NEW_PROGRAM SCAN [SCAN] [--rounds N] [--size N] [--frames N]

For each mode and backend the two draw the orbit by turns; of each round the medians of both are compared, and the median of their ratios is
printed with the smallest and the largest: 1.00 is as fast as before.
"""

import argparse
import json
import os
import statistics
import subprocess
import tempfile

MODES = {
    "iso": ["--mode", "iso"],
    "shadows": ["--mode", "iso", "--shadows"],
    "overlay": ["--mode", "overlay"],
    "dvr": ["--mode", "dvr"],
    "dvr exact": ["--mode", "dvr", "--integrator", "exact"],
    "transparent": ["--mode", "iso", "--opacity", "0.5"],
    "max": ["--mode", "max"],
    "xray": ["--mode", "xray"],
    "spline": ["--mode", "iso", "--reconstruction", "spline"],
}


def median_ms(program, scans, backend, mode, args):
    command = [program, "bench", *scans, "--backend", backend, "--json", "--size", str(args.size), "--frames", str(args.frames), *MODES[mode]]
    done = subprocess.run(command, capture_output=True, text=True)
    return json.loads(done.stdout)["median_ms"] if done.returncode == 0 else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("scans", nargs="+")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--frames", type=int, default=4)
    parser.add_argument("--backends", nargs="+", default=["cpu", "gpu"])
    args = parser.parse_args()
    os.environ.setdefault("XDG_RUNTIME_DIR", tempfile.gettempdir())
    print(f"{'mode':<14}{'backend':<9}{'old ms':>9}{'new ms':>9}{'new/old':>9}   (least to most of {args.rounds} rounds)")
    for backend in args.backends:
        for mode in MODES:
            pairs = [[median_ms(p, args.scans, backend, mode, args) for p in (args.old, args.new)] for _ in range(args.rounds)]
            if any(None in pair for pair in pairs):
                print(f"{mode:<14}{backend:<9}  not drawn")
                continue
            ratios = sorted(new / old for old, new in pairs)
            old, new = (statistics.median(column) for column in zip(*pairs))
            print(f"{mode:<14}{backend:<9}{old:>9.2f}{new:>9.2f}{statistics.median(ratios):>9.3f}   ({ratios[0]:.3f} to {ratios[-1]:.3f})", flush=True)


if __name__ == "__main__":
    main()
