"""NIfTI fixtures: headers laid out by nibabel, bent where its own checks would refuse.

The standard: https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h and nifti2.h.
"""

import gzip
import io

import nibabel
import numpy as np
from nibabel.affines import from_matvec

from .labelled import (
    LABELLED_AFFINE, ORIGIN, ROTATED, SHAPE, SHEARED, SPACING, TYPES, axis_orders, disk, full_range, labelled, rotation,
)


def nifti_header(voxels, *, sform=None, qform=None, endian="<", version=1, pair=False, vox_offset=None, **fields):
    """A NIfTI header; `fields` set its members as they are, past nibabel's own checks."""
    header = {1: nibabel.Nifti1Header, 2: nibabel.Nifti2Header}[version](endianness=endian)
    header.set_data_dtype(voxels.dtype)
    header.set_data_shape(voxels.shape)
    placed = sform if sform is not None else qform
    header["pixdim"][1:4] = SPACING if placed is None else np.linalg.norm(placed[:3, :3], axis=0)
    if qform is not None:
        header.set_qform(qform, code=1)
    if sform is not None:
        header.set_sform(sform, code=2)
    if pair:
        header["magic"] = b"ni1" if version == 1 else b"ni2\0\r\n\x1a\n"
    header["vox_offset"] = vox_offset if vox_offset is not None else 0 if pair else header.single_vox_offset
    for name, value in fields.items():
        if name.startswith("pixdim_"):
            header["pixdim"][int(name.removeprefix("pixdim_"))] = value
        else:
            header[name] = value
    return header


def nifti(voxels, *, extension=b"", **options):
    """A single-file NIfTI: header, extension flag, extensions, padding, voxels."""
    header = nifti_header(voxels, **options)
    flag = b"\x01\0\0\0" if extension else b"\0\0\0\0"
    head = header.binaryblock + flag + extension
    return head.ljust(int(header["vox_offset"]), b"\0") + disk(voxels, header.endianness)


def nifti_extension(endian="<"):
    """A 32-byte comment extension (code 6)."""
    sizes = np.array([32, 6], endian + "i4").tobytes()
    return sizes + b"a comment block".ljust(24, b"\0")


def nifti_fixtures(out):
    """Everything below fixtures/nifti."""
    label = labelled()
    sform = {"sform": LABELLED_AFFINE}
    placed = {"affine": LABELLED_AFFINE, "labelled": True}

    for code, voxels, affine in axis_orders():
        out.add(f"nifti/axes_{code}.nii", nifti(voxels, sform=affine), f"{code} by sform", voxels, affine, True)
        out.add(f"nifti/axes_qform_{code}.nii", nifti(voxels, qform=affine), f"{code} by qform", voxels, affine, True)

    for name in TYPES:
        voxels = full_range(name, out.rng)
        for order, endian in (("le", "<"), ("be", ">")):
            content = nifti(voxels, endian=endian, **sform)
            out.add(f"nifti/type_{name}_{order}.nii", content, f"{name}, {order}", voxels, LABELLED_AFFINE)

    narrow = 1_000_000 + label.astype("int32")
    out.add("nifti/int32_narrow.nii", nifti(narrow, **sform), "wide integers, range within 16 bits", narrow)
    holes = full_range("float32", out.rng)
    holes[1, 1, 1], holes[0, 2, 3], holes[2, 0, 4] = np.nan, np.inf, -np.inf
    out.add("nifti/float32_nonfinite.nii", nifti(holes, **sform), "one NaN, one inf, one -inf", holes)

    packed = gzip.compress(nifti(label, **sform), mtime=0)
    out.add("nifti/gz.nii.gz", packed, "gzip", label, **placed)
    half = len(nifti(label, **sform)) // 2
    members = [nifti(label, **sform)[:half], nifti(label, **sform)[half:]]
    packed = b"".join(gzip.compress(m, mtime=0) for m in members)
    out.add("nifti/gz_two_members.nii.gz", packed, "gzip of two members", label, **placed)
    for stem, offset in (("pair", 0), ("pair_offset", 16)):
        header = nifti_header(label, pair=True, vox_offset=offset, **sform)
        out.part(f"nifti/{stem}.img", b"\xee" * offset + disk(label))
        what = f"header and voxels in two files, vox_offset {offset}"
        out.add(f"nifti/{stem}.hdr", header.binaryblock + b"\0\0\0\0", what, label, **placed)
    header = nifti_header(label, pair=True, endian=">", **sform)
    out.part("nifti/pair_be.img", disk(label, ">"))
    out.add("nifti/pair_be.hdr", header.binaryblock, "big-endian pair; the header ends at byte 348", label, **placed)

    nifti_geometry_fixtures(out, label, placed)
    nifti_scaling_fixtures(out, label, sform)
    nifti_layout_fixtures(out, label, sform, placed)


