#!/usr/bin/env python3
"""Thickness by inscribed spheres against a public implementation, on shapes: how far apart they are, in voxels.

    python3 -m venv peers && peers/bin/pip install numpy scipy porespy
    peers/bin/python tests/reference_thickness.py target/release/bregma

PoreSpy (Gostick and others 2019, Journal of Open Source Software 4(37), 1296) fills a mask with spheres of whole radii about samples. It gets the
shapes four times finer, so that its rounding is an eighth of a voxel; its radius leads from the centre of a sample to that of the nearest one
outside, about half a sample beyond the surface, and that much is taken off. Both are compared at the vertices of the mesh, it by the nearest
sample inside. Exits with 1 if half of the vertices are more than half a voxel apart, for a shape.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy
import porespy
import scipy.ndimage

SIDE, SPACING, FINER = 48, 0.5, 4


def shapes(finer):
    """Signed distances in mm, positive inside, on samples over the same cube, `finer` times as many in its side."""
    axis = (numpy.arange((SIDE - 1) * finer + 1) / finer - (SIDE - 1) / 2) * SPACING
    z, y, x = numpy.meshgrid(axis, axis, axis, indexing="ij")
    across = (x + 2 * y + 2 * z) / 3
    radius = numpy.sqrt(x**2 + y**2 + z**2)
    yield "slab of 4.3 mm", 2.15 - abs(across)
    yield "shell of 3 mm", 1.5 - abs(radius - 8)
    yield "ball of 9 mm", 4.5 - radius
    yield "rod of 6 mm", 3 - numpy.sqrt(numpy.maximum(radius**2 - across**2, 0))
    yield "wedge of 15°", numpy.minimum(3 - z, 3 + z * numpy.cos(0.26) + x * numpy.sin(0.26))


def main():
    program, failed = sys.argv[1], False
    for (name, distance), (_, fine) in zip(shapes(1), shapes(FINER)):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            header = f"NRRD0004\ntype: float\ndimension: 3\nsizes: {SIDE} {SIDE} {SIDE}\nspacings: {SPACING} {SPACING} {SPACING}\nendian: little\nencoding: raw\n\n"
            (folder / "shape.nrrd").write_bytes(header.encode() + distance.astype("<f4").tobytes())
            command = [program, "thickness", folder / "shape.nrrd", "--iso", "0", "--method", "sphere", "--out", folder / "out"]
            subprocess.run(command, check=True, capture_output=True)
            table = numpy.genfromtxt(folder / "out/thickness.csv", delimiter=",", names=True)
            assert json.load(open(folder / "out/thickness.json"))["statistics"]["count"] == len(table)
        inside = fine >= 0
        theirs = (2 * porespy.filters.local_thickness(inside) - 1) / FINER
        points = numpy.stack([table["z_mm"], table["y_mm"], table["x_mm"]], axis=1) / SPACING
        # What lies near the volume's faces is cut there: one counts these as outside, the other does not.
        middle = (abs(points - (SIDE - 1) / 2) < SIDE / 4).all(axis=1)
        nearest = scipy.ndimage.distance_transform_edt(~inside, return_distances=False, return_indices=True)
        at = tuple(numpy.rint(points[middle] * FINER).astype(int).T)
        apart = table["thickness_mm"][middle] / SPACING - theirs[tuple(axis[at] for axis in nearest)]
        median, most = numpy.median(abs(apart)), numpy.percentile(abs(apart), 95)
        print(f"{name}: {middle.sum()} vertices; apart by {numpy.median(apart):+.2f} voxel (median), |…| {median:.2f}, 95 % within {most:.2f}")
        failed |= median > 0.5
    sys.exit(failed)


if __name__ == "__main__":
    main()
