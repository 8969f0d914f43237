#!/usr/bin/env python3
"""One mouse on another grid, brought back by this program and by others: error at 45 landmarks against seconds of the processor.

    python3 -m venv env && env/bin/pip install numpy SimpleITK nibabel vtk small_gicp itk-elastix open3d matplotlib
    cargo build --release
    env/bin/python benches/registration.py DATA [--seeds N] [--program target/release/bregma] [--chart docs/registration.svg]

DATA is the folder that BREGMA_DATA names. Each seed turns C57BL6_J_ by 25° about a random axis, samples it anew at 0.16 mm with noise of 3/255 in
8 bits, and begins 10° and 1.5 mm off. All are given the same start. Programs on points get the vertices and normals of VTK's flying edges at the
same isovalue; making these counts for them. A peer that is not installed is left out, aloud. Prints a table of means; writes the chart if asked.
"""

import argparse
import json
import os
import pathlib
import resource
import subprocess
import tempfile
import time

import numpy as np
import SimpleITK as sitk

ISO = 39.470215


def landmarks(path):
    points = json.loads(path.read_text())["markups"][0]
    to_lps = np.array([-1, -1, 1]) if points.get("coordinateSystem", "LPS") in ("RAS", "0") else np.ones(3)
    return np.array([p["position"] for p in points["controlPoints"]]) * to_lps


def motion(random, middle, degrees, mm):
    """Turns about `middle`, then shifts: 4×4."""
    axis, shift = (v / np.linalg.norm(v) for v in random.normal(size=(2, 3)))
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    a = np.radians(degrees)
    pose = np.eye(4)
    pose[:3, :3] = np.eye(3) + np.sin(a) * k + (1 - np.cos(a)) * k @ k
    pose[:3, 3] = middle + mm * shift - pose[:3, :3] @ middle
    return pose


def itk(pose):
    t = sitk.AffineTransform(3)
    t.SetMatrix(pose[:3, :3].ravel().tolist())
    t.SetTranslation(pose[:3, 3].tolist())
    return t


def again(image, truth, random):
    size = [int(np.ceil(n * s * 1.15 / 0.16)) for n, s in zip(image.GetSize(), image.GetSpacing())]
    middle = np.array(image.TransformContinuousIndexToPhysicalPoint([(n - 1) / 2 for n in image.GetSize()]))
    grid = sitk.Image(size, sitk.sitkUInt8)
    grid.SetSpacing([0.16] * 3)
    grid.SetOrigin((middle - 0.08 * (np.array(size) - 1)).tolist())
    moved = sitk.Resample(sitk.Cast(image, sitk.sitkFloat32), grid, itk(np.linalg.inv(truth)), sitk.sitkLinear, 0.0, sitk.sitkFloat32)
    values = sitk.GetArrayFromImage(moved) + random.normal(0, 3, size[::-1])
    made = sitk.GetImageFromArray(np.clip(np.round(values), 0, 255).astype(np.uint8))
    made.CopyInformation(grid)
    return made


def surface(image):
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

    data = vtk.vtkImageData()
    data.SetDimensions(image.GetSize())
    data.SetSpacing(image.GetSpacing())
    data.SetOrigin(image.GetOrigin())
    data.GetPointData().SetScalars(numpy_to_vtk(sitk.GetArrayFromImage(image).ravel(), deep=True))
    edges = vtk.vtkFlyingEdges3D()
    edges.SetInputData(data)
    edges.SetValue(0, ISO)
    edges.ComputeNormalsOn()
    edges.Update()
    mesh = edges.GetOutput()
    return mesh, vtk_to_numpy(mesh.GetPoints().GetData()).astype(float), vtk_to_numpy(mesh.GetPointData().GetNormals()).astype(float)


