#!/usr/bin/env python3
"""Frame time of the CPU engine over volume size and image size: writes docs/images/scaling.svg and the table in
docs/performance.md.

    cargo build --release && benches/scaling.py

Each point is the median of `--frames` frames of an orbit, by `cutaway bench frame`, of `sample:sphere:SIZE` in steps of one
voxel with light. The transfer function `full` shows every voxel, so faintly that no ray ends early; `mostly empty` shows
a ball of a fifth of the box's width. `--largest 768` and `--largest 1024` go on to larger volumes, at 4 and 9 GiB of memory (their voxels are floats);
what would not fit the memory that is free is left out, and said so. `--dry-run` prints the table and writes nothing. Only
the standard library is used.
"""
import argparse
import json
import math
import os
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
VOLUMES = [64, 128, 256, 512, 768, 1024]
# The program's peak memory a voxel while it makes such a volume.
BYTES_A_VOXEL = 8.5
IMAGES = [128, 256, 512, 1024, 2048]
# What stays the same while the other one changes.
VOLUME, IMAGE = 256, 512
FUNCTIONS = ["full", "mostly empty"]
BEGIN, END = "<!-- scaling: written by benches/scaling.py -->", "<!-- scaling: end -->"


def function(name, size):
    """Opacities are a voxel's: divided by the size, a ray through the middle meets as much whatever the size."""
    color = [[0.2, 0.4, 0.8], [1.0, 0.8, 0.3]]
    if name == "full":
        points = [(-0.75, color[0], 0.5 / size), (1.0, color[1], 2.0 / size)]
    else:
        points = [(0.8, color[0], 0.0), (1.0, color[1], 8.0 / size)]
    return {"points": [{"value": v, "color": c, "opacity": a} for v, c, a in points]}


