#!/usr/bin/env python3
"""The same map of differences by Bregma, Open3D and VTK, side by side: what each says of one pair, how long it takes, and where they part.

    benches/differences.py BREGMA A B [--iso VALUE --iso VALUE] [--transform FILE]

Bregma measures by partners and by closest points; the others get its own surfaces (first.ply, second.ply), so that only the distance is compared.
CloudCompare's cloud-to-mesh distance is by definition that of the closest point of the mesh, signed by the normal of the nearest triangle: that is
worked out here from Open3D's closest triangles. Needs numpy, open3d and vtk. CPU seconds are of one process with one thread where the library lets
one choose.
"""

import argparse
import os
import subprocess
import tempfile
import time

os.environ["OMP_NUM_THREADS"] = "1"
import numpy as np
import open3d as o3d
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy


def cpu(work):
    """What `work` gives, and its CPU seconds."""
    begun = time.process_time()
    return work(), time.process_time() - begun


def table(file):
    """Vertices, differences and their ±, in the order of the PLY's vertices."""
    with open(file, "rb") as f:
        names, count = [], 0
        while (line := f.readline().decode("ascii").strip()) != "end_header":
            if line.startswith("element vertex"):
                count = int(line.split()[-1])
            elif line.startswith("property float") or line.startswith("property uchar"):
                names.append((line.split()[-1], "<f4" if "float" in line else "u1"))
        vertices = np.frombuffer(f.read(count * np.dtype(names).itemsize), dtype=names)
        rest = np.frombuffer(f.read(), dtype=[("n", "u1"), ("i", "<u4", 3)])
    return np.stack([vertices[a] for a in "xyz"], 1).astype(float), vertices["difference_mm"].astype(float), rest["i"]


def open3d(points, vertices, triangles):
    """Signed distance and the sign by the nearest triangle's normal."""
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    mesh = o3d.t.geometry.TriangleMesh(o3d.core.Tensor(vertices.astype(np.float32)), o3d.core.Tensor(triangles.astype(np.int32)))
    scene.add_triangles(mesh)
    q = o3d.core.Tensor(points.astype(np.float32))
    found = scene.compute_closest_points(q, nthreads=1)
    distance = np.linalg.norm(points - found["points"].numpy(), axis=1)
    inside = scene.compute_occupancy(q, nthreads=1).numpy() > 0
    away = ((points - found["points"].numpy()) * found["primitive_normals"].numpy()).sum(1)
    return np.where(inside, distance, -distance), np.where(away < 0, distance, -distance)


def by_vtk(points, vertices, triangles):
    cells = np.hstack([np.full((len(triangles), 1), 3), triangles]).astype(np.int64)
    mesh, array, lattice = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    array.SetData(numpy_to_vtk(vertices, deep=True))
    lattice.ImportLegacyFormat(vtk.util.numpy_support.numpy_to_vtkIdTypeArray(cells.ravel(), deep=True))
    mesh.SetPoints(array)
    mesh.SetPolys(lattice)
    distance = vtk.vtkImplicitPolyDataDistance()
    distance.SetInput(mesh)
    out = vtk.vtkDoubleArray()
    distance.FunctionValue(numpy_to_vtk(points, deep=True), out)
    return -vtk_to_numpy(out)


def row(name, mm, seconds, reference):
    known = np.isfinite(mm) & np.isfinite(reference)
    off = np.abs(mm[known] - reference[known])
    flips = np.mean((mm[known] * reference[known] < 0) & (np.abs(reference[known]) > 0.05))
    print(f"| {name} | {np.nanmean(mm):+.4f} | {np.nanmean(np.abs(mm)):.4f} | {np.nanpercentile(mm, 95):+.3f} | {100 * np.mean(~np.isfinite(mm)):.1f} % "
          f"| {np.median(off):.4f}, {np.percentile(off, 95):.4f} | {100 * flips:.2f} % | {seconds} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bregma")
    parser.add_argument("rest", nargs=argparse.REMAINDER, help="scans and options of `bregma difference`")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        maps = {}
        for by in ("partner", "closest"):
            out = os.path.join(folder, by)
            subprocess.run([args.bregma, "difference", *args.rest, "--by", by, "--size", "64x64", "--out", out], check=True, stdout=subprocess.DEVNULL)
            maps[by] = table(os.path.join(out, "first.ply"))
        points, _, _ = maps["partner"]
        vertices, _, triangles = table(os.path.join(folder, "closest", "second.ply"))
        print(f"{len(points)} points of the first surface, {len(triangles)} triangles of the second; + : the second stands out\n")
        print("| | mean mm | of magnitudes | 95 % | no number | from Bregma's closest: median, 95 % | sign turned | CPU s |\n|---|---|---|---|---|---|---|---|")
        closest = maps["closest"][1]
        row("Bregma, partner", maps["partner"][1], "–", closest)
        row("Bregma, closest", closest, "–", closest)
        (signed, by_triangle), seconds = cpu(lambda: open3d(points, vertices, triangles))
        row("Open3D, signed distance", signed, f"{seconds:.2f}", closest)
        row("CloudCompare's C2M (sign by the triangle)", by_triangle, "same", closest)
        found, seconds = cpu(lambda: by_vtk(points, vertices, triangles))
        row("VTK, vtkImplicitPolyDataDistance", found, f"{seconds:.2f}", closest)


main()
