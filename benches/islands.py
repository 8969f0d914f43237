#!/usr/bin/env python3
"""Islands of bone of a scan of 512³ samples, beside scipy.ndimage.label and SimpleITK.ConnectedComponent in one run: seconds, and whether all are one.

    python3 -m venv env && env/bin/pip install numpy scipy SimpleITK
    cargo build --release -p bregma-parts --example islands
    env/bin/python benches/islands.py DATA [--side N] [--noise HU] [--iso V] [--rounds N] [--folder FOLDER]

DATA is the folder that BREGMA_DATA names: the straight series of its phantom, there and back along k until it has N slices, with noise where that
is asked for. All times are from samples in memory to numbers in memory, the comparison with the isovalue among them; the program's are of whole
rounds in one process, and so are the others'. What is written into FOLDER (/tmp/islands) is removed.
"""

import argparse
import pathlib
import shutil
import statistics
import subprocess
import time

import numpy as np
import scipy.ndimage
import SimpleITK as sitk


def made(data, side, noise):
    reader = sitk.ImageSeriesReader()
    reader.SetFileNames(reader.GetGDCMSeriesFileNames(str(data / "phantom-philips/straight")))
    slices = sitk.GetArrayFromImage(reader.Execute())
    count = len(slices)
    there_and_back = [n if n < count else 2 * count - 2 - n for n in (k % (2 * count - 2) for k in range(side))]
    samples = slices[there_and_back, :side, :side].astype(np.int16)
    if noise:
        samples = (samples + np.random.default_rng(1).normal(0, noise, samples.shape)).astype(np.int16)
    return np.ascontiguousarray(samples)


def timed(work, rounds):
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - begin)
    return statistics.median(times), result


def itk(image, iso):
    return sitk.ConnectedComponent(sitk.BinaryThreshold(image, float(iso), 32767.0, 1, 0), False)


def same(ours, others, count):
    """Whether two numberings name the same islands: as many pairs of numbers as there are islands, and the outside."""
    pairs = np.unique(ours.astype(np.int64).ravel() * (int(others.max()) + 1) + others.ravel())
    return len(pairs) == count + 1 and len(np.unique(ours)) == count + 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--side", type=int, default=512)
    parser.add_argument("--noise", type=float, default=0.0)
    parser.add_argument("--iso", type=float, default=226.0)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path("/tmp/islands"))
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    samples = made(args.data, args.side, args.noise)
    image = sitk.GetImageFromArray(samples)
    scan, numbers = args.folder / "scan.nrrd", args.folder / "numbers.nii"
    sitk.WriteImage(image, str(scan))
    program = pathlib.Path(__file__).parent.parent / "target/release/examples/islands"
    done = subprocess.run([program, scan, str(args.iso), str(args.rounds), numbers], capture_output=True, text=True, check=True)
    rows = [line.split() for line in done.stdout.splitlines()]
    found, labelled = (statistics.median(float(row[n]) for row in rows) for n in (0, 1))
    count = int(rows[0][2])
    scipy_s, by_scipy = timed(lambda: scipy.ndimage.label(samples >= args.iso), args.rounds)
    itk_s, by_itk = timed(lambda: itk(image, args.iso), args.rounds)
    print(f"{samples.shape} samples, {int((samples >= args.iso).sum())} of bone, {count} islands, {args.rounds} rounds, medians")
    print(f"bregma                        {labelled:.2f} s, of these the islands without their label map {found:.2f} s")
    print(f"scipy.ndimage.label           {scipy_s:.2f} s, {scipy_s / labelled:.1f} times as long")
    print(f"SimpleITK.ConnectedComponent  {itk_s:.2f} s, {itk_s / labelled:.1f} times as long")
    if count <= 65535:
        ours = sitk.GetArrayFromImage(sitk.ReadImage(str(numbers)))
        equal = [by_scipy[1] == count and same(ours, by_scipy[0], count), same(ours, sitk.GetArrayFromImage(by_itk), count)]
        print(f"the same islands as scipy's: {equal[0]}; as SimpleITK's: {equal[1]}")
        assert all(equal)
    shutil.rmtree(args.folder)


if __name__ == "__main__":
    main()
