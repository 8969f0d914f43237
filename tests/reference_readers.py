#!/usr/bin/env python3
"""Compares what bregma reads with what SimpleITK, pydicom, nibabel and numpy read from the same files, and the time that it takes.

    python3 -m venv env && env/bin/pip install numpy SimpleITK pydicom nibabel
    env/bin/pip install vtk tifffile imagecodecs pillow itk-ioscanco pylibjpeg pylibjpeg-openjpeg pylibjpeg-libjpeg
    env/bin/python tests/reference_readers.py FOLDER-OF-SCANS [PROGRAM]

FOLDER-OF-SCANS is the one that BREGMA_DATA names (see docs/guide.md); PROGRAM is target/release/bregma unless it is given. Every file is
converted to NRRD by bregma and compared: dims, type, spacing, origin, directions, and the values of 10,000 random samples. The reference of
the tilted series is the affine of its slices' positions, as SimpleITK makes it orthonormal. Then the same for forms that the folder does not
have (reference_forms.py). Exits with 1 if anything differs.
"""
import itertools
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import nibabel
import numpy as np
import pydicom
import SimpleITK as sitk

from reference_forms import forms

SAMPLES = 10_000
# SimpleITK takes spacing and direction of NIfTI from float32 by a decomposition of its own: equal to about a float32 rounding.
TOLERANCE_MM = 1e-5
TYPES = {"u8": "uint8", "i16": "int16", "u16": "uint16", "f32": "float32"}


def bregma(program, *words):
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"bregma {words}: {done.stderr}")
    return done.stdout


def nrrd(path):
    """The samples of an attached raw NRRD of three axes, [k, j, i]."""
    data = path.read_bytes()
    end = data.index(b"\n\n") + 2
    fields = dict(line.split(": ", 1) for line in data[:end].decode().splitlines() if ": " in line)
    kind = {"float": "float32"}.get(fields["type"], fields["type"])
    sizes = [int(n) for n in fields["sizes"].split()]
    return np.frombuffer(data[end:], np.dtype(kind).newbyteorder("<")).reshape(sizes[::-1])


def affine(spacing, origin, direction):
    m = np.eye(4)
    m[:3, :3] = np.array(direction).reshape(3, 3) * np.array(spacing)
    m[:3, 3] = origin
    return m


def of_itk(image):
    samples = sitk.GetArrayFromImage(image)
    return samples, affine(image.GetSpacing(), image.GetOrigin(), image.GetDirection()), samples.dtype


def slices(folder):
    """pydicom's slices in the order of their positions along the normal."""
    sets = [pydicom.dcmread(f) for f in sorted(folder.iterdir())]
    i, j = np.array(sets[0].ImageOrientationPatient, float).reshape(2, 3)
    return sorted(sets, key=lambda s: np.dot(np.cross(i, j), np.array(s.ImagePositionPatient, float)))


def of_positions(folder):
    sets = slices(folder)
    first, last = (np.array(s.ImagePositionPatient, float) for s in (sets[0], sets[-1]))
    i, j = np.array(sets[0].ImageOrientationPatient, float).reshape(2, 3)
    dj, di = map(float, sets[0].PixelSpacing)
    m = np.eye(4)
    # Directions are unit vectors, whatever their digits leave of that.
    i, j = i / np.linalg.norm(i), j / np.linalg.norm(j)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = i * di, j * dj, (last - first) / (len(sets) - 1), first
    values = np.stack([s.pixel_array * float(s.RescaleSlope) + float(s.RescaleIntercept) for s in sets])
    return values, m, sets[0].pixel_array.dtype


def series(folder):
    reader = sitk.ImageSeriesReader()
    reader.SetFileNames(reader.GetGDCMSeriesFileNames(str(folder)))
    return reader.Execute()


def of_nibabel(path):
    image = nibabel.load(path)
    samples = np.asanyarray(image.dataobj).transpose(2, 1, 0)
    return samples, np.diag([-1, -1, 1, 1]) @ image.affine, samples.dtype


def of_numpy(files, kind, dims, spacing):
    samples = np.concatenate([np.fromfile(f, kind) for f in files]).reshape(dims[::-1])
    return samples, np.diag([*spacing, 1.0]), samples.dtype


