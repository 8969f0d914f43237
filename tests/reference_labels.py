#!/usr/bin/env python3
"""Label maps by other writers and readers: what the program writes is read by pynrrd and SimpleITK, what pynrrd (as 3D Slicer), SimpleITK and nibabel
write is read by the program, and all samples, names and colours are compared.

    python3 -m venv readers && readers/bin/pip install pynrrd SimpleITK nibabel numpy
    readers/bin/python tests/reference_labels.py target/release/bregma DEMO-FOLDER
"""
import argparse
import collections
import json
import subprocess
import tempfile

import nibabel
import nrrd
import numpy as np
import SimpleITK as sitk


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("demo")
    args = parser.parse_args()
    scan = f"{args.demo}/a.nrrd"
    image = sitk.ReadImage(scan)
    samples = sitk.GetArrayFromImage(image).T  # i, j, k

    def run(*options):
        done = subprocess.run([args.program, "parts", scan, "--json", *options], capture_output=True, text=True, check=True)
        return json.loads(done.stdout)["parts"], done.stderr

    def compare(parts, numbers):
        for part in parts:
            own = numbers == part["number"]
            assert part["samples"] == own.sum(), (part, own.sum())
            if own.any():
                assert abs(part["mean"] - samples[own].astype(np.float64).mean()) < 1e-6, part
                at = np.argwhere(own)
                assert part["extent"] == [at.min(0).tolist(), at.max(0).tolist()], part
        assert sum(part["samples"] for part in parts) == (numbers > 0).sum()

    with tempfile.TemporaryDirectory() as folder:
        written = f"{folder}/written.seg.nrrd"
        parts, _ = run("--separate", "4", "--larger-than", "50", "--out", written)
        by_pynrrd, header = nrrd.read(written)
        by_itk = sitk.ReadImage(written)
        assert (sitk.GetArrayFromImage(by_itk).T == by_pynrrd).all() and by_pynrrd.shape == samples.shape
        for n, part in enumerate(parts):
            assert header[f"Segment{n}_Name"] == part["name"] and header[f"Segment{n}_LabelValue"] == str(part["number"])
            assert [np.float32(c) for c in header[f"Segment{n}_Color"].split()] == [np.float32(c) for c in part["color"]]
            low, high = part["extent"]
            assert header[f"Segment{n}_Extent"] == " ".join(f"{a} {b}" for a, b in zip(low, high))
        close = lambda a, b: np.allclose(a, b, rtol=0, atol=1e-9)
        assert close(by_itk.GetOrigin(), image.GetOrigin()) and close(by_itk.GetSpacing(), image.GetSpacing())
        assert close(by_itk.GetDirection(), image.GetDirection())
        compare(parts, by_pynrrd)
        print(f"written by the program: {len(parts)} parts, {(by_pynrrd > 0).sum()} samples, read by pynrrd and SimpleITK as they are")

        # As 3D Slicer writes two segments that overlap, each in a layer, cropped to a box.
        low, size = np.array(samples.shape) // 6, np.array(samples.shape) // 2
        box = tuple(slice(a, a + n) for a, n in zip(low, size))
        random = np.random.default_rng(1)
        layers = np.stack([samples[box] > 226, (random.random(size) < 0.1) * 2]).astype(np.uint8)
        spacing = np.diag(image.GetSpacing()) @ np.array(image.GetDirection()).reshape(3, 3).T
        origin = np.array(image.TransformIndexToPhysicalPoint([int(x) for x in low]))
        header = collections.OrderedDict(
            [("space", "left-posterior-superior"), ("kinds", ["list", "domain", "domain", "domain"]), ("encoding", "gzip")]
            + [("space directions", np.vstack([[np.nan] * 3, spacing])), ("space origin", origin)]
            + [("Segmentation_ReferenceImageExtentOffset", " ".join(map(str, low)))]
            + [(f"Segment{n}_{field}", value) for n, name in enumerate(["bone", "grain"]) for field, value in
               [("ID", name), ("Name", name), ("Color", f"0.{n} 0.5 1"), ("LabelValue", str(n + 1)), ("Layer", str(n)), ("Tags", "a:b|"),
                ("Extent", " ".join(f"0 {x - 1}" for x in size))]]
        )
        slicer = f"{folder}/slicer.seg.nrrd"
        nrrd.write(slicer, layers, header)
        parts, said = run("--labels", slicer, "--out", f"{folder}/again.seg.nrrd")
        expected = np.zeros(samples.shape, np.uint8)
        expected[box] = np.where(layers[1] > 0, 2, layers[0])
        compare(parts, expected)
        again, header = nrrd.read(f"{folder}/again.seg.nrrd")
        assert (again == expected).all() and [part["name"] for part in parts] == ["bone", "grain"]
        assert header["Segment1_Tags"] == "a:b|" and header["Segment0_ID"] == "bone"
        both = int((layers.min(0) > 0).sum())
        assert f"{both} samples belong to several segments" in said, said
        print(f"two layers of {tuple(map(int, size))} samples written by pynrrd as 3D Slicer does: the same; {both} samples in both are told of")

        labels = sitk.Cast(sitk.GetImageFromArray((samples.T > 226).astype(np.int32) + 254 * (samples.T > 1000)), sitk.sitkInt32)
        labels.CopyInformation(image)
        expected = sitk.GetArrayFromImage(labels).T
        for name in ["int.nrrd", "int.nii.gz", "int.mha"]:
            sitk.WriteImage(labels, f"{folder}/{name}")
            parts, said = run("--labels", f"{folder}/{name}", "--out", f"{folder}/back-{name}")
            assert [part["name"] for part in parts] == ["1", "255"], parts
            compare(parts, expected)
            back = sitk.ReadImage(f"{folder}/back-{name}")
            assert (sitk.GetArrayFromImage(back).T == expected).all() and "several" not in said
        print(f"32-bit labels 1 and 255 written by SimpleITK as NRRD, NIfTI and MetaImage: the same, and SimpleITK reads them back")

        # RAS, turned round along two axes, as many tools of neuroimaging keep images.
        affine = np.diag([*image.GetSpacing(), 1.0])
        turned = expected[::-1, ::-1].astype(np.int16)
        last = np.array(image.TransformIndexToPhysicalPoint([int(samples.shape[0] - 1), int(samples.shape[1] - 1), 0]))
        affine[:3, 3] = last * [-1, -1, 1]
        nibabel.save(nibabel.Nifti1Image(turned, affine), f"{folder}/ras.nii.gz")
        parts, said = run("--labels", f"{folder}/ras.nii.gz")
        compare(parts, expected)
        assert "nearest" not in said, said
        print("16-bit labels in RAS written by nibabel: the same")


if __name__ == "__main__":
    main()
