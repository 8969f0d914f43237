#!/usr/bin/env python3
"""How long a scan of 1 GiB takes to open, warm, beside SimpleITK, tifffile and dd: seconds and MB/s of samples, medians of rounds in turn.

    python3 -m venv env && env/bin/pip install numpy SimpleITK pydicom tifffile imagecodecs
    cargo build --release --example read -p bregma-volume
    env/bin/python benches/reading.py DATA [--folder FOLDER] [--rounds N] [--mib N]

DATA is the folder that BREGMA_DATA names: the straight series of its phantom, twice as many samples along i and j and so often as it takes
along k, with noise of 12 HU, so that it packs as a scan does. What is written into FOLDER (/tmp/speed) is removed at the end. Each reads into
memory; bregma also builds its ranges and histogram, which the others do not. Every read is in a process of its own, the times are those within.
"""

import argparse
import pathlib
import shutil
import statistics
import subprocess
import sys
import zlib

import numpy as np

SIDE = 1024
ITK = "import SimpleITK as s;im=s.ReadImage(sys.argv[1])"
ITK_SERIES = (
    "import SimpleITK as s;r=s.ImageSeriesReader();r.SetFileNames(r.GetGDCMSeriesFileNames(sys.argv[1]));im=r.Execute()"
)
TIFFFILE = "import tifffile,imagecodecs;im=tifffile.imread(sys.argv[1])"
NUMPY = "import numpy;im=numpy.fromfile(sys.argv[1],'u1')"
TIMED = "import sys,time\n{first}\nt=time.perf_counter()\n{rest}\nprint(time.perf_counter()-t)"


def made(data, count):
    """`count` slices, one after the other: those of the phantom there and back."""
    import pydicom

    sets = sorted((pydicom.dcmread(f) for f in (data / "phantom-philips/straight").iterdir()), key=lambda s: float(s.ImagePositionPatient[2]))
    random = np.random.default_rng(1)
    for k in range(count):
        n = k % (2 * len(sets) - 2)
        slice_ = sets[n if n < len(sets) else 2 * len(sets) - 2 - n].pixel_array
        noise = random.normal(0, 12, (SIDE, SIDE))
        yield np.clip(np.kron(slice_, np.ones((2, 2))) + noise, 0, 4095).astype("<u2")


def write_dicom(path, samples, k, packed):
    from pydicom.dataset import Dataset, FileMetaDataset
    from pydicom.encaps import encapsulate
    from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, JPEGLosslessSV1, generate_uid

    one = Dataset()
    one.file_meta = FileMetaDataset()
    one.file_meta.TransferSyntaxUID = JPEGLosslessSV1 if packed else ExplicitVRLittleEndian
    one.file_meta.MediaStorageSOPClassUID = one.SOPClassUID = CTImageStorage
    one.file_meta.MediaStorageSOPInstanceUID = one.SOPInstanceUID = generate_uid(entropy_srcs=[str(path)])
    one.SeriesInstanceUID, one.StudyInstanceUID = "1.2.826.0.1.3680043.8.498.1", "1.2.826.0.1.3680043.8.498.2"
    one.Modality, one.SeriesNumber, one.InstanceNumber = "CT", 1, k + 1
    one.Rows = one.Columns = SIDE
    one.BitsAllocated, one.BitsStored, one.HighBit, one.PixelRepresentation = 16, 16, 15, 0
    one.SamplesPerPixel, one.PhotometricInterpretation = 1, "MONOCHROME2"
    one.PixelSpacing, one.SliceThickness = [0.25, 0.25], 0.5
    one.ImagePositionPatient, one.ImageOrientationPatient = [0, 0, 0.5 * k], [1, 0, 0, 0, 1, 0]
    one.RescaleSlope, one.RescaleIntercept = 1, -1024
    if packed:
        import imagecodecs

        one.PixelData = encapsulate([imagecodecs.ljpeg_encode(samples, bitspersample=16)])
        one["PixelData"].VR = "OB"
    else:
        one.PixelData = samples.tobytes()
    one.save_as(path, enforce_file_format=True)


