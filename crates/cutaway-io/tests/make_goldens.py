#!/usr/bin/env python3
"""Writes the fixtures and golden values that the volume readers are tested against.

    python make_goldens.py --data FOLDER_WITH_THE_REAL_VOLUMES

What enters: nothing but a fixed seed, and the real volumes for their golden values. What leaves:

- `fixtures/{nifti,nrrd,metaimage,raw}/`: small synthetic files, each about one corner of its format;
- `golden/{nifti,nrrd,metaimage,raw}.json`: what an independent library reads from each of them and from the real
  volumes. `golden/README.md` describes the fields.

The fixtures are made by `golden/generator/write_*.py`, the libraries are asked by `golden/generator/readers.py`.

Every fixture is held to three things before its golden value is written: the library reads the voxels that were put
in; where the geometry was given, it reads that geometry; and a second library, where there is one, agrees, or the
disagreement stands in DISAGREEMENTS with its reason.

Geometry is written as `affine_ras`: world (mm, RAS) from voxel (centres at integers). LPS files are turned by
diag(-1, -1, 1). Where a file does not say what its axes mean, `oriented` is false and the file's own axes are kept.

Needs numpy, nibabel, pynrrd and SimpleITK; the versions that were used stand in each golden entry.
"""

import argparse
import itertools
import json
import logging
import shutil
import sys
import tempfile
import zlib
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from nibabel.orientations import aff2axcodes

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "golden"))

from generator.labelled import Fixtures, axis_orders, check_labels  # noqa: E402
from generator.readers import read_both, without_nonfinite  # noqa: E402
from generator.write_metaimage import metaimage_fixtures  # noqa: E402
from generator.write_nifti import nifti_fixtures  # noqa: E402
from generator.write_nrrd import nrrd_fixtures  # noqa: E402
from generator.write_raw import raw_fixtures  # noqa: E402

SEED = 20240229
SIZE_LIMIT = 600 * 1024

# Where the second library reads a file differently, and why the first one is believed.
DISAGREEMENTS = {
    "nifti/sform_over_qform.nii": "ITK takes the qform where the sform is not orthogonal; the sform counts",
    "nifti/pixdim_ignored.nii": "ITK takes directions from the sform but lengths from pixdim; the sform says both",
    "nifti/two_d.nii": "ITK keeps two dimensions of the sform only",
    "nifti/float32_nonfinite.nii": "ITK's NIfTI library turns NaN and infinities into 0",
    "nifti/scl_slope_zero.nii": "the standard says that slope 0 means no scaling; ITK still adds the intercept",
    "nifti/pixdim_negative.nii": "pixdim is positive, only pixdim[0] may flip an axis; ITK flips, nibabel does not",
    "nifti/neither_negative_pixdim.nii": "as pixdim_negative.nii",
    "nrrd/axis_mins_maxs_node.nrrd": "Teem derives a missing spacing from mins and maxs; ITK takes 1",
    "nrrd/axis_mins_maxs_cell.nrrd": "as axis_mins_maxs_node.nrrd",
    "nrrd/space_rast_4d.nrrd": "ITK converts to LPS only in spaces of three dimensions and keeps RAST as it is",
}


def sample_points(dims, name):
    """The corners and eight more voxels, the same on every run."""
    rng = np.random.default_rng([SEED, zlib.crc32(name.encode())])
    points = list(itertools.product(*[(0, n - 1) for n in dims]))
    points += [tuple(int(rng.integers(n)) for n in dims) for _ in range(8)]
    return list(dict.fromkeys(points))


def plain(value):
    """A JSON number: an integer where the voxels are integers."""
    return int(value) if isinstance(value, (int, np.integer)) else float(value)


def second_opinion(primary, other, name):
    """What the second library says; stops where it differs without a reason on record."""
    if isinstance(other, str):
        return {"reader": other, "verdict": "refuses the file"}
    differs = []
    if primary.values.shape != other.values.shape:
        differs.append("dims")
    elif not np.allclose(primary.values, other.values, rtol=1e-6, atol=1e-6, equal_nan=True):
        differs.append("values")
    if not np.allclose(primary.affine, other.affine, rtol=1e-5, atol=1e-4):
        differs.append("affine")
    if not differs:
        assert name not in DISAGREEMENTS, f"{name}: {other.reader} agrees by now"
        return {"reader": other.reader, "verdict": "agrees"}
    assert name in DISAGREEMENTS, f"{name}: {other.reader} differs in {differs}\n{primary}\n{other}"
    return {"reader": other.reader, "verdict": "differs in " + ", ".join(differs), "why": DISAGREEMENTS[name]}


