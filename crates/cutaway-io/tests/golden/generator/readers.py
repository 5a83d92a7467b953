"""Reads volumes through nibabel, pynrrd and SimpleITK, and brings what they say to one convention (RAS)."""

import json
import re
from dataclasses import dataclass
from pathlib import Path

import nibabel
import nrrd
import numpy as np
import SimpleITK as sitk
from nibabel.affines import from_matvec

from .labelled import RAS_FROM_LAS, RAS_FROM_LPS

NIBABEL = f"nibabel {nibabel.__version__}"
PYNRRD = f"pynrrd {nrrd.__version__}"
SIMPLEITK = f"SimpleITK {sitk.Version.VersionString()}"
NUMPY = f"numpy {np.__version__}"


@dataclass
class Reading:
    """What a library makes of a file. `values` has shape [x, y, z] and is rescaled."""

    reader: str
    dtype: str
    values: np.ndarray
    affine: np.ndarray
    oriented: bool


def first_volume(array):
    """The first volume of an array [x, y, ...], with a third axis if it has none."""
    array = array[..., None] if array.ndim == 2 else array
    return array[(slice(None),) * 3 + (0,) * (array.ndim - 3)]


def read_nibabel(path):
    """NIfTI through nibabel.

    Where a file has neither sform nor qform, nibabel invents an affine that is centred and turns x (radiological
    storage). We deliberately do not: without a statement about the axes the grid is diag(pixdim) from the origin, and
    not oriented.
    """
    image = nibabel.load(path)
    header = image.header
    oriented = bool(header["sform_code"] > 0 or header["qform_code"] > 0)
    affine = image.affine
    if not oriented:
        zooms = [float(z) for z in header.get_zooms()[:3]]
        affine = from_matvec(np.diag((zooms + [1.0])[:3]))
    values = np.asanyarray(image.dataobj.get_unscaled())
    slope, inter = image.dataobj.slope, image.dataobj.inter
    if (slope, inter) != (1, 0):
        values = values.astype("float64") * float(slope) + float(inter)
        assert np.array_equal(values, image.get_fdata(dtype="float64")), path
    return Reading(NIBABEL, header.get_data_dtype().newbyteorder("=").name, first_volume(values), affine, oriented)


NRRD_TO_RAS = {
    "left-posterior-superior": RAS_FROM_LPS, "lps": RAS_FROM_LPS,
    "right-anterior-superior": np.eye(4), "ras": np.eye(4),
    "left-anterior-superior": RAS_FROM_LAS, "las": RAS_FROM_LAS,
    "right-anterior-superior-time": np.eye(4), "rast": np.eye(4),
}
SPATIAL_KINDS = {"domain", "space", "???", "none"}


def nrrd_volume_axes(header):
    """The (up to three) axes of an NRRD that run through space."""
    axes = range(header["dimension"])
    if "kinds" in header:
        axes = [a for a in axes if header["kinds"][a] in SPATIAL_KINDS]
    if "space directions" in header:
        axes = [a for a in axes if np.isfinite(header["space directions"][a]).all()]
    elif "kinds" not in header and len(axes) > 3:
        axes = [a for a in axes if "spacings" not in header or np.isfinite(header["spacings"][a])]
    return list(axes)[:3]


def nrrd_affine(header, axes):
    """World from voxel in the file's own space: from space directions, or per axis as the format defines it."""
    affine = np.eye(4)
    if "space directions" in header:
        for column, axis in enumerate(axes):
            affine[:3, column] = header["space directions"][axis][:3]
        affine[:3, 3] = header.get("space origin", np.zeros(3))[:3]
        return affine

    def per_axis(*names):
        for name in names:
            if name in header:
                found = header[name]
                return found.split() if isinstance(found, str) else found
        return [None] * header["dimension"]

    def known(number):
        return number is not None and np.isfinite(number)

    spacings = per_axis("spacings")
    mins, maxs = per_axis("axis mins", "axismins"), per_axis("axis maxs", "axismaxs")
    centers = per_axis("centers", "centerings")
    for column, axis in enumerate(axes):
        node = centers[axis] == "node"
        spacing = spacings[axis]
        if not known(spacing):
            steps = header["sizes"][axis] - node
            spacing = (maxs[axis] - mins[axis]) / steps if known(mins[axis]) and known(maxs[axis]) else 1.0
        affine[column, column] = spacing
        if known(mins[axis]):
            affine[column, 3] = mins[axis] if node else mins[axis] + spacing / 2
    return affine