def nifti_geometry_fixtures(out, label, placed):
    """Sform, qform, pixdim and what they do to each other."""

    def add(name, what, affine, is_labelled=False, **options):
        out.add(f"nifti/{name}.nii", nifti(label, **options), what, label, affine, is_labelled)

    other = from_matvec(rotation([0, 0, 1], 90) @ np.diag(SPACING), [1, 2, 3])
    add("qform_only", "qform alone", ROTATED, qform=ROTATED)
    add("sform_only_rotated", "sform alone, rotated", ROTATED, sform=ROTATED)
    add("sform_sheared", "oblique with shear, which only an sform can say", SHEARED, sform=SHEARED)
    add("sform_over_qform", "both, disagreeing: the sform counts", SHEARED, sform=SHEARED, qform=other)
    add("sform_code_zero", "an sform with code 0 does not count", other, sform=SHEARED, qform=other, sform_code=0)
    mirrored = ROTATED @ np.diag([1, 1, -1, 1])
    add("qfac_minus_one", "pixdim[0] = -1: the third axis is turned", mirrored, qform=mirrored)
    add("qfac_zero", "pixdim[0] = 0 means 1", ROTATED, qform=ROTATED, pixdim_0=0)
    half_turn = from_matvec(rotation([1, 1, 0], 180) @ np.diag(SPACING), ORIGIN)
    add("qform_half_turn", "a = 0 after rounding: b, c, d alone make a unit quaternion", half_turn, qform=half_turn)

    flat = np.array([SPACING[0], SPACING[1], 1.0])
    unit_z = ROTATED @ np.diag([1, 1, 1 / SPACING[2], 1])
    add("pixdim_zero", "qform with pixdim[3] = 0, read as 1", unit_z, qform=ROTATED, pixdim_3=0)
    add("pixdim_negative", "qform with pixdim[1] < 0, read as its size", ROTATED, qform=ROTATED, pixdim_1=-SPACING[0])
    bare = from_matvec(np.diag(SPACING))
    add("neither", "neither sform nor qform", bare)
    add("neither_zero_pixdim", "neither, pixdim[3] = 0", from_matvec(np.diag(flat)), pixdim_3=0)
    add("neither_negative_pixdim", "neither, pixdim[2] < 0", bare, pixdim_2=-SPACING[1])
    add("pixdim_ignored", "an sform beside another pixdim: the sform counts", LABELLED_AFFINE, True,
        sform=LABELLED_AFFINE, pixdim_1=9, pixdim_2=9, pixdim_3=9)


