"""MetaImage fixtures, written by hand and by SimpleITK.

The format: https://itk.org/Wiki/MetaIO/Documentation; where it is silent, what MetaIO does.
"""

import gzip
import zlib

import numpy as np
import SimpleITK as sitk

from .labelled import (
    LABELLED_AFFINE, LPS_FROM_RAS, RAS_FROM_LPS, ROTATED, SHAPE, axis_orders, disk, full_range, labelled,
)
from .write_nrrd import ascii_voxels

MET_TYPES = {
    "MET_UCHAR": "uint8",
    "MET_CHAR": "int8",
    "MET_USHORT": "uint16",
    "MET_SHORT": "int16",
    "MET_UINT": "uint32",
    "MET_INT": "int32",
    "MET_ULONG": "uint32",  # MetaIO writes four bytes on every platform
    "MET_LONG": "int32",
    "MET_ULONG_LONG": "uint64",
    "MET_LONG_LONG": "int64",
    "MET_FLOAT": "float32",
    "MET_DOUBLE": "float64",
}


def numbers(values):
    """Numbers between blanks, each in its shortest exact form."""
    return " ".join(repr(float(v) + 0.0) for v in np.ravel(values))


def metaimage(voxels, fields=(), *, payload=None, data="LOCAL", element=None, eol="\n", omit=(), after=""):
    """A MetaImage header and its voxels; `fields` replace or follow the usual ones."""
    element = element or next(met for met, dtype in MET_TYPES.items() if dtype == voxels.dtype.name)
    head = {
        "ObjectType": "Image",
        "NDims": str(voxels.ndim),
        "BinaryData": "True",
        "BinaryDataByteOrderMSB": "False",
        "DimSize": " ".join(map(str, voxels.shape)),
        "ElementType": element,
    }
    head.update(fields)
    lines = [f"{key} = {value}{eol}" for key, value in head.items() if key not in omit]
    lines += [f"ElementDataFile = {data}{eol}", after]
    if payload is None:
        payload = disk(voxels) if data.upper() == "LOCAL" else b""
    return "".join(lines).encode("ascii") + payload


def metaimage_place(affine_ras, offset="Offset", matrix="TransformMatrix", spacing="ElementSpacing"):
    """Geometry fields for a RAS affine. A row of the matrix is the direction of an axis."""
    lps = LPS_FROM_RAS @ affine_ras
    sizes = np.linalg.norm(lps[:3, :3], axis=0)
    return {
        matrix: numbers((lps[:3, :3] / sizes).T),
        offset: numbers(lps[:3, 3]),
        spacing: numbers(sizes),
    }


def metaimage_fixtures(out):
    """Everything below fixtures/metaimage."""
    label = labelled()
    for code, voxels, affine in axis_orders():
        content = metaimage(voxels, metaimage_place(affine))
        out.add(f"metaimage/axes_{code}.mha", content, f"{code} by TransformMatrix", voxels, affine, True)
    for met, dtype in MET_TYPES.items():
        voxels = full_range(dtype, out.rng)
        out.add(f"metaimage/type_{met}.mha", metaimage(voxels, element=met), f"ElementType = {met}", voxels)
        if voxels.itemsize > 1:
            content = metaimage(voxels, {"BinaryDataByteOrderMSB": "True"}, element=met, payload=disk(voxels, ">"))
            out.add(f"metaimage/type_{met}_be.mha", content, f"ElementType = {met}, big-endian", voxels)
    metaimage_header_fixtures(out, label)
    metaimage_data_fixtures(out, label)
    metaimage_by_simpleitk(out, label)


def metaimage_header_fixtures(out, label):
    """Synonyms, geometry, and lines to skip."""
    place = metaimage_place(LABELLED_AFFINE)

    def add(name, fields, what, affine=LABELLED_AFFINE, values=label, voxels=label, **options):
        out.add(f"metaimage/{name}.mha", metaimage(voxels, fields, **options), what, values, affine)

    add("rotated", metaimage_place(ROTATED), "TransformMatrix of a rotation", ROTATED)
    add("mirrored", metaimage_place(ROTATED @ np.diag([1, -1, 1, 1])), "a left-handed grid",
        ROTATED @ np.diag([1, -1, 1, 1]))
    for name in ("Offset", "Position", "Origin"):
        add(f"synonym_{name}", metaimage_place(ROTATED, offset=name), f"{name} is the origin", ROTATED)
    for name in ("TransformMatrix", "Rotation", "Orientation"):
        add(f"synonym_{name}", metaimage_place(ROTATED, matrix=name), f"{name} is the matrix", ROTATED)
    add("element_size", metaimage_place(LABELLED_AFFINE, spacing="ElementSize"), "ElementSize where spacing is missing")
    add("spacing_over_size", {"ElementSize": "9 9 9", **place}, "ElementSpacing counts, not ElementSize before it")
    add("size_after_spacing", {**place, "ElementSize": "9 9 9"}, "ElementSpacing counts, not ElementSize after it")
    add("no_geometry", {}, "no geometry: unit voxels along L, P, S", RAS_FROM_LPS)
    add("ignored_fields", {**place, "CenterOfRotation": "5 6 7", "AnatomicalOrientation": "RAI", "Comment": "a = b",
                           "Modality": "MET_MOD_CT", "ElementMin": "-7", "ElementMax": "7", "ObjectSubType": "none",
                           "Name": "a volume", "My_Own_Key": "anything"},
        "fields that do not change the voxels or their place")
    add("crlf", place, "header lines end in CRLF", eol="\r\n")
    add("bare", place, "without ObjectType, BinaryData and byte order",
        omit=("ObjectType", "BinaryData", "BinaryDataByteOrderMSB"))
    flat = {"TransformMatrix": "0 1 -1 0", "Offset": "5 6", "ElementSpacing": "1.5 2"}
    lps = np.eye(4)
    # Rows of the matrix are the axes: i runs along +y, j along -x.
    lps[:2, 0], lps[:2, 1], lps[:2, 3] = [0, 1.5], [-2, 0], [5, 6]
    add("two_d", flat, "two dimensions: one slice", RAS_FROM_LPS @ lps, label[:, :, :1], label[:, :, 0])
    series = np.stack([label, label + 1000], axis=3)
    four = {key: f"{value} 1" if key == "ElementSpacing" else f"{value} 0" for key, value in place.items()}
    matrix = np.eye(4)
    matrix[:3, :3] = np.diag([-1, -1, 1])
    four["TransformMatrix"] = numbers(matrix)
    add("four_d", four, "two volumes: the first is read", voxels=series)
    channels = np.stack([label, label + 1000], axis=0)
    two = {**place, "ElementNumberOfChannels": "2"}
    add("channels", two, "two channels: the first is read", payload=disk(channels))


