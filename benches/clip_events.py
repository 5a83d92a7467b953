#!/usr/bin/env python3
"""Plots what the events of all pixels cost, over triangles and image size, into docs/images/clip-events.svg.

    benches/clip_events.py [OUTPUT_OF_THE_BENCHMARK]

Without an argument it runs `cargo bench -p cutaway-mesh --bench events -- --table` (some minutes). Only Python's standard
library is needed. Run it on a quiet machine.
"""

import math
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
COLORS = {"grid": "#8c6bb1", "octree": "#41ab5d", "bvh": "#2171b5", "raster": "#d94801"}
ROW = re.compile(r"^(sphere (\d+)|bunny[^ ]*(?: \S+)*?)\s+(grid|octree|bvh|raster)\s+\S+\s+\S+\s+(\S+)\s+(\S+)\s+(\S+)\s*$")


def rows(text):
    """(mesh, triangles, finder, ms at 256, 512, 1024 pixels a side)."""
    for line in text.splitlines():
        if match := ROW.match(line.strip()):
            triangles = int(match[2]) if match[2] else 69451
            yield match[1], triangles, match[3], [float(match[i]) for i in (4, 5, 6)]


def panel(left, title, label, lines, ticks):
    """A log-log plot of {finder: [(x, ms)]}."""
    width, height, top = 330, 260, 50
    points = [p for line in lines.values() for p in line]
    x0, x1 = math.log10(min(x for x, _ in points)), math.log10(max(x for x, _ in points))
    y0, y1 = math.floor(math.log10(min(y for _, y in points))), math.ceil(math.log10(max(y for _, y in points)))
    at = lambda x, y: (
        left + (math.log10(x) - x0) / (x1 - x0) * width,
        top + height - (math.log10(y) - y0) / (y1 - y0) * height,
    )
    out = [f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#999"/>']
    out.append(f'<text x="{left + width / 2}" y="{top - 14}" text-anchor="middle" font-weight="bold">{title}</text>')
    out.append(f'<text x="{left + width / 2}" y="{top + height + 42}" text-anchor="middle">{label}</text>')
    for decade in range(y0, y1 + 1):
        y = at(10**x0, 10.0**decade)[1]
        out.append(f'<line x1="{left}" x2="{left + width}" y1="{y:.1f}" y2="{y:.1f}" stroke="#ddd"/>')
        out.append(f'<text x="{left - 6}" y="{y + 4:.1f}" text-anchor="end">{10.0**decade:g}</text>')
    for value, name in ticks:
        x = at(value, 10.0**y0)[0]
        out.append(f'<text x="{x:.1f}" y="{top + height + 18}" text-anchor="middle">{name}</text>')
    for finder, line in lines.items():
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in (at(*p) for p in sorted(line)))
        out.append(f'<polyline points="{path}" fill="none" stroke="{COLORS[finder]}" stroke-width="2"/>')
    return out


def main():
    if len(sys.argv) > 1:
        text = pathlib.Path(sys.argv[1]).read_text()
    else:
        command = ["cargo", "bench", "--locked", "-p", "cutaway-mesh", "--bench", "events", "--", "--table"]
        text = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
        print(text)
    found = list(rows(text))
    if not found:
        sys.exit("error: no row of the benchmark's table was found")
    by_triangles, by_size = {}, {}
    largest = max((r for r in found if r[0].startswith("sphere")), key=lambda r: r[1])[1]
    for mesh, triangles, finder, (small, middle, large) in found:
        if mesh.startswith("sphere"):
            by_triangles.setdefault(finder, []).append((triangles, middle))
        if triangles == largest:
            by_size[finder] = [(256, small), (512, middle), (1024, large)]
    counts = sorted({x for line in by_triangles.values() for x, _ in line})
    parts = ['<svg xmlns="http://www.w3.org/2000/svg" width="880" height="380" font-family="sans-serif" font-size="12">']
    parts.append('<rect width="880" height="380" fill="white"/>')
    ticks = [(n, f"{n:,}") for n in counts]
    parts += panel(70, "512 x 512 pixels", "triangles of a sphere", by_triangles, ticks)
    sizes = [(n, f"{n}²") for n in (256, 512, 1024)]
    parts += panel(480, f"{largest:,} triangles", "pixels of the image", by_size, sizes)
    parts.append('<text transform="translate(20,180) rotate(-90)" text-anchor="middle">ms, events of all pixels</text>')
    for i, (finder, color) in enumerate(COLORS.items()):
        parts.append(f'<rect x="{80 + 90 * i}" y="{58}" width="12" height="12" fill="{color}"/>')
        parts.append(f'<text x="{96 + 90 * i}" y="{68}">{finder}</text>')
    parts.append("</svg>")
    (ROOT / "docs/images/clip-events.svg").write_text("\n".join(parts) + "\n")


if __name__ == "__main__":
    main()
