"""NRRD fixtures, written by hand and by pynrrd.

The format: https://teem.sourceforge.net/nrrd/format.html.
"""

import bz2
import gzip
import io
import itertools
import re

import nrrd
import numpy as np
from nibabel.affines import from_matvec

from .labelled import (
    LABELLED_AFFINE, LPS_FROM_RAS, ORIGIN, RAS_FROM_LAS, ROTATED, SHAPE, SHEARED, SPACING, axis_orders, disk,
    full_range, labelled,
)

NRRD_TYPE_NAMES = {
    "int8": ["signed char", "int8", "int8_t"],
    "uint8": ["uchar", "unsigned char", "uint8", "uint8_t"],
    "int16": ["short", "short int", "signed short", "signed short int", "int16", "int16_t"],
    "uint16": ["ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"],
    "int32": ["int", "signed int", "int32", "int32_t"],
    "uint32": ["uint", "unsigned int", "uint32", "uint32_t"],
    "int64": ["longlong", "long long", "long long int", "signed long long", "signed long long int", "int64", "int64_t"],
    "uint64": ["ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"],
    "float32": ["float"],
    "float64": ["double"],
}


def nrrd_text(voxels, lines, *, magic="NRRD0004", encoding="raw", endian="little", type_name=None, eol="\n"):
    """An NRRD header up to, not including, the blank line."""
    head = [
        magic,
        f"type: {type_name or NRRD_TYPE_NAMES[voxels.dtype.name][0]}",
        f"dimension: {voxels.ndim}",
        "sizes: " + " ".join(map(str, voxels.shape)),
        f"encoding: {encoding}",
    ]
    if endian:
        head.append(f"endian: {endian}")
    return "".join(line + eol for line in head + lines).encode("ascii")


def nrrd_file(voxels, lines, *, payload=None, eol="\n", **options):
    """An NRRD file; `payload` replaces the plain voxels."""
    if payload is None:
        payload = disk(voxels, ">" if options.get("endian") == "big" else "<")
    return nrrd_text(voxels, lines, eol=eol, **options) + eol.encode() + payload


def vector(values):
    """`(1,2,3)`, each number in its shortest exact form."""
    return "(" + ",".join(repr(float(v) + 0.0) for v in values) + ")"


def nrrd_space(affine_ras, space="left-posterior-superior"):
    """The three orientation lines for a RAS affine."""
    to_file = {"l": LPS_FROM_RAS, "r": np.eye(4)}[space[0].lower()]
    affine = to_file @ affine_ras
    directions = " ".join(vector(affine[:3, axis]) for axis in range(3))
    return [f"space: {space}", f"space directions: {directions}", f"space origin: {vector(affine[:3, 3])}"]


def ascii_voxels(voxels, per_line=6):
    """Whitespace-separated numbers in file order."""
    numbers = [str(v) for v in voxels.reshape(-1, order="F")]
    rows = (numbers[at:at + per_line] for at in range(0, len(numbers), per_line))
    return "\n".join(" ".join(row) for row in rows).encode() + b"\n"


def hex_voxels(content, per_line=35):
    """Hexadecimal digits as Teem writes them, in lines."""
    digits = content.hex()
    return b"".join(digits[at:at + 2 * per_line].encode() + b"\n" for at in range(0, len(digits), 2 * per_line))


def nrrd_fixtures(out):
    """Everything below fixtures/nrrd."""
    label = labelled()
    spaces = itertools.cycle(("left-posterior-superior", "right-anterior-superior"))
    for (code, voxels, affine), space in zip(axis_orders(), spaces):
        content = nrrd_file(voxels, nrrd_space(affine, space))
        out.add(f"nrrd/axes_{code}.nrrd", content, f"{code}, written as {space}", voxels, affine, True)

    for dtype, names in NRRD_TYPE_NAMES.items():
        voxels = full_range(dtype, out.rng)
        for name in names:
            content = nrrd_file(voxels, [], type_name=name, endian="little" if voxels.itemsize > 1 else None)
            out.add(f"nrrd/type_{name.replace(' ', '_')}.nrrd", content, f"type: {name}", voxels)
        if voxels.itemsize > 1:
            content = nrrd_file(voxels, [], endian="big")
            out.add(f"nrrd/big_endian_{dtype}.nrrd", content, f"{dtype}, big-endian", voxels)

    nrrd_encoding_fixtures(out, label)
    nrrd_detached_fixtures(out, label)
    nrrd_geometry_fixtures(out, label)
    nrrd_header_fixtures(out, label)
    nrrd_list_axis_fixtures(out, label)