def golden_entry(place, name, what, primary, other):
    """One entry of a golden file."""
    values, replaced = without_nonfinite(primary.values)
    entry = {
        **place,
        "what": what,
        "reader": primary.reader,
        "dims": list(values.shape),
        "type": primary.dtype,
        "affine_ras": (primary.affine + 0.0).tolist(),
        "orientation": list(aff2axcodes(primary.affine)),
        "oriented": primary.oriented,
        "range": [plain(values.min()), plain(values.max())],
        "mean": float(values.mean(dtype="float64")),
        "samples": [[*p, plain(values[p])] for p in sample_points(values.shape, name)],
    }
    if replaced:
        entry["replaced"] = replaced
    if other is not None:
        entry["second_opinion"] = second_opinion(primary, other, name)
    return entry


def golden_of_fixture(root, fixture):
    """Reads a fixture back, holds it to what was put in, and gives its entry."""
    name = fixture.path
    primary, other = read_both(root / name, name.split("/")[0])
    assert not isinstance(primary, str), f"{name}: no library reads it"
    assert primary.values.shape == fixture.values.shape, f"{name}: {primary.values.shape}"
    assert np.array_equal(primary.values, fixture.values, equal_nan=fixture.values.dtype.kind == "f"), f"{name}: values"
    if fixture.affine is not None:
        assert np.allclose(primary.affine, fixture.affine, rtol=1e-5, atol=1e-5), f"{name}: {primary.affine}"
    if fixture.labelled:
        check_labels(primary.values, primary.affine, name)
    return golden_entry({"file": name}, name, fixture.what, primary, other)


REAL = {
    "nifti": ["*.nii.gz"],
    "nrrd": ["*.nrrd", "*.nhdr"],
    "metaimage": ["*.mhd"],
    "raw": ["engine_*.raw", "neghip_*.raw"],
}


def golden_of_data(data, format_name):
    """Entries of the real volumes of a format."""
    for path in sorted(p for pattern in REAL[format_name] for p in data.glob(pattern)):
        primary, other = read_both(path, format_name)
        yield golden_entry({"data": path.name}, path.name, "a real volume", primary, other)


def check_axis_orders(fixtures):
    """All 48 orders are there in each format, and each was held to its labels."""
    codes = {code for code, _, _ in axis_orders()}
    assert len(codes) == 48
    for stem, suffix in (("nifti/axes_", ".nii"), ("nifti/axes_qform_", ".nii"), ("nrrd/axes_", ".nrrd"),
                         ("metaimage/axes_", ".mha")):
        held = {f.path for f in fixtures if f.labelled}
        assert all(f"{stem}{code}{suffix}" in held for code in codes), stem


def write_golden(path, entries):
    """A JSON list with an entry a line, so that a change shows as the lines it concerns."""
    lines = ",\n".join(json.dumps(entry, allow_nan=False) for entry in entries)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"[\n{lines}\n]\n")


def main():
    """Writes the fixtures, reads them and the real volumes back, writes the golden files."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--data", type=Path, required=True, help="folder with the real volumes")
    arguments = parser.parse_args()
    # Both libraries warn about the very headers that the fixtures are about.
    sitk.ProcessObject.SetGlobalWarningDisplay(False)
    logging.getLogger("nibabel").setLevel(logging.CRITICAL)

    with tempfile.TemporaryDirectory() as scratch:
        out = Fixtures(Path(scratch), np.random.default_rng(SEED))
        for write in (nifti_fixtures, nrrd_fixtures, metaimage_fixtures, raw_fixtures):
            write(out)
        check_axis_orders(out.entries)
        golden = {format_name: [] for format_name in REAL}
        for fixture in out.entries:
            golden[fixture.path.split("/")[0]].append(golden_of_fixture(out.root, fixture))
        unused = DISAGREEMENTS.keys() - {fixture.path for fixture in out.entries}
        assert not unused, f"disagreements about no fixture: {unused}"
        files = [path for path in out.root.rglob("*") if path.is_file()]
        total = sum(path.stat().st_size for path in files)
        assert total < SIZE_LIMIT, f"{total} bytes of fixtures"
        # Only what every check has passed reaches the tree.
        shutil.copytree(out.root, HERE / "fixtures", dirs_exist_ok=True)

    for format_name, entries in golden.items():
        entries.extend(golden_of_data(arguments.data, format_name))
        write_golden(HERE / "golden" / f"{format_name}.json", entries)
        print(f"{format_name}: {len(entries)} entries")
        for entry in entries:
            opinion = entry.get("second_opinion", {"verdict": "agrees"})
            if opinion["verdict"] != "agrees":
                name = entry.get("file") or entry["data"]
                print(f"  {name}: {opinion['reader']} {opinion['verdict']}")
    print(f"{len(files)} fixture files, {total} bytes")


if __name__ == "__main__":
    main()
