#!/usr/bin/env python3
"""Stores of OME-Zarr by other writers and readers: what zarr-python writes, with and without shards, in its codecs, chunks and types, in version 2 and
3, with gaps, is read by the program; what the program writes is read by zarr-python, dask and ome-zarr-models; and all samples and places are compared.

    python3 -m venv readers && readers/bin/pip install zarr dask numpy ome-zarr-models
    readers/bin/python tests/reference_stores.py target/release/bregma DEMO-FOLDER
"""
import argparse
import itertools
import json
import pathlib
import subprocess
import tempfile

import dask.array
import numpy as np
import zarr
from ome_zarr_models import open_ome_zarr
from zarr.codecs import BloscCodec, GzipCodec, ZstdCodec


def read_nrrd(path):
    head, samples = path.read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
    kind = {"uint8": "u1", "int16": "<i2", "uint16": "<u2", "float": "<f4"}[fields["type"]]
    sizes = [int(n) for n in fields["sizes"].split()]
    return np.frombuffer(samples, kind).reshape(sizes[::-1]), fields


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("demo")
    args = parser.parse_args()

    def convert(source, to, *options):
        done = subprocess.run([args.program, "convert", str(source), str(to), *options], capture_output=True, text=True)
        assert done.returncode == 0, (source, done.stderr)
        return done.stderr

    def axes(names):
        kinds = {"t": {"type": "time"}, "c": {"type": "channel"}}
        return [{"name": n, **kinds.get(n, {"type": "space", "unit": "micrometer"})} for n in names]

    def multiscales(names, version, scale, translation):
        transforms = [{"type": "scale", "scale": scale}, {"type": "translation", "translation": translation}]
        image = {"axes": axes(names), "datasets": [{"path": "0", "coordinateTransformations": transforms}]}
        return {"version": version, **image} if version == "0.4" else image

    random = np.random.default_rng(7)
    count = 0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        codecs = {
            "none": None,
            "gzip": GzipCodec(level=1),
            "zstd": ZstdCodec(level=3),
            "blosc lz4": BloscCodec(cname="lz4", shuffle="shuffle"),
            "blosc zstd bits": BloscCodec(cname="zstd", shuffle="bitshuffle"),
            "blosc blosclz": BloscCodec(cname="blosclz", shuffle="noshuffle"),
        }
        shapes = [(3, (70, 45, 131), (32, 32, 32), (64, 64, 192)), (3, (20, 30, 40), (16, 16, 16), None), (3, (33, 34, 35), (128, 128, 128), None),
                  (2, (50, 40, 61), (16, 40, 20), None), (3, (64, 65, 66), (64, 64, 64), (64, 128, 128))]
        kinds = ["u1", "i1", "<i2", ">i2", "<u2", ">u2", "<i4", "<f4", ">f4", "<f8"]
        for (version, shape, chunks, shards), (name, codec), kind in itertools.product(shapes, codecs.items(), kinds):
            if version == 2 and name not in ("none", "gzip") or kind in ("<i4", "<f8", "i1") and name != "zstd":
                continue
            if version == 3 and kind[0] == ">" and name != "none":
                continue
            path = folder / "foreign.ome.zarr"
            subprocess.run(["rm", "-rf", path], check=True)
            values = random.normal(50, 20, shape)
            samples = np.clip(values, 0, 120).astype(kind)
            group = zarr.create_group(path, zarr_format=version)
            compress = {"compressors": [codec] if codec else None}
            if version == 2:
                from numcodecs import GZip
                compress = {"compressors": GZip(1) if codec else None}
            elif kind[0] == ">":
                compress["serializer"] = zarr.codecs.BytesCodec(endian="big")
            fill = 5
            array = group.create_array("0", shape=shape, chunks=chunks, shards=shards, dtype=kind, fill_value=fill, **compress)
            # What lies behind is never written.
            gap = shape[0] // 2
            array[:gap] = samples[:gap]
            samples[gap:] = fill
            ome = multiscales("zyx", "0.4" if version == 2 else "0.5", [2.0, 3.0, 4.0], [10.0, 20.0, 30.0])
            if version == 2:
                group.attrs["multiscales"] = [ome]
            else:
                group.attrs["ome"] = {"version": "0.5", "multiscales": [ome]}
            convert(path, folder / "read.nrrd")
            read, fields = read_nrrd(folder / "read.nrrd")
            expected = samples.astype("f4") if kind == "<f8" else samples
            assert read.shape == shape and (read == expected).all(), (version, shape, chunks, shards, name, kind)
            assert fields["space origin"] == "(0.03,0.02,0.01)" and fields["space directions"] == "(0.004,0,0) (0,0.003,0) (0,0,0.002)", fields
            count += 1
        print(f"written by zarr-python {zarr.__version__}: {count} stores, read as they are")

        # Time and channels; an array by itself; a series of bioformats2raw.
        five = random.integers(0, 1000, (2, 3, 9, 10, 11)).astype("<u2")
        group = zarr.create_group(folder / "five.zarr", attributes={"ome": {"version": "0.5", "multiscales": [multiscales("tczyx", "0.5", [1, 1, 1, 1, 1], [0] * 5)]}})
        group.create_array("0", data=five, chunks=(1, 1, 4, 4, 4))
        said = convert(folder / "five.zarr", folder / "read.nrrd")
        assert (read_nrrd(folder / "read.nrrd")[0] == five[0, 0]).all() and "of the 3 along its axis c the first is read" in said, said
        convert(folder / "five.zarr" / "0", folder / "read.nrrd")
        assert (read_nrrd(folder / "read.nrrd")[0] == five[0, 0]).all()
        outer = zarr.create_group(folder / "series.zarr", zarr_format=2)
        outer.attrs["bioformats2raw.layout"] = 3
        inner = outer.create_group("0")
        inner.attrs["multiscales"] = [multiscales("zyx", "0.4", [1, 1, 1], [0, 0, 0])]
        inner.create_array("0", data=five[0, 0], chunks=(4, 4, 4))
        convert(folder / "series.zarr", folder / "read.nrrd")
        assert (read_nrrd(folder / "read.nrrd")[0] == five[0, 0]).all()
        print("channels, an array by itself, a series: read as they are")

        own = folder / "own.ome.zarr"
        convert(f"{args.demo}/a.nrrd", own)
        convert(f"{args.demo}/a.nrrd", folder / "plain.nrrd")
        samples, fields = read_nrrd(folder / "plain.nrrd")
        group = zarr.open_group(own, mode="r")
        assert (group["0"][:] == samples).all()
        boxes = 0
        for _ in range(100):
            a = [random.integers(0, n - 1) for n in samples.shape]
            b = [random.integers(low + 1, n) + 1 for low, n in zip(a, samples.shape)]
            box = tuple(slice(low, high) for low, high in zip(a, b))
            assert (dask.array.from_zarr(str(own / "0"))[box].compute() == samples[box]).all()
            boxes += 1
        finer, level = samples.astype(np.int64), 0
        while max(finer.shape) > 64:
            padded = np.pad(finer, [(0, n % 2) for n in finer.shape], mode="edge")
            eight = sum(padded[z::2, y::2, x::2] for z, y, x in itertools.product((0, 1), repeat=3))
            finer, level = (eight + 4) >> 3, level + 1
            assert (group[str(level)][:] == finer).all(), level
        image = open_ome_zarr(zarr.open_group(own, mode="r"))
        scale = json.loads((own / "zarr.json").read_text())["attributes"]["ome"]["multiscales"][0]["datasets"]
        print(f"written by the program: {level + 1} levels, {boxes} boxes by dask, {type(image).__name__} by ome-zarr-models; scales {scale[0]} …")


if __name__ == "__main__":
    main()