def references(data):
    """Each scan with its readers: name to a function that gives samples or values, index to LPS mm, and the stored type."""
    for path in sorted(data.rglob("*.nii.gz")):
        # Without a form nibabel turns the axes to RAS, ITK takes them as LPS, and so do we.
        header = nibabel.load(path).header
        placed = int(header["sform_code"]) > 0 or int(header["qform_code"]) > 0
        readers = {"SimpleITK": lambda p=path: of_itk(sitk.ReadImage(str(p)))}
        if placed:
            readers["nibabel"] = lambda p=path: of_nibabel(p)
        yield path, readers
    for path in sorted(data.rglob("*.nhdr")):
        if path.stem == "quarter":
            # ITK refuses spacings in a space without directions.
            files = [path.with_name(f"quarter.{n}") for n in range(1, 94)]
            yield path, {"numpy": lambda f=files: of_numpy(f, "<i2", [64, 64, 93], [3.2, 3.2, 1.5])}
            continue
        yield path, {"SimpleITK": lambda p=path: of_itk(sitk.ReadImage(str(p)))}
    for path in sorted(data.rglob("*_uint8.raw")):
        dims = [int(n) for n in path.stem.split("_")[1].split("x")]
        yield path, {"numpy": lambda p=path, d=dims: of_numpy([p], "u1", d, [1.0, 1.0, 1.0])}
    phantom = data / "phantom-philips"
    yield phantom / "straight", {
        "SimpleITK": lambda: of_itk(series(phantom / "straight")),
        "pydicom": lambda: of_positions(phantom / "straight"),
    }
    yield phantom / "tilted", {"pydicom": lambda: of_positions(phantom / "tilted")}


def compare(program, path, readers, folder):
    out = pathlib.Path(folder) / "out.nrrd"
    bregma(program, "convert", path, out)
    info = json.loads(bregma(program, "info", path, "--json"))
    ours = nrrd(out)
    faults = []
    if ours.dtype != TYPES[info["type"]] or list(ours.shape[::-1]) != info["dims"]:
        faults.append("what is written is not what info says")
    values = ours.astype(float) * info["slope"] + info["intercept"]
    for name, read in readers.items():
        theirs, to_world, kind = read()
        if theirs.shape != ours.shape:
            faults.append(f"{name}: dims {theirs.shape} {ours.shape}")
            continue
        at = np.random.default_rng(1).integers(0, ours.size, SAMPLES)
        wrong = int(np.sum(values.flat[at] != theirs.astype(float).flat[at]))
        # Corners of the box, so that an error of a step counts as often as it is made.
        corners = np.array([[a, b, c, 1] for a in (0, ours.shape[2] - 1) for b in (0, ours.shape[1] - 1) for c in (0, ours.shape[0] - 1)])
        off = np.abs(corners @ (np.array(info["to_world"]) - to_world).T).max()
        # SimpleITK rescales DICOM on the way in.
        same_type = kind.newbyteorder("=") == ours.dtype or (info["format"], name) == ("DICOM", "SimpleITK")
        print(f"{path.name}: {info['type']} {info['dims']}; {name}: {wrong} of {SAMPLES} samples differ, corners by {off:.1e} mm")
        if wrong or off > TOLERANCE_MM or not same_type:
            faults.append(f"{name}: {wrong} samples, {off} mm, type {kind} and {ours.dtype}")
    return faults


def alternated(works, rounds=15):
    """Seconds of each work, taken in turn so that what else the machine does weighs on all of them; the first round warms up."""
    times = []
    for _ in range(rounds + 1):
        times.append([])
        for work in works:
            begin = time.perf_counter()
            work()
            times[-1].append(time.perf_counter() - begin)
    return np.array(times[1:])


def speed(program, folder):
    """Medians to open the series, files warm: the program's whole run (a probe of one ray), against reading alone."""
    ray = ["--iso", "226", "--origin", "0,-300,760", "--direction", "0,1,0"]
    ours = lambda: bregma(program, "probe", folder, *ray)
    times = alternated([ours, lambda: np.stack([s.pixel_array for s in slices(folder)]), lambda: series(folder)])
    names, seconds, parts = ("pydicom", "SimpleITK"), np.median(times, 0), np.median(times[:, :1] / times[:, 1:], 0)
    others = ", ".join(f"{n} {t:.3f} s (a part of {p:.2f})" for n, t, p in zip(names, seconds[1:], parts))
    print(f"{folder.name}, {len(list(folder.iterdir()))} files: bregma {seconds[0]:.3f} s, {others}")
    faults = [] if seconds[0] < 1 else ["it takes a second"]
    return faults + [f"it is slower than half of {n}" for n, part in zip(names, parts) if part > 0.5]


def main():
    data = pathlib.Path(sys.argv[1])
    program = sys.argv[2] if len(sys.argv) > 2 else pathlib.Path(__file__).parent.parent / "target/release/bregma"
    faults, scans, comparisons = [], 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for path, readers in itertools.chain(references(data), forms(data, folder)):
            scans, comparisons = scans + 1, comparisons + len(readers)
            faults += [f"{path}: {fault}" for fault in compare(program, path, readers, folder)]
    print(f"{scans} scans, {comparisons} comparisons")
    faults += speed(program, data / "phantom-philips/straight")
    print("\n".join(faults) or "all equal")
    sys.exit(bool(faults))


main()