def nrrd_encoding_fixtures(out, label):
    """Raw, gzip, bzip2, ascii, hex: by hand under each name, and by pynrrd."""
    place = nrrd_space(LABELLED_AFFINE)
    raw = disk(label)
    payloads = {
        "raw": raw,
        "gzip": gzip.compress(raw, mtime=0),
        "gz": gzip.compress(raw, mtime=0),
        "bzip2": bz2.compress(raw),
        "bz2": bz2.compress(raw),
        "ascii": ascii_voxels(label),
        "text": ascii_voxels(label, per_line=60),
        "txt": ascii_voxels(label, per_line=1),
        "hex": hex_voxels(raw),
    }
    for name, payload in payloads.items():
        content = nrrd_file(label, place, encoding=name, payload=payload)
        out.add(f"nrrd/encoding_{name}.nrrd", content, f"encoding: {name}", label, LABELLED_AFFINE, True)
    floats = out.rng.normal(0, 1000, SHAPE).astype("float32")
    content = nrrd_file(floats, [], encoding="ascii", endian=None, payload=ascii_voxels(floats))
    out.add("nrrd/ascii_float.nrrd", content, "numbers with signs, points and exponents", floats)
    content = nrrd_file(label, [], encoding="hex", endian="big", payload=hex_voxels(disk(label, ">")).upper())
    out.add("nrrd/hex_big_endian.nrrd", content, "hex digits of big-endian voxels, upper case", label)
    content = nrrd_file(label, [], encoding="gzip", endian="big", payload=gzip.compress(disk(label, ">"), mtime=0))
    out.add("nrrd/gzip_big_endian.nrrd", content, "gzip of big-endian voxels", label)

    lps = LPS_FROM_RAS @ LABELLED_AFFINE
    for name in ("raw", "gzip", "bzip2", "ascii"):
        header = {
            "encoding": name,
            "space": "left-posterior-superior",
            "space directions": lps[:3, :3].T,
            "space origin": lps[:3, 3],
            "kinds": ["domain"] * 3,
        }
        stream = io.BytesIO()
        nrrd.write(stream, label, header)
        # The comment holds the time of writing; without it the bytes are the same on every run.
        content = re.sub(rb"(?m)^#.*\n", b"", stream.getvalue(), count=2)
        what = f"written by pynrrd, {name}"
        out.add(f"nrrd/by_pynrrd_{name}.nrrd", content, what, label, LABELLED_AFFINE, True)


