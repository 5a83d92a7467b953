"""The labelled volume, whose voxels name their place in the world, and the bookkeeping of fixture files."""

import itertools
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from nibabel.affines import from_matvec
from nibabel.orientations import aff2axcodes

LPS_FROM_RAS = RAS_FROM_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])
RAS_FROM_LAS = np.diag([-1.0, 1.0, 1.0, 1.0])

SHAPE = (3, 4, 5)
SPACING = np.array([1.5, 2.0, 3.0])  # mm along R, A, S
ORIGIN = np.array([-4.0, 10.0, 25.0])  # mm, RAS, of the voxel with value 0
LABELLED_AFFINE = from_matvec(np.diag(SPACING), ORIGIN)


def labelled(dtype="int16"):
    """The volume in R, A, S order: value = 100 i + 10 j + k at world ORIGIN + SPACING * (i, j, k)."""
    i, j, k = np.indices(SHAPE)
    return (100 * i + 10 * j + k).astype(dtype)


def label_at(world):
    """The value that belongs to RAS positions, shape [n, 3] in mm."""
    index = (world - ORIGIN) / SPACING
    assert np.abs(index - index.round()).max() < 1e-4, "a voxel centre is off the labelled lattice"
    return index.round().astype(int) @ np.array([100, 10, 1])


def axis_orders():
    """All 48 storage orders of the labelled volume: (code, voxels, affine_ras), code like `LPS`."""
    source = labelled()
    for order in itertools.permutations(range(3)):
        for flips in itertools.product((False, True), repeat=3):
            voxels = source.transpose(order)
            source_from_voxel = np.zeros((4, 4))
            source_from_voxel[3, 3] = 1.0
            for axis, (source_axis, flip) in enumerate(zip(order, flips)):
                source_from_voxel[source_axis, axis] = -1.0 if flip else 1.0
                source_from_voxel[source_axis, 3] = SHAPE[source_axis] - 1 if flip else 0.0
            voxels = np.flip(voxels, [axis for axis in range(3) if flips[axis]])
            affine = LABELLED_AFFINE @ source_from_voxel
            yield "".join(aff2axcodes(affine)), voxels, affine


def check_labels(values, affine_ras, name):
    """Every voxel of a labelled volume holds the label of its world position."""
    index = np.indices(values.shape).reshape(3, -1).T
    world = index @ affine_ras[:3, :3].T + affine_ras[:3, 3]
    assert np.array_equal(label_at(world), values.reshape(-1)), f"{name}: values do not lie where they say"


def rotation(axis, degrees):
    """Rodrigues' formula."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


ROTATED = from_matvec(rotation([1, 2, 3], 33) @ np.diag(SPACING), ORIGIN)
SHEARED = from_matvec(rotation([1, 2, 3], 33) @ np.array([[1.5, 0.25, 0.5], [0, 2, -0.75], [0, 0, 3]]), ORIGIN)


def full_range(dtype, rng):
    """Voxels over the whole range of an integer type, or of a moderate one (within f32) for floats."""
    dtype = np.dtype(dtype)
    if dtype.kind == "f":
        voxels = rng.normal(0, 1000, SHAPE).astype(dtype)
    else:
        info = np.iinfo(dtype)
        voxels = rng.integers(info.min, info.max, SHAPE, dtype, endpoint=True)
        voxels[0, 0, 0], voxels[-1, -1, -1] = info.min, info.max
    return voxels


TYPES = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float32", "float64"]


def disk(voxels, endian="<"):
    """Bytes of an array in file order, first axis fastest."""
    return voxels.astype(voxels.dtype.newbyteorder(endian)).tobytes(order="F")


@dataclass
class Fixture:
    """A file to read back: what it is about, the values that were put in (first volume, rescaled), and its place."""

    path: str
    what: str
    values: np.ndarray
    affine: np.ndarray | None = None
    labelled: bool = False


@dataclass
class Fixtures:
    """Writes fixture files below `root` and remembers which of them are to be read."""

    root: Path
    rng: np.random.Generator
    entries: list = field(default_factory=list)

    def part(self, path, content):
        """A file that another one refers to."""
        target = self.root / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)

    def expect(self, path, what, values, affine=None, labelled=False):
        """Registers a file that is already there."""
        self.entries.append(Fixture(path, what, values, affine, labelled))

    def add(self, path, content, what, values, affine=None, labelled=False):
        """A file to read back."""
        self.part(path, content)
        self.expect(path, what, values, affine, labelled)
