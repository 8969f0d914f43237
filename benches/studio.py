#!/usr/bin/env python3
"""Times studio light: wall time a sample, and to a root mean square noise of 2/255 and 1/255 of the picture.

    python3 benches/studio.py target/release/bregma [SCAN:ISO]

The scene is the demo's skull A at 256 samples (made if no scan is named), 512 × 512, isovalue 226, azimuth −35°, elevation 10°, field of view 25°, one
lamp upper left, an even sky, a sweep, up to 5 bounces. Reading the scan is timed alone and taken off. Then the same by the processor and by the GPU, be it a
software driver: of these what further samples take, so that compiling shaders is not counted. Each figure is the least of three: nothing makes a computer faster than
it is. Beside it stand the load of the machine and processor seconds: on cores that others use wall times are no measure.
"""
import json
import os
import resource
import subprocess
import sys
import tempfile
import time

SCENE = {
    "lamps": [{"azimuth_deg": -45, "elevation_deg": 40, "distance": 4, "size_deg": 25, "color": "ffffff", "strength": 1.0}],
    "sky": {"above": "ffffff", "below": "ffffff", "strength": 0.2},
    "ground": {"sweep": {"color": "959595"}},
    "bounces": 5,
}
SIZE = 512


def timed(command):
    """Least wall and processor seconds of three runs, and what the last one told."""
    best = [float("inf")] * 2
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        begun = time.perf_counter()
        told = subprocess.run(command, check=True, capture_output=True, text=True).stderr
        wall = time.perf_counter() - begun
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        best = [min(best[0], wall), min(best[1], spent)]
    return best, told.strip().replace("note: ", "")


def main():
    program, *scans = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        if scans:
            scan, iso = scans[0].rsplit(":", 1)
        else:
            subprocess.run([program, "demo", "--size", "256", "--out", folder], check=True, capture_output=True)
            scan, iso = os.path.join(folder, "a.nrrd"), "226"
        light = os.path.join(folder, "light.json")
        with open(light, "w", encoding="utf-8") as file:
            json.dump(SCENE, file)
        view = [program, "render", scan, "--iso", iso, "--orbit=-35,10", "--fov", "25", "--size", f"{SIZE}x{SIZE}"]
        out = ["--out", os.path.join(folder, "picture.png")]
        print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
        (reading, _), _ = timed([*view, "--backend", "cpu", *out])
        print("| | wall s | µs wall a sample | processor s | told |\n|---|---|---|---|---|")
        for what in (["--samples", "1"], ["--samples", "64"], ["--even", "--noise", "2"], ["--even", "--noise", "1"]):
            (wall, spent), told = timed([*view, "--studio", light, *what, *out])
            samples = int(told.split(" samples")[0].split()[-1])
            each = f"{1e6 * (wall - reading) / (samples * SIZE * SIZE):.2f}"
            print(f"| {' '.join(what)} | {wall:.2f} | {each} | {spent:.2f} | {told} |", flush=True)

        print("\n| --backend | µs wall a further sample | processor µs |\n|---|---|---|")
        for backend in ("cpu", "gpu"):
            lit = [*view, "--backend", backend, "--studio", light]
            try:
                few, many = [timed([*lit, "--samples", str(n), *out])[0] for n in (1, 17)]
            except subprocess.CalledProcessError as error:
                print(f"| {backend} | {error.stderr.strip()} | |")
                continue
            wall, spent = [1e6 * (b - a) / (16 * SIZE * SIZE) for a, b in zip(few, many)]
            print(f"| {backend} | {wall:.2f} | {spent:.2f} |", flush=True)


if __name__ == "__main__":
    main()
