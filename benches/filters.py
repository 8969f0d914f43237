#!/usr/bin/env python3
"""Filters beside SimpleITK's in one run: seconds, and the largest difference as a part of the scan's range.

    python3 -m venv env && env/bin/pip install numpy SimpleITK
    cargo build --release -p bregma-field --example filter
    env/bin/python benches/filters.py SCAN... [--rounds N] [--folder FOLDER]

SCAN is read by SimpleITK and given to both as NRRD. Gaussians of SimpleITK that can be equalled: DiscreteGaussian, whose kernel is the same (maximum
error 1e-5; wider than its default kernel of 32 samples), its variance in mm². SmoothingRecursiveGaussian is another: a recursive filter of float64
that stands for the continuous Gaussian; its difference is printed beside. Times are those of the filter alone, medians.
"""

import argparse
import pathlib
import shutil
import statistics
import subprocess
import time

import numpy as np
import SimpleITK as sitk


def discrete(sigma):
    def run(image):
        filter = sitk.DiscreteGaussianImageFilter()
        filter.SetVariance(sigma**2)
        filter.SetMaximumError(1e-5)
        filter.SetMaximumKernelWidth(500)
        filter.SetUseImageSpacing(True)
        return filter.Execute(sitk.Cast(image, sitk.sitkFloat32))

    return run


def diffusion(iterations, conductance, step):
    return lambda image: sitk.GradientAnisotropicDiffusion(
        sitk.Cast(image, sitk.sitkFloat32), timeStep=step, conductanceParameter=conductance, numberOfIterations=iterations
    )


def median(radius):
    return lambda image: sitk.Median(image, [radius] * 3)


def ours(program, scan, out, rounds, words):
    done = subprocess.run([program, scan, out, str(rounds), *map(str, words)], capture_output=True, text=True, check=True)
    times = [float(line) for line in done.stdout.split()]
    return statistics.median(times), sitk.GetArrayFromImage(sitk.ReadImage(str(out)))


def theirs(work, image, rounds):
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        result = work(image)
        times.append(time.perf_counter() - begin)
    return statistics.median(times), sitk.GetArrayFromImage(result)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scans", type=pathlib.Path, nargs="+")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path("/tmp/filters"))
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    program = pathlib.Path(__file__).parent.parent / "target/release/examples/filter"
    scan, out = args.folder / "scan.nrrd", args.folder / "out.nrrd"
    print("| scan | filter | bregma, s | SimpleITK, s | times as fast | largest difference, of the range |\n|---|---|---|---|---|---|")
    worst, slowest = 0.0, float("inf")
    for path in args.scans:
        image = sitk.ReadImage(str(path))
        sitk.WriteImage(image, str(scan))
        samples = sitk.GetArrayFromImage(image)
        extent = float(samples.max()) - float(samples.min())
        shortest = min(image.GetSpacing())
        step = shortest / 16
        rows = [
            (f"Gaussian {2 * shortest:.3g} mm", ["gaussian", 2 * shortest], discrete(2 * shortest)),
            (f"Gaussian {0.5 * shortest:.3g} mm", ["gaussian", 0.5 * shortest], discrete(0.5 * shortest)),
            ("median 1", ["median", 1], median(1)),
            ("median 2", ["median", 2], median(2)),
            (f"diffusion 5, 1, {step:.3g}", ["diffusion", 5, 1, step], diffusion(5, 1.0, step)),
            (f"diffusion 2, 3, {step:.3g}", ["diffusion", 2, 3, step], diffusion(2, 3.0, step)),
        ]
        for name, words, work in rows:
            own_s, own = ours(program, scan, out, args.rounds, words)
            itk_s, itk = theirs(work, image, args.rounds)
            off = float(np.abs(own.astype(np.float64) - itk.astype(np.float64)).max()) / extent
            worst, slowest = max(worst, off), min(slowest, itk_s / own_s)
            print(f"| {path.name} | {name} | {own_s:.3f} | {itk_s:.3f} | {itk_s / own_s:.1f} | {off:.1e} |", flush=True)
        _, own = ours(program, scan, out, 1, ["gaussian", 2 * shortest])
        itk_s, itk = theirs(lambda image: sitk.SmoothingRecursiveGaussian(sitk.Cast(image, sitk.sitkFloat32), 2 * shortest), image, args.rounds)
        off = float(np.abs(own - itk).max()) / extent
        print(f"| {path.name} | (recursive Gaussian {2 * shortest:.3g} mm) | | {itk_s:.3f} | | {off:.1e} |", flush=True)
    print(f"largest difference {worst:.1e} of the range; at least {slowest:.1f} times as fast")
    shutil.rmtree(args.folder)
    assert worst < 1e-4


if __name__ == "__main__":
    main()
