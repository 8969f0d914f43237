#!/usr/bin/env python3
"""Times this program against what a user would otherwise pick, on the same scans, views and machine, in one run.

    python3 -m venv peers && peers/bin/pip install vtk mitsuba numpy SimpleITK
    apt-get install xvfb libllvm19          # a display for VTK; LLVM for Mitsuba's vectorised kernels
    xvfb-run -a peers/bin/python benches/peers.py target/release/bregma skull.nrrd:300 other.nii.gz:40

Every figure is the median wall time of a whole frame in ms over the orbit of `bregma bench`, after one frame that is not counted. The program
is timed before and after each peer, and the ratio is taken with the mean of the two, so that a machine that slows down does so for both.

Peers: Mitsuba 3's `sdfgrid` (an exact CPU ray tracer; bare intersection, no shading), VTK's CPU mapper (steps of half a voxel), VTK's surface
extraction drawn as a mesh (extraction not counted), VTK's GPU mapper in isosurface mode (its default step), on whatever driver there is, and
both mappers against this program's direct volume rendering: with the same ramp of opacity, steps of half a voxel, and shading by gradients. `vtk-levels-cpu` shows two
levels as thin peaks of opacity, beside this program's two transparent surfaces.
"""
import argparse
import glob
import json
import multiprocessing
import os
import statistics
import subprocess
import tempfile
import time

FOV_DEG, ELEVATION_DEG = 30.0, 15.0
LEVELS_APART = 0.1  # of the range: two transparent levels
RAMP = 0.03  # of the range, to either side of the isovalue: from clear to opaque


def load(scan):
    import numpy
    import SimpleITK

    image = SimpleITK.ReadImage(scan)
    return numpy.ascontiguousarray(SimpleITK.GetArrayFromImage(image)), numpy.array(image.GetSpacing())


def orbit(extent, frames):
    """Eyes around a box of `extent` mm with a corner at 0, one more than `frames`, as the first is not counted."""
    import numpy

    centre, elevation = extent / 2, numpy.radians(ELEVATION_DEG)
    distance = numpy.linalg.norm(extent) / 2 / numpy.sin(numpy.radians(FOV_DEG / 2))
    for frame in range(frames + 1):
        azimuth = 2 * numpy.pi * frame / frames
        away = [numpy.cos(elevation) * numpy.sin(azimuth), -numpy.cos(elevation) * numpy.cos(azimuth), numpy.sin(elevation)]
        yield centre + distance * numpy.array(away)


def median_ms(draw, eyes):
    times = []
    for eye in eyes:
        begun = time.perf_counter()
        draw(eye)
        times.append((time.perf_counter() - begun) * 1e3)
    return statistics.median(times[1:])


def ramp(low, high, iso):
    width = RAMP * (high - low)
    return (low, 0), (iso - width, 0), (iso + width, 1), (high, 1)


def levels(low, high, iso):
    """Thin peaks of opacity at the isovalue and a tenth of the range above, as a mapper without isosurfaces shows two of them."""
    width, second = 0.01 * (high - low), iso + LEVELS_APART * (high - low)
    peaks = [(at + side * width, alpha * (side == 0)) for at, alpha in ((iso, 0.45), (second, 0.3)) for side in (-1, 0, 1)]
    return (low, 0), *peaks, (high, 0)