def nrrd_detached_fixtures(out, label):
    """Headers that name other files, and skips within them."""
    place = nrrd_space(LABELLED_AFFINE)
    raw = disk(label)

    def add(name, lines, what, values=label, ends_with_list=False, **options):
        text = nrrd_text(values, place + lines, **options)
        content = text if ends_with_list else text + b"\n"
        out.add(f"nrrd/{name}.nhdr", content, what, values, LABELLED_AFFINE, values is label)

    out.part("nrrd/parts/voxels.raw", raw)
    out.part("nrrd/voxels_beside.raw", raw)
    out.part("nrrd/parts/voxels.raw.gz", gzip.compress(raw, mtime=0))
    out.part("nrrd/parts/voxels.txt", ascii_voxels(label))
    add("detached", ["data file: voxels_beside.raw"], "voxels in a file beside the header")
    add("detached_datafile", ["datafile: ./voxels_beside.raw"], "the old spelling, and a leading ./")
    add("detached_folder", ["data file: parts/voxels.raw"], "voxels in a folder below the header")
    add("detached_gzip", ["data file: parts/voxels.raw.gz"], "gzip in a file of its own", encoding="gzip")
    add("detached_ascii", ["data file: parts/voxels.txt"], "text in a file of its own", encoding="ascii")
    text = nrrd_text(label, place + ["data file: voxels_beside.raw"])
    out.add("nrrd/detached_no_blank_line.nhdr", text, "a detached header may end without the blank line", label,
            LABELLED_AFFINE, True)

    for k in range(SHAPE[2]):
        out.part(f"nrrd/parts/slice_{k + 1:03d}.raw", disk(label[:, :, k]))
    slices = [f"parts/slice_{k + 1:03d}.raw" for k in range(SHAPE[2])]
    add("pattern", ["data file: parts/slice_%03d.raw 1 5 1"], "slices in numbered files")
    add("pattern_subdim", ["data file: parts/slice_%03d.raw 1 5 1 2"], "numbered files, each of two dimensions")
    add("list", ["data file: LIST"] + slices, "slices in listed files", ends_with_list=True)
    add("list_subdim", ["data file: LIST 2"] + slices, "listed files, each of two dimensions", ends_with_list=True)
    add("list_backwards", ["data file: LIST"] + slices[::-1], "listed files count in the order of the list",
        label[:, :, ::-1], ends_with_list=True)
    taller = np.concatenate([label, label[:, :, :1] + 5], axis=2)
    for slab in range(2):
        out.part(f"nrrd/parts/slab_{slab}.raw", disk(taller[:, :, 3 * slab:3 * slab + 3]))
    add("pattern_slabs", ["data file: parts/slab_%d.raw 0 1 1 3"], "numbered files, each a slab of slices", taller)
    for k in range(SHAPE[2]):
        out.part(f"nrrd/parts/slice_{k + 1:03d}.raw.gz", gzip.compress(disk(label[:, :, k]), mtime=0))
    add("pattern_gzip", ["data file: parts/slice_%03d.raw.gz 1 5 1"], "numbered files, each gzip", encoding="gzip")

    text = b"made by hand\nsecond line\n"
    out.part("nrrd/parts/skip.raw", text + raw)
    out.part("nrrd/parts/skip_inside.raw.gz", gzip.compress(b"8 bytes." + raw, mtime=0))
    out.part("nrrd/parts/skip_before.raw.gz", b"a line before the stream\n" + gzip.compress(raw, mtime=0))
    data = "data file: parts/skip.raw"
    add("line_skip", [data, "line skip: 2"], "two lines before the voxels")
    add("byte_skip", [data, f"byte skip: {len(text)}"], f"{len(text)} bytes before the voxels")
    add("line_and_byte_skip", [data, "lineskip: 1", "byteskip: 12"], "one line, then 12 bytes; the old spellings")
    add("byte_skip_end", [data, "byte skip: -1"], "the voxels are the last bytes of the file")
    add("byte_skip_gzip", ["data file: parts/skip_inside.raw.gz", "byte skip: 8"], "bytes are skipped after inflating",
        encoding="gzip")
    add("byte_skip_end_gzip", ["data file: parts/skip_inside.raw.gz", "byte skip: -1"],
        "the voxels are the last bytes after inflating", encoding="gzip")
    add("line_skip_gzip", ["data file: parts/skip_before.raw.gz", "line skip: 1"],
        "lines are skipped before inflating", encoding="gzip")
    for name, line, junk in (("line_skip", "line skip: 1", b"a line\n"), ("byte_skip", "byte skip: 4", b"junk"),
                             ("byte_skip_end", "byte skip: -1", b"anything")):
        content = nrrd_file(label, place + [line], payload=junk + raw)
        out.add(f"nrrd/attached_{name}.nrrd", content, f"attached voxels, {line}", label, LABELLED_AFFINE, True)


