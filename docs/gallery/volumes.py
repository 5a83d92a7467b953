#!/usr/bin/env python3
"""Prepare the chest volumes of the gallery from a DICOM series.

    python3 volumes.py DICOM_FOLDER OUTPUT_FOLDER

needs SimpleITK, numpy and scipy, and writes

- chest.nrrd           the series as one file, everything outside the body (table, clothes) set to air;
- chest-contrast.nrrd  the same with *simulated* contrast agent: about 260 HU added to the heart, the great vessels
                       and the vessels of the lungs, found by thresholds. A stand-in for a contrast-enhanced scan,
                       good enough to look at a transfer function and for nothing else;
- heart.nrrd           chest-contrast.nrrd behind the breastbone and before the spine.

The numbers below are for the series that the gallery shows.
"""

import sys

import numpy as np
import SimpleITK as sitk
from scipy import ndimage

AIR = -1000
AGENT = 260
# z, y, x: where the heart and great vessels are, where the lungs are, and the box of heart.nrrd.
HEART = np.s_[:, 185:350, 195:340]
LUNGS = np.s_[:, 175:395, 115:395]
CROP = np.s_[:, 204:340, 180:336]


def largest(mask):
    """The largest connected part of a mask."""
    labels, _ = ndimage.label(mask)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return labels == sizes.argmax()


def inside(box, mask):
    """A mask without what is outside a box."""
    cut = np.zeros_like(mask)
    cut[box] = mask[box]
    return cut


def body(values):
    """Voxels of the body, lungs included, slice by slice."""
    mask = largest(ndimage.binary_opening(ndimage.gaussian_filter(values, 1) > -350, iterations=4))
    return np.stack([ndimage.binary_fill_holes(ndimage.binary_dilation(s, iterations=3)) for s in mask])


def agent(values):
    """The share of contrast agent, 0 to 1, in each voxel."""
    smooth = ndimage.gaussian_filter(values, 1.2)
    blood = inside(HEART, (smooth > 45) & (smooth < 200))
    blood = ndimage.binary_closing(largest(ndimage.binary_opening(blood, iterations=3)), iterations=2)
    lungs = ndimage.binary_closing(smooth < -600, iterations=6) & ~ndimage.binary_dilation(blood, iterations=2)
    lungs = ndimage.gaussian_filter(inside(LUNGS, lungs).astype(np.float32), 1)
    vessels = np.clip((smooth + 300) / 300, 0, 1) * lungs
    return np.maximum(ndimage.gaussian_filter(blood.astype(np.float32), 1.5), vessels)


def main(series, out):
    reader = sitk.ImageSeriesReader()
    reader.SetFileNames(reader.GetGDCMSeriesFileNames(series))
    image = reader.Execute()
    values = sitk.GetArrayFromImage(image).astype(np.float32)
    values[~body(values)] = AIR

    def write(name, array, box=np.s_[:, :, :]):
        result = sitk.GetImageFromArray(np.clip(array, AIR, 3000).round().astype(np.int16))
        result.CopyInformation(image)
        z, y, x = (s.indices(n) for s, n in zip(box, array.shape))
        sitk.WriteImage(result[x[0] : x[1], y[0] : y[1], z[0] : z[1]], f"{out}/{name}", useCompression=True)

    write("chest.nrrd", values)
    enhanced = values + AGENT * agent(values)
    write("chest-contrast.nrrd", enhanced)
    write("heart.nrrd", enhanced, CROP)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: volumes.py DICOM_FOLDER OUTPUT_FOLDER")
    main(*sys.argv[1:])
