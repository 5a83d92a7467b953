//! Presets for images without a unit: positions are shares of the volume's robust scale, where 0.25 is the end of the
//! background, 0.5 the median of the object, 1 its bright end and 1.25 the greatest value; opacities per mean voxel spacing.

use super::{Modality, Preset, Scale};
use crate::scene::Mode;

type Colors = &'static [(f64, [f64; 3])];
type Opacities = &'static [(f64, f64)];

const fn lit(
    modality: Modality,
    name: &'static str,
    description: &'static str,
    colors: Colors,
    opacities: Opacities,
) -> Preset {
    let (mode, scale) = (Mode::Composite, Scale::Relative);
    Preset { name, modality, description, mode, shade: true, colors, opacities, scale }
}

const fn unlit(mode: Mode, preset: Preset) -> Preset {
    Preset { mode, shade: false, ..preset }
}

/// Black to white, darker in the middle: maxima along rays are brighter than what they are maxima of.
const GRAY: Colors = &[(0.15, [0.0; 3]), (0.5, [0.30; 3]), (1.0, [0.8; 3]), (1.25, [1.0; 3])];

pub(super) const PRESETS: &[Preset] = &[
    lit(
        Modality::Mr,
        "MR-Angio",
        "bright vessels (time of flight, contrast agent) in red; the rest barely",
        &[(0.5, [0.35, 0.06, 0.05]), (0.8, [0.78, 0.16, 0.10]), (1.0, [0.84, 0.60, 0.42])],
        &[(0.70, 0.0), (0.80, 0.04), (0.92, 0.35), (1.0, 0.7)],
    ),
    lit(
        Modality::Mr,
        "MR-Default",
        "everything above the background, brighter tissue denser",
        &[
            (0.2, [0.28, 0.16, 0.13]),
            (0.4, [0.60, 0.38, 0.30]),
            (0.6, [0.80, 0.64, 0.52]),
            (1.0, [0.84, 0.83, 0.80]),
        ],
        &[(0.22, 0.0), (0.35, 0.08), (0.5, 0.25), (0.75, 0.5), (1.0, 0.7)],
    ),
    unlit(
        Mode::Mip,
        lit(Modality::Mr, "MR-MIP", "brightest value of each ray in grey", GRAY, &[(0.1, 0.0), (0.25, 1.0)]),
    ),
    lit(
        Modality::Mr,
        "MR-T2-Brain",
        "T2-weighted brain: tissue translucent, fluid bright and dense",
        &[
            (0.25, [0.50, 0.36, 0.31]),
            (0.5, [0.80, 0.60, 0.52]),
            (0.7, [0.78, 0.77, 0.80]),
            (1.0, [0.66, 0.81, 0.84]),
        ],
        &[(0.28, 0.0), (0.4, 0.04), (0.6, 0.10), (0.75, 0.3), (1.0, 0.7)],
    ),
    lit(
        Modality::Mr,
        "DTI-FA-Brain",
        "fractional anisotropy: the strong fibre bundles",
        &[
            (0.25, [0.16, 0.24, 0.50]),
            (0.45, [0.20, 0.58, 0.62]),
            (0.65, [0.80, 0.76, 0.36]),
            (1.0, [0.83, 0.36, 0.20]),
        ],
        &[(0.30, 0.0), (0.45, 0.05), (0.65, 0.3), (1.0, 0.7)],
    ),
    lit(
        Modality::Us,
        "US-Fetal",
        "surfaces in amniotic fluid, in warm light",
        &[(0.2, [0.38, 0.20, 0.12]), (0.45, [0.76, 0.48, 0.32]), (1.0, [0.84, 0.75, 0.60])],
        &[(0.25, 0.0), (0.36, 0.12), (0.5, 0.4), (0.8, 0.7)],
    ),
    lit(
        Modality::Any,
        "Generic-Surface",
        "everything above the background as a surface",
        &[(0.2, [0.45, 0.50, 0.58]), (0.5, [0.78, 0.74, 0.68]), (1.0, [0.84, 0.82, 0.74])],
        &[(0.25, 0.0), (0.32, 0.5), (0.45, 0.9)],
    ),
    lit(
        Modality::Any,
        "Generic-Translucent",
        "everything above the background translucent, from cold to warm",
        &[
            (0.2, [0.18, 0.28, 0.58]),
            (0.4, [0.38, 0.62, 0.76]),
            (0.6, [0.83, 0.80, 0.60]),
            (0.8, [0.84, 0.52, 0.26]),
            (1.0, [0.83, 0.30, 0.18]),
        ],
        &[(0.22, 0.0), (0.35, 0.03), (0.6, 0.08), (0.8, 0.2), (1.0, 0.45)],
    ),
    unlit(
        Mode::Mip,
        lit(
            Modality::Any,
            "Generic-MIP",
            "brightest value of each ray in grey",
            GRAY,
            &[(0.1, 0.0), (0.25, 1.0)],
        ),
    ),
];
