"""Scans in forms that the folder of real scans does not have, written by other programs where they write them, with independent readers of each.

Needs, beside what reference_readers.py does: `pip install vtk tifffile imagecodecs pillow itk-ioscanco pylibjpeg pylibjpeg-openjpeg
pylibjpeg-libjpeg`.
"""
import os
import pathlib
import shutil
import struct
import zipfile

import nibabel
import numpy as np
import pydicom
import SimpleITK as sitk
import tifffile
import vtk
from PIL import Image
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

SPACING = (0.5, 0.6, 1.25)
ORIGIN = (-10.0, 20.0, 30.0)
# pydicom's own test files of one grey image or stack that state where they lie, in the ways in which DICOM is written.
DICOM = """CT_small examples_overlay 693_J2KI MR_small MR_small_RLE MR_small_bigendian MR_small_expb MR_small_implicit
MR_small_jp2klossless MR_small_jpeg_ls_lossless MR_small_padded J2K_pixelrep_mismatch rtdose rtdose_expb rtdose_rle""".split()


def placed(samples, spacing=SPACING, origin=(0.0, 0.0, 0.0)):
    to_world = np.diag([*spacing, 1.0])
    to_world[:3, 3] = origin
    return samples, to_world, samples.dtype


def of_vtk(reader, path):
    reader.SetFileName(str(path))
    reader.Update()
    image = reader.GetOutput()
    samples = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(image.GetDimensions()[::-1])
    return placed(samples, image.GetSpacing(), image.GetOrigin())


def of_itk(path):
    image = sitk.ReadImage(str(path))
    samples = sitk.GetArrayFromImage(image)
    to_world = np.eye(4)
    to_world[:3, :3] = np.array(image.GetDirection()).reshape(3, 3) * image.GetSpacing()
    to_world[:3, 3] = image.GetOrigin()
    return samples, to_world, samples.dtype


def of_scanco(path):
    import itk

    image = itk.imread(str(path), imageio=itk.ScancoImageIO.New(), pixel_type=itk.SS)
    return placed(np.array(itk.array_view_from_image(image)), tuple(image.GetSpacing()))


def of_nibabel(path):
    image = nibabel.load(path)
    samples = np.asanyarray(image.dataobj).transpose(2, 1, 0)
    return samples, np.diag([-1, -1, 1, 1]) @ image.affine, samples.dtype


def of_pydicom(path):
    """Values and place of a file's frames; those of an old class lie where their offsets say."""
    one = pydicom.dcmread(path, force=True)
    stored = one.pixel_array.reshape(-1, one.Rows, one.Columns)
    # Numbers of 32 bits that do not fit 16 are kept as float32.
    stored = stored.astype("f4") if stored.dtype.newbyteorder("=") == "uint32" else stored
    values = stored * float(one.get("RescaleSlope", 1)) + float(one.get("RescaleIntercept", 0))
    i, j = np.array(one.ImageOrientationPatient, float).reshape(2, 3)
    i, j = i / np.linalg.norm(i), j / np.linalg.norm(j)
    dj, di = map(float, one.PixelSpacing)
    offsets = one.get("GridFrameOffsetVector")
    dk = float(offsets[1] - offsets[0]) if offsets else float(one.get("SpacingBetweenSlices") or one.get("SliceThickness") or 1)
    to_world = np.eye(4)
    to_world[:3, 0], to_world[:3, 1], to_world[:3, 2] = i * di, j * dj, np.cross(i, j) * dk
    to_world[:3, 3] = np.array(one.ImagePositionPatient, float)
    return values, to_world, stored.dtype


def by_vtk(folder, samples):
    image = vtk.vtkImageData()
    image.SetDimensions(samples.shape[::-1])
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    array = numpy_to_vtk(samples.ravel(), deep=True)
    array.SetName("v")
    image.GetPointData().SetScalars(array)
    for name, text in (("binary.vtk", False), ("text.vtk", True)):
        writer = vtk.vtkStructuredPointsWriter()
        writer.SetFileName(str(folder / name))
        writer.SetInputData(image)
        (writer.SetFileTypeToASCII if text else writer.SetFileTypeToBinary)()
        writer.Write()
        yield folder / name, {"VTK": lambda p=folder / name: of_vtk(vtk.vtkStructuredPointsReader(), p)}
    for mode in ("Ascii", "Binary", "Appended"):
        for packed in (None, vtk.vtkZLibDataCompressor()):
            path = folder / f"{mode}-{'zlib' if packed else 'plain'}.vti"
            writer = vtk.vtkXMLImageDataWriter()
            writer.SetFileName(str(path))
            writer.SetInputData(image)
            getattr(writer, f"SetDataModeTo{mode}")()
            writer.SetCompressor(packed)
            writer.SetEncodeAppendedData(packed is not None)
            writer.Write()
            yield path, {"VTK": lambda p=path: of_vtk(vtk.vtkXMLImageDataReader(), p)}


