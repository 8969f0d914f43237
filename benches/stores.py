#!/usr/bin/env python3
"""Stores of scans: how long converting takes and how much memory, how large they are, and what is off in them.

    python3 -m venv numbers && numbers/bin/pip install numpy
    numbers/bin/python benches/stores.py target/release/bregma skulls:512 SCAN:ISO … [--errors 2,8,16,32] [--surfaces 40] [--size 768] [--keep FOLDER]

A scan is a file, or one in no file (marbles:N, menger:N, skulls:N), with the isovalue to look at behind it. Of each kind of store the table has the
ratio to the samples, the speed of converting, the peak of memory, the PSNR of the samples that are read again, and what a picture at the isovalue
shows: depths that differ, in voxels (median, 99 of 100, most), and hits that are none or missing. `--surfaces W` keeps those within W of the isovalue.
"""
import argparse
import math
import os
import pathlib
import resource
import shutil
import subprocess
import tempfile
import time

import numpy as np


def run(*command):
    before = time.perf_counter()
    child = subprocess.Popen([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    out, err = child.communicate()
    took = time.perf_counter() - before
    if child.returncode:
        raise SystemExit(f"{' '.join(map(str, command))}: {err}")
    return took, out


def peak_mib(*command):
    """Runs a command by itself, so that what it used is what all children of this process used at most."""
    read, write = os.pipe()
    if os.fork() == 0:
        begun = time.perf_counter()
        code = subprocess.run([str(c) for c in command], stdout=subprocess.DEVNULL).returncode
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        os.write(write, f"{code} {time.perf_counter() - begun} {used.ru_maxrss / 1024} {used.ru_utime + used.ru_stime}".encode())
        os._exit(0)
    os.close(write)
    with os.fdopen(read) as pipe:
        code, seconds, mib, cpu = pipe.read().split()
    os.wait()
    if int(code):
        raise SystemExit(f"{' '.join(map(str, command))} failed")
    return float(seconds), float(mib), float(cpu)


def size(folder):
    return sum(file.stat().st_size for file in pathlib.Path(folder).rglob("*") if file.is_file())


def samples_of(program, source, folder):
    nrrd = folder / "samples.nrrd"
    run(program, "convert", source, nrrd)
    with open(nrrd, "rb") as file:
        head = b""
        while not head.endswith(b"\n\n"):
            head += file.readline()
        fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
        kind = {"uint8": "u1", "int16": "<i2", "uint16": "<u2", "float": "<f4"}[fields["type"]]
        return np.fromfile(file, kind), fields


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("scans", nargs="+")
    parser.add_argument("--errors", default="2,8,16,32")
    parser.add_argument("--surfaces", type=float, default=40)
    parser.add_argument("--size", type=int, default=768)
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--only-convert", action="store_true", help="of scans that do not fit into memory")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=args.keep) as folder:
        folder = pathlib.Path(folder)
        print("| scan | store | ratio | MB/s | CPU s | MiB | PSNR, dB | depths off, voxels: 50, 99, 100 % | hits more, fewer, of |")
        print("|---|---|---|---|---|---|---|---|---|")
        for word in args.scans:
            scan, iso = word.rsplit(":", 1)
            iso = float(iso)
            kinds = [("all", [])] + [(f"error {e}", ["--error", e]) for e in args.errors.split(",") if e]
            between = f"{iso - args.surfaces:g}..{iso + args.surfaces:g}"
            kinds += [(f"surfaces {between}", ["--surfaces", between]), (f"surfaces {between}, error 8", ["--surfaces", between, "--error", "8"])]
            truth = None
            if not args.only_convert:
                truth, fields = samples_of(args.program, scan, folder)
                spacing = min(math.dist((0, 0, 0), eval(v)) for v in fields["space directions"].replace(") (", ")|(").split("|"))
                truth_depth = depth(args, scan, iso, folder)
            for name, options in kinds:
                store = folder / "store.ome.zarr"
                shutil.rmtree(store, ignore_errors=True)
                seconds, mib, cpu = peak_mib(args.program, "convert", scan, store, *options)
                if truth is None:
                    raw = size_of_samples(args.program, scan)
                    print(f"| {scan} | {name} | {raw / size(store):.2f} | {raw / 1e6 / seconds:.0f} | {cpu:.1f} | {mib:.0f} | | | |", flush=True)
                    continue
                raw = truth.nbytes
                kept, _ = samples_of(args.program, store, folder)
                error = float(np.sqrt(np.mean((kept.astype(np.float64) - truth) ** 2)))
                psnr = "∞" if error == 0 else f"{20 * math.log10((float(truth.max()) - float(truth.min())) / error):.1f}"
                psnr = "" if "surfaces" in name else psnr
                there = depth(args, store, iso, folder)
                both = np.isfinite(there) & np.isfinite(truth_depth)
                off = np.abs(there[both] - truth_depth[both]) / spacing
                more, fewer = (np.isfinite(there) & ~both).sum(), (np.isfinite(truth_depth) & ~both).sum()
                quantiles = ", ".join(f"{v:.3g}" for v in np.quantile(off, [0.5, 0.99, 1])) if off.size else "none"
                print(f"| {scan} | {name} | {raw / size(store):.2f} | {raw / 1e6 / seconds:.0f} | {cpu:.1f} | {mib:.0f} | {psnr} | {quantiles} "
                      f"| {more}, {fewer}, {both.sum()} |", flush=True)


def size_of_samples(program, scan):
    import json
    return json.loads(run(program, "info", "--json", scan)[1])["bytes"]


def depth(args, scan, iso, folder):
    run(args.program, "render", scan, "--backend", "cpu", "--iso", iso, "--orbit", "35,12", "--size", f"{args.size}x{args.size}",
        "--depth", folder / "depth.npy", "--out", folder / "picture.png")
    return np.load(folder / "depth.npy")


if __name__ == "__main__":
    main()
