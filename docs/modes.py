#!/usr/bin/env python3
"""Draws the sheet of docs/modes.md: python3 docs/modes.py BREGMA DEMO-FOLDER OUT.png (needs ImageMagick's montage)."""
import subprocess
import sys
import tempfile

program, demo, out = sys.argv[1:]
A, B = f"{demo}/a.nrrd", f"{demo}/b.nrrd"
CUT = ["--clip", "1,0,0,0"]
VIEW = ["--orbit", "50,14", "--fov", "22"]
NEAR = ["--eye", "15,-300,-45", "--target", "0,-85,-60", "--fov", "9"]
PICTURES = [
    ("isosurface, shadows", [A, "--shadows"]),
    ("overlay", [A, B, "--mode", "overlay"]),
    ("transparent, shadows", [A, "--opacity", "0.35", "--inner-color", "c04040", "--shadows"]),
    ("volume rendering", [A, "--mode", "dvr", "--transfer", "dry-skull"]),
    ("cut: bone", [A, "--shadows", *CUT]),
    ("slice view", [A, "--mode", "dvr", "--cut-face", "density", "--window", "2500", "--level", "700", *CUT]),
    ("cut: both", [A, B, "--cut-face", "blend", "--window", "2500", "--level", "500", *CUT]),
    ("cut: difference", [A, B, "--cut-face", "difference", "--window", "2500", "--level", "500", *CUT]),
    ("maximum", [A, "--mode", "max"]),
    ("mean", [A, "--mode", "mean", "--cylinder", "0,0,0,0,0,1,85"]),
    ("X-ray", [A, "--mode", "xray"]),
    ("maximum gradient", [A, "--mode", "max", "--gradient"]),
    ("transparent, cut: density", [A, "--opacity", "0.35", "--cut-face", "density", "--window", "2500", "--level", "700", *CUT]),
    ("slice view of both", [A, B, "--mode", "dvr", "--cut-face", "blend", "--window", "2500", "--level", "500", *CUT]),
    ("interpolant, near", [A, *NEAR]),
    ("B-spline, near", [A, "--reconstruction", "spline", *NEAR]),
    ("samples as boxes", [A, "--reconstruction", "nearest", "--shadows", *NEAR[:-1], "30"]),
    ("depths between both", [A, B, "--mode", "depths", "--shadows"]),
    ("slice of both", [A, B, "--mode", "slice", "--plane", "sagittal"]),
    ("volume rendering of both", [A, B, "--mode", "dvr"]),
]
with tempfile.TemporaryDirectory() as folder:
    command = ["montage", "-depth", "8", "-strip", "-colors", "255", "-background", "#12141a", "-fill", "white", "-pointsize", "15", "-geometry", "300x300+4+4", "-tile", "4x"]
    for n, (name, options) in enumerate(PICTURES):
        file = f"{folder}/{n}.png"
        view = [] if "--eye" in options or "--plane" in options else VIEW
        subprocess.run([program, "render", *options, *view, "--size", "300x300", "--samples", "16", "--out", file], check=True)
        command += ["-label", name, file]
    subprocess.run([*command, out], check=True)