def fits(size):
    """Whether a volume fits the free memory, where the system tells how much there is."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            free = next(int(line.split()[1]) * 1024 for line in file if line.startswith("MemAvailable"))
    except (OSError, StopIteration):
        return True
    if size**3 * BYTES_A_VOXEL <= free:
        return True
    print(f"left out: {size} voxels a side need {int(size**3 * BYTES_A_VOXEL) >> 20} MiB, {free >> 20} are free", file=sys.stderr)
    return False


def measure(program, folder, name, size, image, frames):
    scene = {
        "volume": f"sample:sphere:{size}",
        "transfer_function": function(name, size),
        "lighting": {"shade": True},
        "render": {"mode": "composite", "step": 1.0, "engine": "cpu", "resolution": [image, image]},
    }
    path = os.path.join(folder, "scene.json")
    with open(path, "w", encoding="utf-8") as file:
        json.dump(scene, file)
    run = subprocess.run(
        [program, "bench", "frame", "--scene", path, "--frames", str(frames)], capture_output=True, text=True
    )
    if run.returncode != 0:
        sys.exit(f"{program}, {name}, {size} voxels, {image} pixels: {run.stderr.strip()}")
    found = json.loads(run.stdout)
    print(f"{name}: {size} voxels, {image} pixels: {found['frame_ms']['median']:.2f} ms", file=sys.stderr)
    return {
        "function": name,
        "size": size,
        "image": image,
        "ms": found["frame_ms"]["median"],
        "samples": found["samples"],
        "simd": found["simd"],
        "threads": found["threads"],
    }


# The plot: two panels side by side, logarithmic both ways, one scale of times for both.
PANEL_W, PANEL_H, LEFT, TOP, GAP, BOTTOM = 330, 300, 70, 50, 60, 60
COLORS = {"full": "#1f5fa8", "mostly empty": "#c2571a"}


def time_range(rows):
    times = [row["ms"] for row in rows]
    return 10 ** math.floor(math.log10(min(times))), 10 ** math.ceil(math.log10(max(times)))


def panel(rows, key, left, title, label, slope, times):
    """One panel; `slope` is that of the dashed line through the middle of `full`: cost that grows like the samples."""
    values = sorted({row[key] for row in rows})
    lo, hi = values[0], values[-1]
    x = lambda v: left + 12 + (PANEL_W - 24) * math.log(v / lo) / math.log(hi / lo)
    y = lambda ms: TOP + PANEL_H * (1 - math.log(ms / times[0]) / math.log(times[1] / times[0]))
    out = [f'<text x="{left + PANEL_W / 2}" y="{TOP - 16}" text-anchor="middle" font-weight="bold">{title}</text>']
    tick = times[0]
    while tick <= times[1] * 1.001:
        out.append(f'<path d="M{left} {y(tick):.1f}h{PANEL_W}" stroke="#ddd"/>')
        out.append(f'<text x="{left - 8}" y="{y(tick) + 4:.1f}" text-anchor="end">{tick:g}</text>')
        tick *= 10
    for v in values:
        out.append(f'<path d="M{x(v):.1f} {TOP + PANEL_H}v5" stroke="#444"/>')
        out.append(f'<text x="{x(v):.1f}" y="{TOP + PANEL_H + 20}" text-anchor="middle">{v}</text>')
    out.append(f'<path d="M{left} {TOP}v{PANEL_H}h{PANEL_W}" fill="none" stroke="#444"/>')
    out.append(f'<text x="{left + PANEL_W / 2}" y="{TOP + PANEL_H + 44}" text-anchor="middle">{label}</text>')
    for name in FUNCTIONS:
        line = sorted((row[key], row["ms"]) for row in rows if row["function"] == name)
        points = " ".join(f"{x(v):.1f},{y(ms):.1f}" for v, ms in line)
        if name == "full":
            v0, ms0 = line[len(line) // 2]
            ends = [(v, ms0 * (v / v0) ** slope) for v in (lo, hi)]
            # Only what lies within the times shown.
            ends = [(v, min(max(ms, times[0]), times[1])) for v, ms in ends]
            ends = [(v0 * (ms / ms0) ** (1 / slope), ms) for _, ms in ends]
            (va, a), (vb, b) = ends
            out.append(
                f'<path d="M{x(va):.1f} {y(a):.1f}L{x(vb):.1f} {y(b):.1f}" stroke="#888" stroke-dasharray="5 4"/>'
            )
        color = COLORS[name]
        out.append(f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="2"/>')
        out += [f'<circle cx="{x(v):.1f}" cy="{y(ms):.1f}" r="3.5" fill="{color}"/>' for v, ms in line]
    return out


def legend(left):
    out, at = [], left
    for name in FUNCTIONS:
        out.append(f'<path d="M{at} 14h24" stroke="{COLORS[name]}" stroke-width="2"/>')
        out.append(f'<text x="{at + 30}" y="18">{name}</text>')
        at += 50 + 8 * len(name)
    out.append(f'<path d="M{at} 14h24" stroke="#888" stroke-dasharray="5 4"/>')
    out.append(f'<text x="{at + 30}" y="18">as the number of samples grows</text>')
    return out


def plot(volumes, images):
    width, height = LEFT + 2 * PANEL_W + GAP + 20, TOP + PANEL_H + BOTTOM
    times = time_range(volumes + images)
    second = LEFT + PANEL_W + GAP
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        'font-family="Helvetica, Arial, sans-serif" font-size="12" fill="#222" role="img">',
        "<title>Frame time of the CPU engine over volume size and image size</title>",
        f'<rect width="{width}" height="{height}" fill="white"/>',
        *legend(LEFT),
        *panel(volumes, "size", LEFT, f"{IMAGE} x {IMAGE} pixels", "voxels a side", 1, times),
        *panel(images, "image", second, f"{VOLUME} x {VOLUME} x {VOLUME} voxels", "pixels a side", 2, times),
        f'<text transform="translate(18 {TOP + PANEL_H / 2}) rotate(-90)" text-anchor="middle">'
        "milliseconds a frame</text>",
        "</svg>",
    ]
    return "\n".join(out) + "\n"


def table(volumes, images, frames):
    first = volumes[0]
    lines = [
        f"Medians of {frames} frames, {first['threads']} threads, {first['simd']}.",
        "",
        "| voxels a side | pixels a side | full: ms | million samples/s | mostly empty: ms | million samples/s |",
        "|---|---|---|---|---|---|",
    ]
    seen = set()
    for row in volumes + images:
        place = (row["size"], row["image"])
        if place in seen:
            continue
        seen.add(place)
        cells = []
        for name in FUNCTIONS:
            found = next(r for r in volumes + images if (r["size"], r["image"], r["function"]) == (*place, name))
            cells.append(f"{found['ms']:.2f} | {found['samples'] / found['ms'] / 1e3:.0f}")
        lines.append(f"| {place[0]} | {place[1]} | {cells[0]} | {cells[1]} |")
    return "\n".join(lines) + "\n"


def write(path, text):
    """Whole or not at all."""
    with open(path + ".new", "w", encoding="utf-8") as file:
        file.write(text)
    os.replace(path + ".new", path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    target = os.environ.get("CARGO_TARGET_DIR", os.path.join(ROOT, "target"))
    parser.add_argument("--cutaway", default=os.path.join(target, "release", "cutaway"), help="the program")
    parser.add_argument("--frames", type=int, default=20, help="frames a point [20]")
    parser.add_argument("--largest", type=int, default=512, help="voxels a side of the largest volume, up to 1024 [512]")
    parser.add_argument("--dry-run", action="store_true", help="write nothing")
    options = parser.parse_args()
    if not os.path.exists(options.cutaway):
        sys.exit(f"{options.cutaway} does not exist; run: cargo build --release")
    sizes = [size for size in VOLUMES if size <= options.largest and fits(size)]
    with tempfile.TemporaryDirectory() as folder:
        run = lambda name, size, image: measure(options.cutaway, folder, name, size, image, options.frames)
        volumes = [run(name, size, IMAGE) for size in sizes for name in FUNCTIONS]
        known = {(r["function"], r["size"], r["image"]): r for r in volumes}
        images = [
            known.get((name, VOLUME, image)) or run(name, VOLUME, image) for image in IMAGES for name in FUNCTIONS
        ]
    text = table(volumes, images, options.frames)
    print(text)
    if options.dry_run:
        return
    write(os.path.join(ROOT, "docs", "images", "scaling.svg"), plot(volumes, images))
    page = os.path.join(ROOT, "docs", "performance.md")
    with open(page, encoding="utf-8") as file:
        before, rest = file.read().split(BEGIN)
    after = rest.split(END)[1]
    write(page, f"{before}{BEGIN}\n{text}{END}{after}")


if __name__ == "__main__":
    main()
