#!/usr/bin/env python3
"""cutaway's ray casters beside VTK's mappers, scene by scene, in one run: prints a table of times and ratios.

    benches/against_vtk.py --peers PEERS --python PYTHON [--cutaway target/release/cutaway] [--engine cpu|raycast] [--only NAME] [--frames 20]

PEERS is a folder with bench_vtk.py (one VTK measurement, one JSON line), scenes.json (camera, light, transfer functions)
and volumes/NAME.raw + NAME.json; PYTHON is an interpreter that has VTK. Both renderers get the same volume, transfer
function, light, orbit, image size and sampling distance (one voxel), one after the other, so that the ratio holds even
where the times do not carry over to another machine.

`--engine raycast` holds the GPU ray caster against VTK's GPU mapper (on a machine without a GPU both run on Mesa's software
drivers, lavapipe and llvmpipe), and has a scene of an isosurface, which VTK's CPU mapper lacks.

`--distances` adds how far the first picture of each is from that of cutaway's reference engine: the root mean square of
the differences of red, green and blue over black, of 255. PYTHON then needs numpy and pillow, too. The reference takes
steps of `--reference-step` voxels: of one, it tells how alike two programs take the same samples; of less, how near each
comes to the integral. It is slow, half a minute a scene and more: name scenes with `--only`.
"""
import argparse
import json
import math
import os
import subprocess
import sys
import tempfile

# name, volume, transfer function, shaded, mode
SCENES = [
    ("head256 opaque, shaded", "head_256_u16", "opaque", True, "composite"),
    ("head256 medium, shaded", "head_256_u16", "medium", True, "composite"),
    ("head256 transparent, unshaded", "head_256_u16", "transparent", False, "composite"),
    ("head256 transparent, shaded", "head_256_u16", "transparent", True, "composite"),
    ("head256 MIP", "head_256_u16", "opaque", False, "mip"),
    ("vessel512 opaque, shaded", "vessel_512_u16", "opaque", True, "composite"),
    ("head512 opaque, shaded", "head_512_u16", "opaque", True, "composite"),
    ("Marschner-Lobb 256 transparent, unshaded", "ml_256_u8", "transparent", False, "composite"),
    ("engine opaque, shaded", "engine", "opaque", True, "composite"),
    ("bonsai medium, shaded", "bonsai", "medium", True, "composite"),
]
# VTK's mapper for the CPU has no isosurfaces.
GPU_SCENES = SCENES + [("head256 isosurface, shaded", "head_256_u16", "opaque", True, "iso")]

MAPPERS = {"cpu": "fixed", "raycast": "gpu"}


def family(volume):
    for name in ("head", "vessel", "ml"):
        if volume.startswith(name):
            return name
    return "u8"


def points(color, opacity):
    """Separate colour and opacity functions as one list of points (a point wherever either has one)."""

    def at(nodes, value):
        if value <= nodes[0][0]:
            return nodes[0][1:]
        for a, b in zip(nodes, nodes[1:]):
            if value <= b[0]:
                w = (value - a[0]) / (b[0] - a[0])
                return [p + (q - p) * w for p, q in zip(a[1:], b[1:])]
        return nodes[-1][1:]

    values = sorted({n[0] for n in color} | {n[0] for n in opacity})
    return [{"value": v, "color": list(at(color, v)), "opacity": at(opacity, v)[0]} for v in values]


def scene(definitions, meta, path, tf, shade, mode, engine):
    camera, light = definitions["camera"], definitions["shading"]
    preset = definitions["presets"][family(meta["name"])]
    function = definitions["mip"][meta["dtype"]] if mode == "mip" else preset[tf]
    azimuth, elevation = math.radians(camera["az0_deg"]), math.radians(camera["elevation_deg"])
    direction = [math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)]
    # A raw volume's first voxel is at the origin; the scenes centre theirs on the focal point.
    focal = [f - o for f, o in zip(camera["focal"], meta["origin"])]
    return {
        "volume": {"path": path, "dims": meta["dims"], "spacing": meta["spacing"],
                   "type": {"u8": "uint8", "u16": "uint16"}[meta["dtype"]]},
        "transfer_function": {"unit_distance": definitions["opacity_unit"],
                              "points": points(function["color"], function["opacity"])},
        "camera": {"position": [f + camera["distance"] * d for f, d in zip(focal, direction)], "focal_point": focal,
                   "view_up": camera["up"], "view_angle": camera["fov_y_deg"]},
        "lighting": {"shade": shade, "ambient": light["ambient"], "diffuse": light["diffuse"],
                     "specular": light["specular"], "specular_power": light["power"]},
        "render": {"mode": mode, "step": 1.0, "engine": engine, "resolution": [512, 512],
                   **({"iso": [preset["iso"]]} if mode == "iso" else {})},
    }


