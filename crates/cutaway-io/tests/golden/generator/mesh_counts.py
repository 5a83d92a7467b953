"""Counts of mesh files, from readers of a few lines each that share nothing with cutaway's.

    python3 mesh_counts.py FOLDER > ../meshes.json

Vertices of STL at the same place are merged before anything is counted.
"""

import gzip
import json
import struct
import sys
from collections import Counter
from pathlib import Path

FLOAT = struct.Struct("<f")


def f32(value):
    return FLOAT.unpack(FLOAT.pack(float(value)))[0] + 0.0


def ply(data):
    head, body = data.split(b"end_header\n", 1)
    elements, form = [], None
    for line in head.decode().splitlines():
        word = line.split()
        if word[0] == "format":
            form = word[1]
        elif word[0] == "element":
            elements.append((word[1], int(word[2]), []))
        elif word[0] == "property":
            elements[-1][2].append(word[1:])
    codes = {"char": "b", "uchar": "B", "int": "i", "float": "f", "float32": "f", "uint8": "B", "int32": "i"}
    vertices, faces = [], []
    lines, words, at = iter(body.splitlines()), None, 0

    def take(kind):
        nonlocal at
        if words is not None:
            return float(next(words))
        code = struct.Struct("<" + codes[kind])
        (value,) = code.unpack_from(body, at)
        at += code.size
        return value

    for name, count, properties in elements:
        for _ in range(count):
            row = {}
            if form == "ascii":
                words = iter(next(lines).split())
            for p in properties:
                if p[0] == "list":
                    row[p[3]] = [take(p[2]) for _ in range(int(take(p[1])))]
                else:
                    row[p[1]] = take(p[0])
            if name == "vertex":
                vertices.append(tuple(f32(row[a]) for a in "xyz"))
            elif name == "face":
                faces.append([int(v) for v in row["vertex_indices"]])
    return vertices, faces


def merged(corners):
    number, vertices, faces = {}, [], []
    for i, corner in enumerate(corners):
        if corner not in number:
            number[corner] = len(vertices)
            vertices.append(corner)
        if i % 3 == 0:
            faces.append([])
        faces[-1].append(number[corner])
    return vertices, faces


def stl(data):
    (count,) = struct.unpack_from("<I", data, 80)
    if len(data) == 84 + 50 * count:
        corners = []
        for t in range(count):
            v = struct.unpack_from("<12f", data, 84 + 50 * t)[3:]
            corners += [tuple(c + 0.0 for c in v[i : i + 3]) for i in (0, 3, 6)]
    else:
        lines = (line.split() for line in data.decode().splitlines())
        corners = [tuple(map(f32, w[1:4])) for w in lines if w and w[0].lower() == "vertex"]
    return merged(corners)


def obj(data):
    lines = [line.split() for line in data.decode().splitlines()]
    vertices = [tuple(map(f32, w[1:4])) for w in lines if w and w[0] == "v"]
    faces = [[int(c.split("/")[0]) - 1 for c in w[1:]] for w in lines if w and w[0] == "f"]
    return vertices, faces


def glb(data):
    (length,) = struct.unpack_from("<I", data, 12)
    doc, binary = json.loads(data[20 : 20 + length]), data[28 + length :]
    # Only what the duck needs: one mesh below one matrix that scales.
    scale = doc["nodes"][0]["matrix"][0]
    primitive = doc["meshes"][0]["primitives"][0]

    def numbers(index, code, width):
        a = doc["accessors"][index]
        start = doc["bufferViews"][a["bufferView"]].get("byteOffset", 0) + a.get("byteOffset", 0)
        flat = struct.unpack_from(f"<{a['count'] * width}{code}", binary, start)
        return [flat[i : i + width] for i in range(0, len(flat), width)]

    positions = numbers(primitive["attributes"]["POSITION"], "f", 3)
    vertices = [tuple(f32(c * scale) for c in p) for p in positions]
    indices = [i for (i,) in numbers(primitive["indices"], "H", 1)]
    return vertices, [indices[i : i + 3] for i in range(0, len(indices), 3)]


def boundary(faces):
    uses = Counter()
    for face in faces:
        for a, b in zip(face, face[1:] + face[:1]):
            uses[min(a, b), max(a, b)] += 1
    return uses


def golden(name, vertices, faces):
    triangles = [[f[0], f[i], f[i + 1]] for f in faces for i in range(1, len(f) - 1)]
    whole = [t for t in triangles if len(set(t)) == 3]
    uses = boundary(whole)
    used = {v for t in whole for v in t}
    volume = 0.0
    for a, b, c in ([vertices[v] for v in t] for t in triangles):
        volume += (
            a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
        ) / 6
    return {
        "file": name,
        "vertices": len(vertices),
        "triangles": len(triangles),
        "low": [min(vertices[v][i] for t in triangles for v in t) for i in range(3)],
        "high": [max(vertices[v][i] for t in triangles for v in t) for i in range(3)],
        "volume": volume,
        "euler": len(used) - len(uses) + len(whole),
        "boundary_edges": sum(n == 1 for n in uses.values()),
        "non_manifold_edges": sum(n > 2 for n in uses.values()),
    }


def main():
    readers = {"ply": ply, "stl": stl, "obj": obj, "glb": glb}
    goldens = []
    for path in sorted(Path(sys.argv[1]).iterdir()):
        data = path.read_bytes()
        if path.suffix == ".gz":
            data = gzip.decompress(data)
        kind = path.name.lower().removesuffix(".gz").rsplit(".", 1)[-1]
        if kind in readers:
            goldens.append(golden(path.name, *readers[kind](data)))
    json.dump(goldens, sys.stdout, indent=1)
    print()


main()