def nifti_scaling_fixtures(out, label, sform):
    """scl_slope and scl_inter."""

    def add(name, what, slope, inter, values, voxels=label, **options):
        content = nifti(voxels, scl_slope=slope, scl_inter=inter, **sform, **options)
        out.add(f"nifti/{name}.nii", content, what, values, LABELLED_AFFINE)

    add("scl_slope_zero", "slope 0: no scaling, the intercept neither", 0, 5, label)
    add("scl_slope_nan", "slope NaN: no scaling", np.nan, np.nan, label)
    add("scl_slope", "2.5 x - 3", 2.5, -3, 2.5 * label - 3.0)
    add("scl_slope_negative", "-0.5 x + 10: the range turns round", -0.5, 10, -0.5 * label + 10.0)
    add("scl_slope_be", "2.5 x - 3, big-endian", 2.5, -3, 2.5 * label - 3.0, endian=">")
    floats = label.astype("float32")
    add("scl_slope_float", "2.5 x - 3 of float voxels", 2.5, -3, 2.5 * label - 3.0, floats)
    bytes_ = (label % 251).astype("uint8")
    add("scl_slope_uint8", "0.1 x + 1 of bytes; the slope is the f32 next to 0.1", 0.1, 1,
        np.float64(np.float32(0.1)) * bytes_ + 1.0, bytes_)


def nifti_layout_fixtures(out, label, sform, placed):
    """Dimensions, offsets, extensions, NIfTI-2."""

    def add(name, content, what, values=label, place=placed):
        out.add(f"nifti/{name}", content, what, values, **place)

    series = np.stack([label, label + 1000, label + 2000], axis=3)
    add("four_d.nii", nifti(series, **sform), "three volumes: the first is read")
    add("four_d_single.nii", nifti(label[..., None], **sform), "four dimensions, the last of size 1")
    vectors = np.stack([label, label + 1000], axis=3)[:, :, :, None, :]
    add("five_d.nii", nifti(vectors, **sform), "two values a voxel in the fifth dimension: the first is read")
    flat = label[:, :, 0]
    add("two_d.nii", nifti(flat, **sform), "two dimensions: one slice", label[:, :, :1])
    bare = {"affine": from_matvec(np.diag([SPACING[0], SPACING[1], 1.0]))}
    add("two_d_neither.nii", nifti(flat, pixdim_3=0), "one slice, no sform, no qform", label[:, :, :1], bare)

    for endian, order in (("<", "le"), (">", "be")):
        content = nifti(label, extension=nifti_extension(endian), vox_offset=384, endian=endian, **sform)
        add(f"extension_{order}.nii", content, "a comment extension: voxels at byte 384")
        two = nifti(label, version=2, endian=endian, **sform)
        add(f"nifti2_{order}.nii", two, f"NIfTI-2, {order}")
        add(f"nifti2_{order}.nii.gz", gzip.compress(two, mtime=0), f"NIfTI-2, {order}, gzip")
    add("vox_offset_gap.nii", nifti(label, vox_offset=400, **sform), "voxels at byte 400, no extension")
    scaled = nifti(label, version=2, qform=ROTATED, scl_slope=2.5, scl_inter=-3)
    add("nifti2_qform_scaled.nii", scaled, "NIfTI-2 with qform and scaling", 2.5 * label - 3.0, {"affine": ROTATED})
    extended = nifti(label, version=2, extension=nifti_extension(), vox_offset=576, **sform)
    add("nifti2_extension.nii", extended, "NIfTI-2 with an extension: voxels at byte 576")
    header = nifti_header(label, version=2, pair=True, **sform)
    out.part("nifti/nifti2_pair.img", disk(label))
    add("nifti2_pair.hdr", header.binaryblock + b"\0\0\0\0", "NIfTI-2 header and voxels in two files")

    image = nibabel.Nifti1Image(label.astype("float64"), LABELLED_AFFINE)
    image.set_data_dtype("uint8")
    content = image.to_bytes()
    stored = np.frombuffer(content[-label.size:], "uint8").reshape(SHAPE, order="F")
    header = nibabel.Nifti1Header.from_fileobj(io.BytesIO(content))
    slope, inter = header.get_slope_inter()
    add("by_nibabel.nii", content, "written by nibabel, floats scaled into bytes", stored * slope + inter,
        {"affine": LABELLED_AFFINE})