def metaimage_data_fixtures(out, label):
    """Where the voxels are and how they are packed."""
    place = metaimage_place(LABELLED_AFFINE)
    raw = disk(label)

    def add(name, fields, what, values=label, **options):
        content = metaimage(label, {**place, **fields}, **options)
        labelled_values = values is label
        out.add(f"metaimage/{name}", content, what, values, LABELLED_AFFINE, labelled_values)

    packed = zlib.compress(raw)
    sized = {"CompressedData": "True", "CompressedDataSize": str(len(packed))}
    add("local_lower_case.mha", {}, "`Local` is LOCAL", data="Local", payload=raw)
    add("compressed.mha", sized, "zlib after the header", payload=packed)
    in_gzip = gzip.compress(raw, mtime=0)
    add("compressed_gzip.mha", {**sized, "CompressedDataSize": str(len(in_gzip))}, "gzip after the header",
        payload=in_gzip)
    out.part("metaimage/parts/voxels.zraw", packed)
    add("compressed.mhd", sized, "zlib in a file of its own", data="parts/voxels.zraw")
    add("compressed_no_size.mhd", {"CompressedData": "True"}, "zlib in a file of its own, size not told",
        data="parts/voxels.zraw")
    add("element_byte_order.mha", {"ElementByteOrderMSB": "True"}, "ElementByteOrderMSB", payload=disk(label, ">"),
        omit=("BinaryDataByteOrderMSB",))
    packed = zlib.compress(disk(label, ">"))
    big = {"BinaryDataByteOrderMSB": "True", **sized, "CompressedDataSize": str(len(packed))}
    add("compressed_be.mha", big, "zlib of big-endian voxels", payload=packed)
    add("text.mha", {"BinaryData": "False"}, "voxels as text", payload=ascii_voxels(label))

    out.part("metaimage/beside.raw", raw)
    out.part("metaimage/parts/voxels.raw", raw)
    out.part("metaimage/parts/header16.raw", b"sixteen bytes...".ljust(16) + raw)
    add("beside.mhd", {}, "voxels in a file beside the header", data="beside.raw")
    add("folder.mhd", {}, "voxels in a folder below the header", data="parts/voxels.raw")
    add("header_size.mhd", {"HeaderSize": "16"}, "16 bytes before the voxels", data="parts/header16.raw")
    add("header_size_end.mhd", {"HeaderSize": "-1"}, "the voxels are the last bytes", data="parts/header16.raw")
    add("header_size_end.mha", {"HeaderSize": "-1"}, "the voxels are the last bytes of the same file",
        payload=b"anything" + raw)
    add("crlf.mhd", {}, "header lines end in CRLF, voxels elsewhere", data="parts/voxels.raw", eol="\r\n")

    for k in range(SHAPE[2]):
        out.part(f"metaimage/parts/slice_{k + 1:03d}.raw", disk(label[:, :, k]))
    slices = [f"parts/slice_{k + 1:03d}.raw" for k in range(SHAPE[2])]
    listed = "\n".join(slices) + "\n"
    add("list.mhd", {}, "slices in listed files", data="LIST", after=listed, payload=b"")
    add("list_2d.mhd", {}, "listed files, each of two dimensions", data="LIST 2", after=listed, payload=b"")
    add("list_backwards.mhd", {}, "listed files count in the order of the list", label[:, :, ::-1], data="LIST",
        after="\n".join(slices[::-1]) + "\n", payload=b"")
    add("pattern.mhd", {}, "slices in numbered files", data="parts/slice_%03d.raw 1 5 1")


def metaimage_by_simpleitk(out, label):
    """What the reference writer itself writes."""
    lps = LPS_FROM_RAS @ ROTATED
    image = sitk.GetImageFromArray(np.ascontiguousarray(label.T))
    sizes = np.linalg.norm(lps[:3, :3], axis=0)
    image.SetSpacing(sizes.tolist())
    image.SetOrigin(lps[:3, 3].tolist())
    image.SetDirection((lps[:3, :3] / sizes).ravel().tolist())
    for name, pack in (("by_simpleitk.mha", False), ("by_simpleitk_compressed.mha", True),
                       ("by_simpleitk.mhd", False), ("by_simpleitk_compressed.mhd", True)):
        path = out.root / "metaimage" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        sitk.WriteImage(image, str(path), useCompression=pack)
        out.expect(f"metaimage/{name}", "written by SimpleITK", label, ROTATED)