def vtk_frames(kind, scan, iso, size, frames):
    import numpy
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk

    samples, spacing = load(scan)
    dims = samples.shape[::-1]
    image = vtk.vtkImageData()
    image.SetDimensions(dims)
    image.SetSpacing(spacing)
    image.GetPointData().SetScalars(numpy_to_vtk(samples.ravel(), deep=True))
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    window.OffScreenRenderingOn()
    window.SetSize(size, size)
    window.SetMultiSamples(0)
    window.AddRenderer(renderer)
    if kind == "vtk-mesh":
        surface = vtk.vtkFlyingEdges3D()
        surface.SetInputData(image)
        surface.SetValue(0, iso)
        surface.Update()
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputConnection(surface.GetOutputPort())
        mapper.ScalarVisibilityOff()
        actor = vtk.vtkActor()
        actor.SetMapper(mapper)
        renderer.AddActor(actor)
    else:
        low, high = float(samples.min()), float(samples.max())
        white, opacity, prop = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction(), vtk.vtkVolumeProperty()
        white.AddRGBPoint(low, 1, 1, 1)
        prop.SetInterpolationTypeToLinear()
        prop.ShadeOn()
        if kind == "vtk-gpu":
            mapper = vtk.vtkGPUVolumeRayCastMapper()
            mapper.SetBlendModeToIsoSurface()
            prop.GetIsoSurfaceValues().SetValue(0, iso)
            opacity.AddPoint(low, 1)
        else:
            mapper = vtk.vtkGPUVolumeRayCastMapper() if kind == "vtk-dvr-gpu" else vtk.vtkFixedPointVolumeRayCastMapper()
            mapper.AutoAdjustSampleDistancesOff()
            mapper.SetSampleDistance(float(spacing.min()) / 2)
            if kind != "vtk-dvr-gpu":
                mapper.SetImageSampleDistance(1)
            for value, alpha in levels(low, high, iso) if kind == "vtk-levels-cpu" else ramp(low, high, iso):
                opacity.AddPoint(value, alpha)
        mapper.SetInputData(image)
        prop.SetColor(white)
        prop.SetScalarOpacity(opacity)
        volume = vtk.vtkVolume()
        volume.SetMapper(mapper)
        volume.SetProperty(prop)
        renderer.AddVolume(volume)
    extent = (numpy.array(dims) - 1) * spacing
    camera = renderer.GetActiveCamera()

    def draw(eye):
        camera.SetPosition(*eye)
        camera.SetFocalPoint(*(extent / 2))
        camera.SetViewUp(0, 0, 1)
        camera.SetViewAngle(FOV_DEG)
        renderer.ResetCameraClippingRange()
        window.Render()
        pixels = vtk.vtkWindowToImageFilter()
        pixels.SetInput(window)
        pixels.ReadFrontBufferOff()
        pixels.Update()

    return median_ms(draw, orbit(extent, frames))