def bregma(program, by="surfaces"):
    def run(case):
        with tempfile.TemporaryDirectory() as folder:
            start, out = pathlib.Path(folder) / "start.json", pathlib.Path(folder) / "out.json"
            start.write_text(json.dumps(case["start"].tolist()))
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            words = [program, "register", case["files"][0], "--transform", start, case["files"][1], "--iso", str(ISO), "--by", by, "--out", out]
            subprocess.run([str(w) for w in words], check=True, capture_output=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            pair = next(iter(json.loads(out.read_text())["pairs"].values()))
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = pair["R"], pair["t"]
        return pose, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    return run


def timed(work):
    def run(case):
        before = time.process_time()
        pose = work(case)
        return pose, time.process_time() - before

    return run


def open3d(robust):
    import open3d as o3d

    def work(case):
        clouds = []
        for image in case["images"]:
            _, points, normals = surface(image)
            cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
            cloud.normals = o3d.utility.Vector3dVector(normals)
            clouds.append(cloud)
        r = o3d.pipelines.registration
        estimate = r.TransformationEstimationPointToPlane(r.TukeyLoss(k=0.3)) if robust else r.TransformationEstimationPointToPlane()
        pose = case["start"]
        for reach in (2.0, 0.3):
            pose = r.registration_icp(clouds[0], clouds[1], reach, pose, estimate, r.ICPConvergenceCriteria(max_iteration=100)).transformation
        return pose

    return timed(work)


def small_gicp():
    import small_gicp as gicp

    def work(case):
        points = [surface(image)[1] for image in case["images"]]
        return gicp.align(points[1], points[0], init_T_target_source=case["start"], downsampling_resolution=0.2, max_correspondence_distance=2.0).T_target_source

    return timed(work)


def vtk_icp():
    import vtk

    def work(case):
        meshes = [surface(image)[0] for image in case["images"]]
        to = vtk.vtkTransform()
        to.SetMatrix(case["start"].ravel().tolist())
        moved = vtk.vtkTransformPolyDataFilter()
        moved.SetInputData(meshes[0])
        moved.SetTransform(to)
        moved.Update()
        icp = vtk.vtkIterativeClosestPointTransform()
        icp.SetSource(moved.GetOutput())
        icp.SetTarget(meshes[1])
        icp.GetLandmarkTransform().SetModeToRigidBody()
        icp.SetMaximumNumberOfLandmarks(5000)
        icp.SetMaximumNumberOfIterations(100)
        icp.Update()
        m = icp.GetMatrix()
        return np.array([[m.GetElement(i, j) for j in range(4)] for i in range(4)]) @ case["start"]

    return timed(work)


def simple_itk():
    def work(case):
        moving, fixed = (sitk.Cast(image, sitk.sitkFloat32) for image in case["images"])
        # ITK's map leads from the fixed image to the moving one.
        back = np.linalg.inv(case["start"])
        first = sitk.Euler3DTransform()
        first.SetCenter(fixed.TransformContinuousIndexToPhysicalPoint([(n - 1) / 2 for n in fixed.GetSize()]))
        first.SetMatrix(back[:3, :3].ravel().tolist(), 1e-6)
        c = np.array(first.GetCenter())
        first.SetTranslation((back[:3, 3] + back[:3, :3] @ c - c).tolist())
        r = sitk.ImageRegistrationMethod()
        r.SetMetricAsMattesMutualInformation(50)
        r.SetMetricSamplingStrategy(r.RANDOM)
        r.SetMetricSamplingPercentage(0.05, 1)
        r.SetInterpolator(sitk.sitkLinear)
        r.SetOptimizerAsRegularStepGradientDescent(1.0, 1e-5, 200)
        r.SetOptimizerScalesFromPhysicalShift()
        r.SetShrinkFactorsPerLevel([4, 2, 1])
        r.SetSmoothingSigmasPerLevel([2, 1, 0])
        r.SetInitialTransform(first, inPlace=True)
        r.Execute(fixed, moving)
        pose = np.eye(4)
        pose[:3, :3] = np.array(first.GetMatrix()).reshape(3, 3)
        pose[:3, 3] = np.array(first.TransformPoint([0.0, 0.0, 0.0]))
        return np.linalg.inv(pose)

    return timed(work)


def elastix():
    import itk

    def placed(image, pose):
        made = itk.image_from_array(sitk.GetArrayFromImage(image).astype(np.float32))
        made.SetSpacing(image.GetSpacing())
        made.SetOrigin((pose[:3, :3] @ image.GetOrigin() + pose[:3, 3]).tolist())
        made.SetDirection(itk.matrix_from_array(pose[:3, :3] @ np.array(image.GetDirection()).reshape(3, 3)))
        return made

    def work(case):
        moving, fixed = placed(case["images"][0], case["start"]), placed(case["images"][1], np.eye(4))
        parameters = itk.ParameterObject.New()
        rigid = parameters.GetDefaultParameterMap("rigid")
        rigid["AutomaticTransformInitialization"] = ["false"]
        parameters.AddParameterMap(rigid)
        _, got = itk.elastix_registration_method(fixed, moving, parameter_object=parameters, log_to_console=False)
        got = dict(got.GetParameterMap(0))
        numbers = [float(v) for v in got["TransformParameters"]]
        own = sitk.Euler3DTransform([float(v) for v in got["CenterOfRotationPoint"]], *numbers[:3], numbers[3:])
        own.SetComputeZYX(got.get("ComputeZYX", ("false",))[0] == "true")
        # elastix's map leads from the fixed image to the moving one.
        pose = np.eye(4)
        pose[:3, 3] = own.TransformPoint([0.0] * 3)
        pose[:3, :3] = np.array([own.TransformPoint(axis) for axis in np.eye(3).tolist()]).T - pose[:3, 3:]
        return np.linalg.inv(pose) @ case["start"]

    return timed(work)


def chart(path, results):
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "registration"
    import matplotlib.pyplot as plot

    figure, axes = plot.subplots(figsize=(7, 4))
    for name, off, seconds in results:
        axes.scatter(seconds, off, s=60 if name.startswith("Bregma") else 30, color="#b8326f" if name.startswith("Bregma") else "#33709c")
        axes.annotate(name, (seconds, off), textcoords="offset points", xytext=(6, 4), fontsize=9)
    axes.set(xscale="log", yscale="log", xlabel="seconds of the processor", ylabel="mean error at 45 landmarks, mm")
    # Names stand to the right of their points.
    left, right = axes.get_xlim()
    axes.set_xlim(left, right * 8)
    axes.axhline(0.141, color="0.7", lw=0.8)
    axes.annotate("a voxel", (left, 0.141), fontsize=8, color="0.5", xytext=(4, 3), textcoords="offset points")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("")
    axes.yaxis.set_major_formatter("{x:g}")
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("data", type=pathlib.Path)
    words.add_argument("--seeds", type=int, default=5)
    words.add_argument("--program", default="target/release/bregma")
    words.add_argument("--chart", type=pathlib.Path)
    args = words.parse_args()
    image = sitk.ReadImage(str(args.data / "mouse/C57BL6_J_.nii.gz"))
    points = landmarks(args.data / "mouse/C57BL6_J_.mrk.json")
    middle = np.array(image.TransformContinuousIndexToPhysicalPoint([(n - 1) / 2 for n in image.GetSize()]))
    makers = {
        "Bregma": lambda: bregma(args.program),
        "Bregma, values": lambda: bregma(args.program, "intensities"),
        "Open3D, plane": lambda: open3d(False),
        "Open3D, plane, Tukey 0.3": lambda: open3d(True),
        "small_gicp": small_gicp,
        "VTK, 5,000 points": vtk_icp,
        "SimpleITK, mutual information": simple_itk,
        "elastix, rigid": elastix,
    }
    programs = {}
    for name, maker in makers.items():
        try:
            programs[name] = maker()
        except (ImportError, OSError) as e:
            print(f"{name}: left out ({e})")
    found = {name: [] for name in programs}
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(args.seeds):
            random = np.random.default_rng(seed)
            truth = motion(random, middle, 25, 0.3)
            made = again(image, truth, random)
            file = os.path.join(folder, f"{seed}.nrrd")
            sitk.WriteImage(made, file)
            start = truth @ motion(random, middle, 10, 1.5)
            case = {"images": (image, made), "files": (args.data / "mouse/C57BL6_J_.nii.gz", file), "start": start}
            for name, run in programs.items():
                try:
                    pose, seconds = run(case)
                except Exception as e:  # a peer that fails is told, and the others go on
                    print(f"{name}, seed {seed}: failed ({e})")
                    continue
                at = lambda p: points @ p[:3, :3].T + p[:3, 3]
                found[name].append((np.linalg.norm(at(pose) - at(truth), axis=1).mean(), seconds))
    print(f"| program | mean error at 45 landmarks, mm ({args.seeds} seeds) | worst | seconds of the processor |\n|---|---|---|---|")
    results = []
    for name, runs in found.items():
        if runs:
            off, seconds = np.array(runs).T
            results.append((name, off.mean(), seconds.mean()))
            print(f"| {name} | {off.mean():.5f} | {off.max():.5f} | {seconds.mean():.2f} |")
    if args.chart:
        chart(args.chart, results)


main()