def by_numpy(folder, samples):
    """Arrays state no spacing: 1 mm. What of the samples does not fit a float16 is not asked of it."""
    arrays = {"c": samples, "fortran": np.asfortranarray(samples).transpose(2, 1, 0), "big": samples.astype(">i4"), "half": (samples >> 1).astype("<f2")}
    for name, array in arrays.items():
        path = folder / f"{name}.npy"
        np.save(path, array)
        kept = {"big": "i2", "half": "f4"}.get(name, "u2")
        read = lambda p=path, k=kept: placed((lambda a: a.T if a.flags.f_contiguous else a)(np.load(p)).astype(k), (1, 1, 1))
        yield path, {"numpy": read}


def by_nibabel(folder, samples):
    """Analyze 7.5, whose axes nibabel takes as left, anterior, superior, too. It states no origin: nibabel takes the middle, we the first sample."""
    for name, order in (("little", "<"), ("big", ">")):
        image = nibabel.AnalyzeImage(samples.transpose(2, 1, 0).astype("i2"), None, nibabel.AnalyzeHeader(endianness=order))
        image.header.set_zooms(SPACING)
        path = folder / f"analyze-{name}.hdr"
        nibabel.save(image, path.with_suffix(".img"))

        def read(p=path):
            values, to_world, kind = of_nibabel(p.with_suffix(".img"))
            to_world[:3, 3] = 0
            return values, to_world, kind

        yield path, {"nibabel": read}


def by_tifffile(folder, samples):
    ways = {
        "zlib": {"compression": "zlib"},
        "zlib-predictor": {"compression": "zlib", "predictor": True},
        "lzw": {"compression": "lzw"},
        "packbits": {"compression": "packbits"},
        "tiles": {"tile": (16, 16), "compression": "zlib"},
        "big": {"bigtiff": True, "byteorder": ">"},
    }
    for name, way in ways.items():
        path = folder / f"{name}.ome.tif"
        sizes = {f"PhysicalSize{a}": s for a, s in zip("XYZ", SPACING)} | {f"PhysicalSize{a}Unit": "mm" for a in "XYZ"}
        tifffile.imwrite(path, samples, ome=True, metadata={"axes": "ZYX"} | sizes, photometric="minisblack", **way)
        yield path, {"tifffile": lambda p=path: placed(tifffile.imread(p))}
    # Floats of 16 bits, which OME and ImageJ do not know: without a spacing, and kept as float32.
    half = folder / "half.tif"
    tifffile.imwrite(half, (samples >> 1).astype("f2"), compression="zlib", metadata=None)
    yield half, {"tifffile": lambda: placed(tifffile.imread(half).astype("f4"), (1, 1, 1))}
    path = folder / "imagej.tif"
    tifffile.imwrite(path, samples, imagej=True, resolution=(1 / SPACING[0], 1 / SPACING[1]), metadata={"spacing": SPACING[2], "unit": "mm", "axes": "ZYX"})
    yield path, {"tifffile": lambda p=path: placed(tifffile.imread(p))}