def read_pynrrd(path):
    """NRRD through pynrrd, which leaves the geometry to its caller."""
    array, header = nrrd.read(str(path))
    axes = nrrd_volume_axes(header)
    index = tuple(slice(None) if axis in axes else 0 for axis in range(array.ndim))
    to_ras = NRRD_TO_RAS.get(header.get("space", "").lower())
    affine = nrrd_affine(header, axes)
    affine = affine if to_ras is None else to_ras @ affine
    values = first_volume(array[index])
    return Reading(PYNRRD, values.dtype.newbyteorder("=").name, values, affine, to_ras is not None)


def nrrd_says_oriented(path):
    """Whether an NRRD header names an anatomical space; SimpleITK does not tell."""
    head = Path(path).read_bytes()[:16384].decode("latin-1")
    found = re.search(r"(?mi)^space: *(\S+?)\s*$", head)
    return bool(found) and found[1].lower() in NRRD_TO_RAS


def read_simpleitk(path, oriented=True):
    """Any format through SimpleITK, which speaks LPS. Of a file that is not oriented the axes are taken as they are."""
    image = sitk.ReadImage(str(path))
    array = sitk.GetArrayFromImage(image)
    if image.GetNumberOfComponentsPerPixel() > 1:
        array = array[..., 0]
    size, n = image.GetDimension(), min(image.GetDimension(), 3)
    affine = np.eye(4)
    affine[:n, :n] = (np.reshape(image.GetDirection(), (size, size)) * image.GetSpacing())[:n, :n]
    affine[:n, 3] = image.GetOrigin()[:n]
    affine = RAS_FROM_LPS @ affine if oriented else affine
    return Reading(SIMPLEITK, array.dtype.name, first_volume(array.T), affine, oriented)


def read_raw(path):
    """A raw file, by NumPy, from its name and its side file."""
    path = Path(path)
    named = re.fullmatch(r"(?P<name>.+)_(?P<dims>\d+x\d+x\d+)_(?P<type>u?int\d+|float\d+)", path.stem)
    about = {"header_bytes": 0, "spacing": [1, 1, 1], "big_endian": False}
    if named:
        about.update(dims=[int(n) for n in named["dims"].split("x")], type=named["type"])
    for stem in {path.stem, named["name"] if named else path.stem}:
        side = path.with_name(stem + ".json")
        if side.is_file():
            said = json.loads(side.read_text())
            about.update(said, dims=said.get("dims", said.get("size")))
    dtype = np.dtype(about["type"]).newbyteorder(">" if about["big_endian"] else "<")
    array = np.fromfile(path, dtype, offset=about["header_bytes"]).reshape(about["dims"], order="F")
    return Reading(NUMPY, array.dtype.newbyteorder("=").name, array, from_matvec(np.diag(about["spacing"])), False)


# Files whose headers pynrrd takes for something else: it tells field names by their case, which the format does not.
PYNRRD_MISREADS = {"upper_case_fields.nrrd"}


def read_both(path, format_name):
    """The reading that counts and, where two libraries know the format, the other one's (or why it has none)."""
    if format_name == "raw":
        return read_raw(path), None
    if format_name == "metaimage":
        return read_simpleitk(path), None
    if format_name == "nifti":
        primary = read_nibabel(path)
        return primary, attempt(read_simpleitk, path, primary.oriented)
    primary = PYNRRD if Path(path).name in PYNRRD_MISREADS else attempt(read_pynrrd, path)
    secondary = attempt(read_simpleitk, path, nrrd_says_oriented(path))
    # pynrrd knows neither hex nor several data files, and stumbles over a few headers that the format allows.
    return (secondary, PYNRRD) if isinstance(primary, str) else (primary, secondary)


def attempt(read, path, *arguments):
    """A reading, or the name of the library that refuses the file."""
    try:
        return read(path, *arguments)
    except Exception:  # noqa: BLE001 - each library has its own kinds
        return {read_simpleitk: SIMPLEITK, read_pynrrd: PYNRRD}[read]


def without_nonfinite(values):
    """Volumes hold finite values: NaN becomes the smallest finite one, infinities the nearest finite extreme."""
    finite = np.isfinite(values) if values.dtype.kind == "f" else np.True_
    if np.all(finite):
        return values, 0
    low, high = values[finite].min(), values[finite].max()
    return np.nan_to_num(values, nan=low, posinf=high, neginf=low), int(np.count_nonzero(~finite))