def nrrd_geometry_fixtures(out, label):
    """Spaces, directions, spacings and axis mins."""

    def add(name, lines, what, affine, values=label, is_labelled=False):
        out.add(f"nrrd/{name}.nrrd", nrrd_file(values, lines), what, values, affine, is_labelled)

    for space in ("left-posterior-superior", "right-anterior-superior", "LPS", "RAS", "lps", "Right-Anterior-Superior"):
        slug = re.sub(r"[^A-Za-z]", "_", space)
        slug = f"{slug}_mixed_case" if space != space.lower() and len(space) > 3 else slug
        slug = f"{slug}_lower_case" if space == "lps" else slug
        add(f"space_{slug}", nrrd_space(SHEARED, space), f"space: {space}, oblique with shear", SHEARED)
    for space in ("left-anterior-superior", "LAS"):
        las = RAS_FROM_LAS @ ROTATED
        lines = [f"space: {space}", "space directions: " + " ".join(vector(las[:3, a]) for a in range(3)),
                 "space origin: " + vector(las[:3, 3])]
        add(f"space_{space.replace('-', '_')}", lines, f"space: {space}", ROTATED)
    directions = "space directions: " + " ".join(vector(ROTATED[:3, a]) for a in range(3))
    origin = "space origin: " + vector(ROTATED[:3, 3])
    for space in ("scanner-xyz", "3D-right-handed", "3D-left-handed"):
        name = f"space_{space.replace('-', '_')}"
        add(name, [f"space: {space}", directions, origin], f"space: {space} is not anatomical", ROTATED)
    add("space_dimension", ["space dimension: 3", directions, origin], "a space without a name", ROTATED)
    add("no_origin", ["space: RAS", directions], "without space origin: zero", from_matvec(ROTATED[:3, :3]))

    bare = from_matvec(np.diag(SPACING))
    mins = "axis mins: 10 -20 30"
    node = from_matvec(np.diag(SPACING), [10, -20, 30])
    cell = from_matvec(np.diag(SPACING), np.array([10, -20, 30]) + SPACING / 2)
    spacings = "spacings: 1.5 2 3"
    add("no_geometry", [], "no spacings: unit voxels", np.eye(4))
    add("spacings", [spacings], "spacings only", bare)
    add("spacings_nan", ["spacings: 1.5 nan 3"], "a spacing that is not known is 1",
        from_matvec(np.diag([1.5, 1.0, 3.0])))
    add("axis_mins_node", [spacings, mins, "centerings: node node node"],
        "node-centred: axis mins are the first centre", node)
    add("axis_mins_cell", [spacings, mins, "centers: cell cell cell"],
        "cell-centred: axis mins are the border of the first cell", cell)
    add("axis_mins", [spacings, "axismins: 10 -20 30"], "no centering: cell, as Teem and ITK assume", cell)
    extent = SPACING * (np.array(SHAPE) - 1)
    maxs = " ".join(repr(float(v)) for v in np.array([10, -20, 30]) + extent)
    add("axis_mins_maxs_node", [mins, f"axis maxs: {maxs}", "centers: node node node"],
        "spacing from the first to the last centre", node)
    maxs = " ".join(repr(float(v)) for v in np.array([10, -20, 30]) + SPACING * np.array(SHAPE))
    add("axis_mins_maxs_cell", [mins, f"axis maxs: {maxs}", "centers: cell cell cell"],
        "spacing from border to border", cell)
    flat = label[:, :, 0]
    content = nrrd_file(flat, ["spacings: 1.5 2"])
    out.add("nrrd/two_d.nrrd", content, "two dimensions: one slice", label[:, :, :1],
            from_matvec(np.diag([1.5, 2.0, 1.0])))


