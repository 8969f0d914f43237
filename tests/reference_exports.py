#!/usr/bin/env python3
"""Reads what the program exports with other readers, and compares the numbers.

    python3 -m venv readers && readers/bin/pip install pandas jsonschema plyfile
    readers/bin/python tests/reference_exports.py target/release/bregma DEMO-FOLDER [--schema markups-schema-v1.0.3.json]

CSV is read by pandas, PLY by plyfile, and 3D Slicer's markups are checked by jsonschema: against the published schema where its file is given
(github.com/Slicer/Slicer, Modules/Loadable/Markups/Resources/Schema), else against what it says of the parts that are written.
"""
import argparse
import io
import json
import subprocess
import tempfile

import jsonschema
import pandas
import plyfile

numbers = lambda count: {"type": "array", "items": {"type": "number"}, "minItems": count, "maxItems": count}
flag, text = {"type": "boolean"}, {"type": "string"}
POINT = {
    "type": "object",
    "required": ["position", "positionStatus", "description"],  # the schema leaves them open; Slicer's own reader wants them
    "properties": {
        **{name: text for name in ("id", "label", "description", "associatedNodeID")},
        **{name: flag for name in ("selected", "locked", "visibility")},
        "position": numbers(3),
        "orientation": numbers(9),
        "positionStatus": {"enum": ["undefined", "preview", "defined"]},
    },
}
MEASUREMENT = {"type": "object", "properties": {"name": text, "enabled": flag, "value": {"type": "number"}, "units": text, "printFormat": text}}
MARKUP = {
    "type": "object",
    "required": ["type"],
    "properties": {
        "type": {"enum": ["Fiducial", "Line", "Angle", "Curve", "ClosedCurve", "Plane", "ROI"]},
        "coordinateSystem": {"enum": ["LPS", "RAS"]},
        "coordinateUnits": {"enum": ["mm", "um"]},
        "locked": flag,
        "labelFormat": text,
        "controlPoints": {"type": "array", "items": POINT},
        "measurements": {"type": "array", "items": MEASUREMENT},
    },
}
RULES = {
    "type": "object",
    "required": ["@schema", "markups"],
    "properties": {"@schema": text, "markups": {"type": "array", "items": MARKUP, "minItems": 1}},
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("demo")
    parser.add_argument("--schema")
    args = parser.parse_args()
    scans = [f"{args.demo}/a.nrrd", f"{args.demo}/b.nrrd"]

    def run(*options):
        return subprocess.run([args.program, *options], check=True, capture_output=True, text=True).stdout

    with tempfile.TemporaryDirectory() as folder:
        rays = f"{folder}/rays.csv"
        with open(rays, "w") as out:
            out.write("ox,oy,oz,dx,dy,dz\n0,-150,40,0,1,0\n-150,10,20,1,0.1,0\n10,5,200,0,0.05,-1\n")
        probe = lambda form: run("probe", *scans, "--rays", rays, "--format", form)
        records = [json.loads(line) for line in probe("json").splitlines()]
        segments = [(n + 1, v["name"], s) for n, r in enumerate(records) for v in r["volumes"] for s in v["segments"]]
        table = pandas.read_csv(io.StringIO(probe("csv")))
        stretches = table[table["kind"] == "stretch"]
        assert len(stretches) == len(segments) >= 10, (len(stretches), len(segments))
        off = max(abs(row - s["length_mm"]) for row, (_, _, s) in zip(stretches["length_mm"], segments))
        pairs = [d for r in records for p in r["pairs"] for d in p["differences"]]
        differences = table[table["kind"] == "difference"]
        assert len(differences) == len(pairs) >= 3, (len(differences), len(pairs))
        off = max([off] + [abs(row - d["difference_mm"]) for row, d in zip(differences["difference_mm"], pairs)])
        assert off <= 5.1e-7, off
        numeric = [c for c in table.columns if c.endswith(("_mm", "_deg")) and not pandas.api.types.is_numeric_dtype(table[c])]
        assert not numeric, numeric
        print(f"CSV by pandas: {len(stretches)} segments and {len(differences)} differences, {len(table.columns)} columns; at most {off:.1e} mm off JSON's")

        markups = json.loads(probe("markups"))
        jsonschema.validate(markups, RULES)
        if args.schema:
            jsonschema.validate(markups, json.load(open(args.schema)))
        assert len(markups["markups"]) == len(segments)
        off = 0.0
        for line, (_, _, s) in zip(markups["markups"], segments):
            a, b = (p["position"] for p in line["controlPoints"])
            off = max(off, abs(sum((x - y) ** 2 for x, y in zip(a, b)) ** 0.5 - s["length_mm"]))
        assert off < 1e-9, off
        against = "the published schema" if args.schema else "its schema's rules"
        print(f"Markups by jsonschema, {against}: {len(segments)} lines, as long as the segments to {off:.1e} mm")

        run("thickness", scans[0], "--out", f"{folder}/map", "--size", "64x64")
        import glob

        rows = pandas.read_csv(glob.glob(f"{folder}/map/*.csv")[0], comment="#")
        ply = plyfile.PlyData.read(glob.glob(f"{folder}/map/*.ply")[0])
        values = ply["vertex"]["thickness_mm"]
        there = values[values == values]
        off = abs(there - rows["thickness_mm"].to_numpy()).max()
        assert len(there) == len(rows) > 1000 and off <= 1e-4, (len(there), len(rows), off)
        corners = max(max(face) for face in ply["face"]["vertex_indices"])
        assert corners == len(values) - 1, corners
        print(f"Map: {len(rows)} values in CSV by pandas and PLY by plyfile, at most {off:.1e} mm apart; {len(ply['face'].data)} triangles")


if __name__ == "__main__":
    main()