def write(data, folder, count):
    import tifffile

    header = (
        f"NRRD0004\ntype: uint16\ndimension: 3\nsizes: {SIDE} {SIDE} {count}\nspace: left-posterior-superior\n"
        "space directions: (0.25,0,0) (0,0.25,0) (0,0,0.5)\nspace origin: (0,0,0)\nendian: little\nencoding: "
    )
    for name in ("plain", "jpeg"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    pack = zlib.compressobj(6, zlib.DEFLATED, 31)
    with open(folder / "raw.nrrd", "wb") as raw, open(folder / "gzip.nrrd", "wb") as packed, tifffile.TiffWriter(folder / "deflate.tif") as tiff:
        raw.write((header + "raw\n\n").encode())
        packed.write((header + "gzip\n\n").encode())
        for k, samples in enumerate(made(data, count)):
            raw.write(samples.tobytes())
            packed.write(pack.compress(samples.tobytes()))
            tiff.write(samples, compression="zlib", contiguous=False, metadata=None)
            write_dicom(folder / "plain" / f"{k:04}.dcm", samples, k, False)
            write_dicom(folder / "jpeg" / f"{k:04}.dcm", samples, k, True)
        packed.write(pack.flush())


def python(code, path):
    first, rest = code.split(";", 1)
    if code == ITK_SERIES:
        first, rest = code.split(";r=", 1)
        rest = "r=" + rest
    done = subprocess.run([sys.executable, "-c", TIMED.format(first=first, rest=rest), str(path)], capture_output=True, text=True, check=True)
    return float(done.stdout)


def own(path):
    program = pathlib.Path(__file__).parent.parent / "target/release/examples/read"
    return float(subprocess.run([program, path], capture_output=True, text=True, check=True).stdout.split()[0])


def dd(path):
    done = subprocess.run(["dd", f"if={path}", "of=/dev/null", "bs=1M"], capture_output=True, text=True, check=True, env={"LC_ALL": "C"})
    return float(done.stderr.split("copied, ")[1].split(" s")[0])


FORMS = {
    "raw NRRD": ("raw.nrrd", {"bregma": own, "SimpleITK": lambda p: python(ITK, p), "numpy": lambda p: python(NUMPY, p), "dd": dd}),
    "gzip NRRD": ("gzip.nrrd", {"bregma": own, "SimpleITK": lambda p: python(ITK, p)}),
    "deflate TIFF": ("deflate.tif", {"bregma": own, "SimpleITK": lambda p: python(ITK, p), "tifffile": lambda p: python(TIFFFILE, p)}),
    "DICOM": ("plain", {"bregma": own, "SimpleITK": lambda p: python(ITK_SERIES, p)}),
    "DICOM, JPEG lossless": ("jpeg", {"bregma": own, "SimpleITK": lambda p: python(ITK_SERIES, p)}),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--folder", type=pathlib.Path, default="/tmp/speed")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--mib", type=int, default=1024)
    parser.add_argument("--only", help="forms whose names hold this")
    parser.add_argument("--keep", action="store_true", help="leave FOLDER, and take what is in it")
    args = parser.parse_args()
    count = args.mib // 2
    if not (args.keep and args.folder.exists()):
        write(args.data, args.folder, count)
    print("| form | on disk, MiB | bregma, s (MB/s) | others, s (MB/s) | of the fastest |\n|---|---|---|---|---|")
    for form, (name, readers) in FORMS.items():
        if args.only and args.only not in form:
            continue
        path = args.folder / name
        files = list(path.iterdir()) if path.is_dir() else [path]
        on_disk = sum(f.stat().st_size for f in files) / 2**20
        [f.read_bytes() for f in files]
        times = {reader: [] for reader in readers}
        for _ in range(args.rounds):
            for reader, read in readers.items():
                times[reader].append(read(path))
        medians = {reader: statistics.median(t) for reader, t in times.items()}
        shown = {reader: f"{t:.2f} ({args.mib * 2**20 / 1e6 / t:.0f})" for reader, t in medians.items()}
        others = ", ".join(f"{reader} {shown[reader]}" for reader in readers if reader != "bregma")
        fastest = min(t for reader, t in medians.items() if reader != "bregma")
        print(f"| {form} | {on_disk:.0f} | {shown['bregma']} | {others} | {fastest / medians['bregma']:.2f} times as fast |", flush=True)
    if not args.keep:
        shutil.rmtree(args.folder)


if __name__ == "__main__":
    main()