def by_bytes(folder, samples):
    """Forms that no program here writes, by the letter of what is published; ISQ is read by itk-ioscanco, the others by numpy."""
    nz, ny, nx = samples.shape
    head = bytearray(512)
    head[:16] = b"CTDATA-HEADER_V1"
    struct.pack_into("<6i", head, 44, nx, ny, nz, int(nx * SPACING[0] * 1e3), int(ny * SPACING[1] * 1e3), int(nz * SPACING[2] * 1e3))
    struct.pack_into("<i", head, 88, 1000)
    struct.pack_into("<i", head, 508, 0)
    path = folder / "scanco.isq"
    path.write_bytes(bytes(head) + samples.astype("<i2").tobytes())
    yield path, {"itk-ioscanco": lambda p=path: of_scanco(p)}

    volume = folder / "s.vol"
    volume.write_bytes(samples.astype("<u2").tobytes())
    raw = lambda p=volume: placed(np.fromfile(p, "<u2").reshape(samples.shape))
    (folder / "s.vgi").write_text(
        f"{{volume1}}\n[file1]\nSize = {nx} {ny} {nz}\nFileFormat = raw\nName = s.vol\nDatatype = unsigned integer\nBitsPerElement = 16\n"
        f"{{volumeprimitive12}}\n[geometry]\nresolution = {SPACING[0]} {SPACING[1]} {SPACING[2]}\nunit = mm\n"
    )
    yield folder / "s.vgi", {"numpy": raw}
    (folder / "s.pcr").write_text(f"[VolumeData]\nVolume_SizeX={nx}\nVolume_SizeY={ny}\nVolume_SizeZ={nz}\nFormat=5\nVoxelSizeRec=0.045\n")
    yield folder / "s.pcr", {"numpy": lambda: placed(raw()[0], (0.045,) * 3)}
    # Drishti's slabs: their type and three sizes, then the samples.
    names = [folder / f"d.pvl.nc.{n + 1:03}" for n in range(0, -(-nz // 10))]
    for n, slab in enumerate(names):
        part = samples[n * 10 : n * 10 + 10]
        slab.write_bytes(struct.pack("<Biii", 2, *part.shape) + part.astype("<u2").tobytes())
    (folder / "d.pvl.nc").write_text(
        "<!DOCTYPE Drishti_Header>\n<PvlDotNcFileHeader>\n<voxeltype>unsigned short</voxeltype>\n<pvlvoxeltype>unsigned short</pvlvoxeltype>\n"
        f"<gridsize>{nz} {ny} {nx}</gridsize>\n<voxelunit>micron</voxelunit>\n<voxelsize>{SPACING[0] * 1e3} {SPACING[1] * 1e3} {SPACING[2] * 1e3}"
        "</voxelsize>\n<slabsize>10</slabsize>\n</PvlDotNcFileHeader>\n"
    )
    slabs = lambda: placed(np.concatenate([np.fromfile(f, "<u2", offset=13) for f in names]).reshape(samples.shape))
    yield folder / "d.pvl.nc", {"numpy": slabs}
    box = " ".join(f"{0} {s * (n - 1)}" for s, n in zip(SPACING, (nx, ny, nz)))
    (folder / "s.am").write_bytes(
        f"# AmiraMesh BINARY-LITTLE-ENDIAN 2.1\n\ndefine Lattice {nx} {ny} {nz}\n\nParameters {{\n Units {{ Coordinates \"mm\" }}\n BoundingBox {box},\n"
        f' CoordType "uniform"\n}}\n\nLattice {{ ushort Data }} @1\n\n# Data section follows\n@1\n'.encode()
        + samples.astype("<u2").tobytes()
    )
    yield folder / "s.am", {"numpy": raw}


def pictures(folder, samples):
    for ext in ("png", "bmp", "tif", "jp2"):
        stack = folder / ext
        stack.mkdir()
        kept = (samples >> 4).astype("u1") if ext == "bmp" else samples.astype("u2")
        for k, one in enumerate(kept):
            path = stack / f"s{k + 1:03}.{ext}"
            if ext == "jp2":
                import imagecodecs

                path.write_bytes(imagecodecs.jpeg2k_encode(one, level=0, reversible=True, codecformat="jp2"))
            else:
                Image.fromarray(one).save(path)
        read = lambda s=stack: placed(np.stack([np.array(Image.open(f)) for f in sorted(s.iterdir())]), (1, 1, 1))
        if ext == "jp2":
            read = lambda s=stack: placed(np.stack([imagecodecs.jpeg2k_decode(f.read_bytes()) for f in sorted(s.iterdir())]), (1, 1, 1))
        yield stack, {"Pillow" if ext != "jp2" else "OpenJPEG": read}


def dicom(folder):
    source = pathlib.Path(os.path.dirname(pydicom.__file__)) / "data/test_files"
    for name in DICOM:
        path = folder / name / f"{name}.dcm"
        path.parent.mkdir()
        shutil.copy(source / f"{name}.dcm", path)
        yield path, {"pydicom": lambda p=path: of_pydicom(p)}


def forms(data, folder):
    """Each scan, written into `folder`, with its readers; the samples are those of the CT head in `data`."""
    folder = pathlib.Path(folder) / "forms"
    folder.mkdir()
    head = sitk.GetArrayFromImage(sitk.ReadImage(str(data / "cthead-unc/CThead.nhdr")))[30:62, 64:192, 60:190]
    samples = np.clip(head, 0, 4095).astype("u2")
    yield from by_vtk(folder, samples)
    yield from by_tifffile(folder, samples)
    yield from by_numpy(folder, samples)
    yield from by_nibabel(folder, samples)
    yield from by_bytes(folder, samples)
    yield from pictures(folder, samples)
    yield from dicom(folder)
    image = sitk.GetImageFromArray(samples)
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    for ext in ("gipl", "mha", "nrrd", "nii.gz"):
        path = folder / f"itk.{ext}"
        sitk.WriteImage(image, str(path), useCompression=ext in ("mha", "nrrd"))
        yield path, {"SimpleITK": lambda p=path: of_itk(p)}
    turned = np.array([[0, -0.6, 0, 3], [0.5, 0, 0, -7], [0, 0, 1.25, 11], [0, 0, 0, 1]])
    for ext in ("mgh", "mgz"):
        path = folder / f"nibabel.{ext}"
        nibabel.save(nibabel.MGHImage(samples.transpose(2, 1, 0).astype("i2"), turned), path)
        yield path, {"nibabel": lambda p=path: of_nibabel(p)}
    inside = folder / "inside.zip"
    with zipfile.ZipFile(inside, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(folder / "itk.mha", "media/a.mha")
    yield inside, {"SimpleITK": lambda: of_itk(folder / "itk.mha")}
