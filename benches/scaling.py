#!/usr/bin/env python3
"""How the time of a frame grows with the scan, the picture and the threads; what a new isovalue, shadows, an overlay and memory cost.

    python3 -m venv peers && peers/bin/pip install matplotlib
    peers/bin/python benches/scaling.py target/release/bregma 128/a.nrrd:226 256/a.nrrd:226 512/a.nrrd:226 1024/a.nrrd:226 --pair 256/b.nrrd:226 \\
        --chart docs/scaling.svg
    peers/bin/python benches/scaling.py target/release/bregma Cranium.nhdr:226 … 512/a.nrrd:226 --pair 512/b.nrrd:226 --modes

Every figure is by `bregma bench`: the median frame of the orbit, solver `exact`, shaded. The scans are the same object sampled ever finer, as
by `bregma demo --size N`; `--pair` is drawn over the scan of the same folder. Figures that are compared are measured one after the other.
"""
import argparse
import json
import os
import statistics
import subprocess

PICTURES, THREADS = (256, 512, 1024, 2048), (1, 2)
ROUNDS = 3
# Modes that go on behind the first opaque surface, and what more they are asked for with; the further level is a tenth of the range higher.
BEHIND = {
    "transparent": ("transparent", []),
    "transparent, two levels": ("transparent", ["--shell", "SHELL"]),
    "max": ("max", []),
    "mean": ("mean", []),
    "xray": ("xray", []),
    "dvr": ("dvr", []),
}


def name_of(scan):
    return os.path.join(*scan[0].split(os.sep)[-2:])


def run(program, *arguments):
    return json.loads(subprocess.run([program, *arguments], check=True, capture_output=True, text=True).stdout)


def bench(program, scans, backend, size=512, threads=2, mode="iso", more=()):
    values = [text for scan in scans for text in ("--iso", scan[1])]
    options = ["--backend", backend, "--size", str(size), "--threads", str(threads), "--mode", mode, "--frames", "8", "--json", *more]
    return run(program, "bench", *(scan[0] for scan in scans), *values, *options)


def modes(program, scans, pair):
    """Frames of other modes over opaque ones, measured by turns: medians of the ratios; and slices with contours of a pair, in ms."""
    print("| scan | opaque, ms | " + " | ".join(BEHIND) + " |\n|---|---|" + "---|" * len(BEHIND))
    for scan in scans:
        low, high = run(program, "info", scan[0], "--json")["range"]
        shell = f"1:{float(scan[1]) + 0.1 * (high - low)},ffccaa,0.3"
        cells, opaque = [], []
        for mode, more in BEHIND.values():
            ratios = []
            for _ in range(ROUNDS):
                opaque.append(bench(program, [scan], "cpu")["median_ms"])
                options = [shell if option == "SHELL" else option for option in more]
                ratios.append(bench(program, [scan], "cpu", mode=mode, more=options)["median_ms"] / opaque[-1])
            cells.append(f"{statistics.median(ratios):.1f}")
        print("| " + " | ".join([name_of(scan), f"{statistics.median(opaque):.1f}", *cells]) + " |", flush=True)
    for other in pair:
        one = next(scan for scan in scans if os.path.dirname(scan[0]) == os.path.dirname(other[0]))
        slices = [bench(program, [one, other], "cpu", size=1024, mode="slice")["median_ms"] for _ in range(ROUNDS)]
        print(f"\nslices of {name_of(one)} and {name_of(other)} at 1024²: {statistics.median(slices):.1f} ms")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("scans", nargs="+", metavar="SCAN:ISO")
    parser.add_argument("--pair", metavar="SCAN:ISO", nargs="*", default=[])
    parser.add_argument("--chart", metavar="SVG")
    parser.add_argument("--modes", action="store_true", help="only what modes take that go on behind the first surface, against an opaque frame")
    args = parser.parse_args()
    scans, pair = ([tuple(text.rsplit(":", 1)) for text in texts] for texts in (args.scans, args.pair))
    if args.modes:
        modes(args.program, scans, pair)
        return

    print("| scan | backend | threads | " + " | ".join(f"{size}²" for size in PICTURES) + " | new isovalue, frames | with shadows, frames | memory beside the samples |")
    print("|---|---|---|" + "---|" * (len(PICTURES) + 3))
    curves = {}
    for scan in scans:
        info = run(args.program, "info", scan[0], "--json")
        samples = info["dims"][0] * info["dims"][1] * info["dims"][2] * {"u8": 1, "u16": 2, "i16": 2, "f32": 4}[info["type"]]
        for backend, threads in [("cpu", threads) for threads in THREADS] + [("gpu", 2)]:
            records = [bench(args.program, [scan], backend, size, threads) for size in PICTURES]
            times = [record["median_ms"] for record in records]
            at_512 = records[PICTURES.index(512)]
            fresh, beside = at_512["isovalue_change_ms"] / at_512["median_ms"], at_512["memory_bytes"] / samples - 1
            plain, shaded = (bench(args.program, [scan], backend, threads=threads, more=more)["median_ms"] for more in ((), ("--shadows",)))
            row = [name_of(scan), backend, str(threads), *(f"{time:.1f}" for time in times), f"{fresh:.2f}", f"{shaded / plain:.2f}", f"{100 * beside:.1f} %"]
            print("| " + " | ".join(row) + " |", flush=True)
            curves.setdefault((backend, threads), []).append((max(info["dims"]), times))
    if pair:
        print("\n| pair | backend | one, ms | other, ms | both in overlay, ms | overlay against the sum |\n|---|---|---|---|---|---|")
        for other in pair:
            one = next((scan for scan in scans if os.path.dirname(scan[0]) == os.path.dirname(other[0])), None)
            if one is None:
                parser.error(f"no SCAN lies in the folder of {other[0]}")
            for backend in ("cpu", "gpu"):
                a, b = (bench(args.program, [scan], backend)["median_ms"] for scan in (one, other))
                both = bench(args.program, [one, other], backend, mode="overlay")["median_ms"]
                print(f"| {name_of(one)}, {name_of(other)} | {backend} | {a:.1f} | {b:.1f} | {both:.1f} | {both / (a + b):.2f} |", flush=True)
    if args.chart:
        chart(args.chart, curves)


def chart(path, curves):
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "scaling"
    import matplotlib.pyplot

    figure, axes = matplotlib.pyplot.subplots(1, 2, figsize=(10, 4.2), sharey=True, layout="constrained")
    for (backend, threads), scans in curves.items():
        label = f"{backend}, {threads} thread{'s' if threads > 1 else ''}"
        axes[0].plot([side for side, _ in scans], [times[PICTURES.index(512)] for _, times in scans], "o-", label=label)
        finest_usual = min(scans, key=lambda scan: abs(scan[0] - 256))
        axes[1].plot(PICTURES, finest_usual[1], "o-", label=label)
    sides = [side for side, _ in scans]
    titles = "scan, samples along its longest side (picture 512²)", "picture, pixels along a side (scan 256³)"
    for axis, title, ticks in zip(axes, titles, (sides, PICTURES)):
        axis.set(xscale="log", yscale="log", xlabel=title)
        axis.set_xticks(ticks, [str(tick) for tick in ticks])
        axis.minorticks_off()
        axis.grid(True, alpha=0.3)
    axes[0].set_yticks([5, 10, 20, 50, 100, 200], ["5", "10", "20", "50", "100", "200"])
    axes[0].set_ylabel("ms for a frame")
    axes[0].legend()
    figure.savefig(path, metadata={"Date": None})


if __name__ == "__main__":
    main()