def with_scene(description, command):
    """Runs a command of cutaway with a scene; what it printed."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "scene.json")
        with open(path, "w") as file:
            json.dump(description, file)
        done = subprocess.run(command + ["--scene", path], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"{' '.join(command)}: {done.stderr.strip()}")
        return done.stdout


def run_cutaway(binary, description, frames, png):
    command = [binary, "bench", "frame", "--frames", str(frames), "--orbit", "360", "--threads", "2"]
    command += ["--output", png] if png else []
    return json.loads(with_scene(description, command))


def run_reference(binary, description, step, png):
    with_scene(description, [binary, "render", "--engine", "reference", "--step", str(step), "--quiet", "-o", png])


# Runs under PYTHON: prints the distance of each picture from the first one.
DISTANCES = """
import sys
import numpy
from PIL import Image

def over_black(path):
    pixels = numpy.asarray(Image.open(path).convert("RGBA"), dtype=float)
    return pixels[..., :3] * pixels[..., 3:] / 255.0

reference = over_black(sys.argv[1])
for path in sys.argv[2:]:
    print(numpy.sqrt(numpy.mean((over_black(path) - reference) ** 2)))
"""


def distances(python, reference, pictures):
    command = [python, "-c", DISTANCES, reference, *pictures]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{python} cannot compare pictures: {done.stderr.strip()[-300:]}")
    return [float(line) for line in done.stdout.split()]


def run_vtk(peers, python, mapper, volume, tf, shade, mode, frames, png):
    command = [python, os.path.join(peers, "bench_vtk.py"), "--mapper", mapper, "--volume", volume, "--size", "512",
               "--frames", str(frames)]
    command += ["--tf", tf] if mode == "composite" else ["--blend", mode]
    command += ["--shade"] if shade else []
    command += ["--png", png] if png else []
    environment = dict(os.environ, VTK_DEFAULT_OPENGL_WINDOW="vtkOSOpenGLRenderWindow")
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if not lines:
        sys.exit(f"VTK failed on {volume}: {done.stderr[-300:]}")
    return json.loads(lines[-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peers", required=True)
    parser.add_argument("--python", required=True)
    parser.add_argument("--cutaway", default="target/release/cutaway")
    parser.add_argument("--engine", choices=MAPPERS, default="cpu")
    parser.add_argument("--only", default="")
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--images", help="folder for the first frame of each")
    parser.add_argument("--skip-vtk", action="store_true")
    parser.add_argument("--distances", action="store_true", help="compare the pictures with the reference engine's")
    parser.add_argument("--reference-step", type=float, default=1.0, help="steps of the reference, in voxels [1]")
    a = parser.parse_args()
    with open(os.path.join(a.peers, "scenes.json")) as file:
        definitions = json.load(file)
    columns = ["scene", "VTK ms", "cutaway ms", "VTK / cutaway", "VTK first frame ms", "prepare + classify + first ms",
               "VTK MB", "cutaway MB"]
    columns += ["VTK from reference", "cutaway from reference"] * a.distances
    print("| " + " | ".join(columns) + " |")
    print("|---" * len(columns) + "|", flush=True)
    with tempfile.TemporaryDirectory() as temporary:
        for name, volume, tf, shade, mode in GPU_SCENES if a.engine == "raycast" else SCENES:
            if a.only in name:
                row = compare(a, definitions, a.images or temporary, (name, volume, tf, shade, mode))
                print("| " + " | ".join(row) + " |", flush=True)


def compare(a, definitions, images, which):
    """The cells of a scene's row."""
    name, volume, tf, shade, mode = which
    folder = os.path.join(a.peers, "volumes")
    with open(os.path.join(folder, volume + ".json")) as file:
        meta = dict(json.load(file), name=volume)
    wanted = a.images or a.distances
    png = lambda who: wanted and os.path.join(images, f"{name.replace(' ', '_').replace(',', '')}_{who}.png")
    path = os.path.abspath(os.path.join(folder, volume + ".raw"))
    description = scene(definitions, meta, path, tf, shade, mode, a.engine)
    ours = run_cutaway(a.cutaway, description, a.frames, png("cutaway"))
    first = ours["prepare_ms"] + ours["classify_ms"] + ours["frame_ms"]["max"]
    ms, mb = ours["frame_ms"]["median"], ours["peak_rss_bytes"] / 1e6
    if a.skip_vtk:
        row = [name, "", f"{ms:.1f}", "", "", f"{first:.0f}", "", f"{mb:.0f}"]
    else:
        vtk = run_vtk(a.peers, a.python, MAPPERS[a.engine], volume, tf, shade, mode, a.frames, png("vtk"))
        row = [name, f"{vtk['ms_median']:.1f}", f"{ms:.1f}", f"{vtk['ms_median'] / ms:.2f}",
               f"{vtk['first_frame_ms']:.0f}", f"{first:.0f}", f"{vtk['peak_rss_mb']:.0f}", f"{mb:.0f}"]
    if a.distances:
        run_reference(a.cutaway, description, a.reference_step, png("reference"))
        pictures = [png("cutaway")] if a.skip_vtk else [png("vtk"), png("cutaway")]
        found = [f"{d:.2f}" for d in distances(a.python, png("reference"), pictures)]
        row += [""] * a.skip_vtk + found
    return row


if __name__ == "__main__":
    main()