def mitsuba_frames(_, scan, iso, size, frames):
    import numpy

    found = sorted(glob.glob("/usr/lib/*/libLLVM*.so*"))
    if found:
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", found[-1])
    import drjit
    import mitsuba

    mitsuba.set_variant("llvm_ad_rgb")
    samples, spacing = load(scan)
    side = max(samples.shape)  # the grid is a cube: what is added lies outside
    cube = numpy.ones((side, side, side, 1), numpy.float32)
    nz, ny, nx = samples.shape
    cube[:nz, :ny, :nx, 0] = (iso - samples.astype(numpy.float32)) / max(1.0, float(numpy.ptp(samples)))
    scene = mitsuba.load_dict({"type": "scene", "grid": {"type": "sdfgrid", "grid": mitsuba.TensorXf(cube)}})
    unit = (side - 1) * spacing  # mm along each edge of the unit cube
    extent = (numpy.array([nx, ny, nz]) - 1) * spacing
    half = numpy.tan(numpy.radians(FOV_DEG / 2))
    vector = lambda v: mitsuba.Vector3f(*map(float, v / unit))
    pixel = drjit.arange(mitsuba.UInt32, size * size)
    across, down = (mitsuba.Float(pixel % size) + 0.5) / size * 2 - 1, 1 - (mitsuba.Float(pixel // size) + 0.5) / size * 2
    rays = []
    for eye in orbit(extent, frames):
        forward = (extent / 2 - eye) / numpy.linalg.norm(extent / 2 - eye)
        right = numpy.cross(forward, [0, 0, 1])
        right /= numpy.linalg.norm(right)
        direction = vector(forward) + across * vector(right * half) + down * vector(numpy.cross(right, forward) * half)
        rays.append(mitsuba.Ray3f(mitsuba.Point3f(*map(float, eye / unit)), drjit.normalize(direction)))
        drjit.eval(rays[-1])
    drjit.sync_thread()

    def draw(ray):
        drjit.eval(scene.ray_intersect_preliminary(ray, coherent=True))
        drjit.sync_thread()

    return median_ms(draw, rays)


def in_process(answer, work, *args):
    answer.put(work(*args))


def peer_ms(work, *args):
    """A process each: a peer that crashes is a finding and not the end."""
    context = multiprocessing.get_context("spawn")
    answer = context.Queue()
    process = context.Process(target=in_process, args=(answer, work, *args))
    process.start()
    while process.is_alive() and answer.empty():
        process.join(0.1)
    result = None if answer.empty() else answer.get()
    process.join()
    return result


def transfer_of(scan, iso, folder):
    """The ramp as a file of this program's, whose extinction, not opacity, is linear between points: so with many of them."""
    samples, _ = load(scan)
    low, high = float(samples.min()), float(samples.max())
    ramp, parts = RAMP * (high - low), 32
    points = [{"value": iso - ramp + 2 * ramp * n / parts, "color": "ffffff", "opacity": n / parts} for n in range(parts + 1)]
    file = os.path.join(folder, "ramp.json")
    with open(file, "w") as out:
        json.dump({"name": "ramp", "over_mm": 1.0, "points": points}, out)
    return file


def bregma_ms(program, mode, backend, scan, iso, size, frames):
    command = [program, "bench", scan, "--iso", str(iso), "--backend", backend, "--size", str(size), "--frames", str(frames), "--json"]
    with tempfile.TemporaryDirectory() as folder:
        if mode == "dvr":
            command += ["--mode", "dvr", "--integrator", "steps:2", "--transfer", transfer_of(scan, iso, folder)]
        elif mode == "transparent":
            samples, _ = load(scan)
            command += ["--mode", mode, "--shell", f"1:{iso + LEVELS_APART * (float(samples.max()) - float(samples.min()))},ffccaa,0.3"]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    record = json.loads(done.stdout)
    return record["median_ms"], record["adapter"]


# Peer, what times it, the mode and the backend it is compared with, and how many times faster this program wants to be.
PEERS = [
    ("mitsuba", mitsuba_frames, "iso", "cpu", 4),
    ("vtk-cpu", vtk_frames, "iso", "cpu", 10),
    ("vtk-mesh", vtk_frames, "iso", "cpu", 8),
    ("vtk-gpu", vtk_frames, "iso", "gpu", 20),
    ("vtk-dvr-cpu", vtk_frames, "dvr", "cpu", 5),
    ("vtk-levels-cpu", vtk_frames, "transparent", "cpu", 1),
    ("vtk-dvr-gpu", vtk_frames, "dvr", "gpu", 15),
]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("scans", nargs="+", metavar="SCAN:ISO")
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--frames", type=int, default=8)
    parser.add_argument("--peers", nargs="*", default=[name for name, *_ in PEERS])
    args = parser.parse_args()
    print("| scan | peer | its ms | ours, ms | backend | times faster | wanted |\n|---|---|---|---|---|---|---|")
    adapters = {}
    for scan, iso in (text.rsplit(":", 1) for text in args.scans):
        case = (scan, float(iso), args.size, args.frames)
        for name, work, mode, backend, wanted in PEERS:
            if name not in args.peers:
                continue
            before, adapters[backend] = bregma_ms(args.program, mode, backend, *case)
            theirs = peer_ms(work, name, *case)
            ours = (before + bregma_ms(args.program, mode, backend, *case)[0]) / 2
            figure = "failed | {:.1f} | {} | | {}".format(ours, backend, wanted)
            if theirs is not None:
                figure = f"{theirs:.1f} | {ours:.1f} | {backend} | {theirs / ours:.1f} | {wanted}"
            print(f"| {os.path.basename(scan)}, {iso} | {name} | {figure} |", flush=True)
    import importlib.metadata

    versions = ", ".join(f"{package} {importlib.metadata.version(package)}" for package in ("vtk", "mitsuba"))
    cpu = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), "?")
    print(f"\n{cpu}, {os.cpu_count()} cores; {'; '.join(adapters.values())}; {versions}; {args.size}×{args.size}, {args.frames} frames")


if __name__ == "__main__":
    main()
