"""Raw fixtures: voxels whose meaning is in the file name or in a side file."""

import json

import numpy as np
from nibabel.affines import from_matvec

from .labelled import disk


def raw_fixtures(out):
    """Everything below fixtures/raw: files whose meaning is in their name or in a side file."""
    spaced = from_matvec(np.diag([1.0, 2.0, 4.5]))
    for dtype in ("int16", "uint8", "float32"):
        voxels = out.rng.integers(0, 200, (5, 4, 3)).astype(dtype)
        out.add(f"raw/name_5x4x3_{dtype}.raw", disk(voxels), "dimensions and type in the name", voxels, np.eye(4))

    voxels = out.rng.integers(0, 60_000, (5, 4, 3)).astype("uint16")
    side = {"dims": [5, 4, 3], "type": "uint16", "spacing": [1, 2, 4.5], "big_endian": True}
    out.part("raw/big_endian.json", json.dumps(side).encode())
    out.add("raw/big_endian.raw", disk(voxels, ">"), "big-endian by the side file", voxels, spaced)

    side = {"dims": [5, 4, 3], "type": "uint16", "header_bytes": 16}
    out.part("raw/header_bytes.json", json.dumps(side).encode())
    out.add("raw/header_bytes.raw", b"\xee" * 16 + disk(voxels), "16 bytes before the voxels", voxels, np.eye(4))

    side = {"name": "Synthetic", "type": "int16", "size": [5, 4, 3], "spacing": [1, 2, 4.5], "description": "values"}
    voxels = out.rng.integers(-3000, 3000, (5, 4, 3)).astype("int16")
    for data, about in (("scivis.raw", "scivis.json"), ("scivis_named_5x4x3_int16.raw", "scivis_named.json")):
        out.part(f"raw/{about}", json.dumps(side, indent=1).encode())
        out.add(f"raw/{data}", disk(voxels), f"an open-scivis side file, {about}", voxels, spaced)