def nrrd_header_fixtures(out, label):
    """Lines a reader has to accept or skip."""
    place = nrrd_space(LABELLED_AFFINE)

    def add(name, lines, what, **options):
        out.add(f"nrrd/{name}.nrrd", nrrd_file(label, lines, **options), what, label, LABELLED_AFFINE, True)

    add("crlf", place, "header lines end in CRLF", eol="\r\n")
    add("comments", ["# a comment", "#another: comment"] + place + ["#"], "comments between the fields")
    keys = ["modality:=CT", "a key with spaces:=value: with, colons := and more", "type:=not the type",
            "escaped:=first\\nsecond\\\\"]
    add("key_values", keys + place, "key:=value pairs, one named like a field")
    extras = ["content: a volume: labelled", 'labels: "R axis" "A \\"axis\\"" ""', "thicknesses: nan nan 3",
              "kinds: domain domain domain", 'sample units: "HU"', "min: 0", "max: 234", "old min: -1", "oldmax: 300",
              "measurement frame: (-1,0,0) (0,-1,0) (0,0,1)", 'space units: "mm" "mm" "mm"', "number: 60"]
    add("other_fields", place + extras, "the fields that do not change the voxels or their place")
    spaced = [re.sub(",", ", ", line) for line in place]
    spaced = [line.replace(") (", ")   (") for line in spaced]
    add("blanks_in_vectors", spaced, "blanks after commas and between vectors")
    upper = [re.sub(r"^[^:]*", lambda m: m[0].upper(), line) for line in place]
    add("upper_case_fields", upper, "names of fields in capitals")
    for version in range(1, 6):
        magic = f"NRRD000{version}"
        add(f"magic_{version}", place, f"magic {magic}", magic=magic)
    reverse = nrrd_file(label, place).split(b"\n\n", 1)
    first, *rest = reverse[0].split(b"\n")
    # `sizes` and the per-axis fields must follow `dimension`, and vectors must follow `space`.
    rest = sorted(rest, key=lambda line: (not line.startswith((b"dimension", b"space:")), line))
    content = b"\n".join([first, *rest]) + b"\n\n" + reverse[1]
    out.add("nrrd/field_order.nrrd", content, "fields in another order", label, LABELLED_AFFINE, True)


def nrrd_list_axis_fixtures(out, label):
    """Four dimensions: an axis of components or of volumes."""
    first = np.stack([label, label + 1000], axis=0)
    last = np.stack([label, label + 1000], axis=3)
    space, directions, origin = nrrd_space(LABELLED_AFFINE, "right-anterior-superior")
    vectors = directions.removeprefix("space directions: ")

    def add(name, voxels, lines, what, affine=LABELLED_AFFINE, is_labelled=True):
        out.add(f"nrrd/{name}.nrrd", nrrd_file(voxels, lines), what, label, affine, is_labelled)

    lines = [space, f"space directions: none {vectors}", origin]
    add("components_first", first, lines + ["kinds: vector domain domain domain"],
        "a leading axis of components: the first is read")
    add("components_first_no_kinds", first, lines, "a leading axis that only its direction `none` tells")
    lines = [space, f"space directions: {vectors} none", origin]
    add("list_last", last, lines + ["kinds: domain domain domain list"],
        "a trailing axis of volumes: the first is read")
    bare = from_matvec(np.diag(SPACING))
    add("components_spacings", first, ["spacings: nan 1.5 2 3", "kinds: vector domain domain domain"],
        "a leading axis of components without a space", bare, False)
    add("list_spacings", last, ["spacings: 1.5 2 3 nan", "kinds: domain domain domain time"],
        "a trailing axis of times without a space", bare, False)
    add("four_d_plain", last, ["spacings: 1.5 2 3 1"], "four dimensions and no kinds: the first of the last axis",
        bare, False)
    vectors = " ".join(vector([*LABELLED_AFFINE[:3, axis], 0]) for axis in range(3))
    lines = ["space: right-anterior-superior-time", f"space directions: {vectors} (0,0,0,1)",
             f"space origin: {vector([*ORIGIN, 0])}", "kinds: domain domain domain time"]
    add("space_rast_4d", last, lines, "a space with time")
