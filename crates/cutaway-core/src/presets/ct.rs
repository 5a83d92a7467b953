//! Presets for computed tomography: positions in Hounsfield units, opacities per millimetre.
//!
//! Lit colours stay below 0.85: the highlight (0.2 of white) then hardly clips.

use super::{Modality, Preset, Scale};
use crate::scene::Mode;

type Colors = &'static [(f64, [f64; 3])];
type Opacities = &'static [(f64, f64)];

const fn lit(name: &'static str, description: &'static str, colors: Colors, opacities: Opacities) -> Preset {
    let (modality, mode, scale) = (Modality::Ct, Mode::Composite, Scale::Absolute);
    Preset { name, modality, description, mode, shade: true, colors, opacities, scale }
}

const fn unlit(mode: Mode, preset: Preset) -> Preset {
    Preset { mode, shade: false, ..preset }
}

/// Blood with contrast agent, then calcium and bone.
const BLOOD_AND_BONE: Colors = &[
    (100.0, [0.45, 0.08, 0.05]),
    (220.0, [0.72, 0.14, 0.09]),
    (360.0, [0.82, 0.36, 0.24]),
    (500.0, [0.84, 0.74, 0.56]),
    (900.0, [0.84, 0.82, 0.74]),
    (1600.0, [0.84, 0.84, 0.82]),
];

/// Spongy bone, then cortical bone, then enamel and metal.
const IVORY: Colors = &[
    (100.0, [0.58, 0.33, 0.22]),
    (250.0, [0.76, 0.58, 0.40]),
    (500.0, [0.83, 0.79, 0.64]),
    (1200.0, [0.84, 0.83, 0.80]),
    (2500.0, [0.84, 0.84, 0.84]),
];

/// Fat, muscle, organs with blood, bone.
const FLESH: Colors = &[
    (-150.0, [0.80, 0.62, 0.36]),
    (-50.0, [0.82, 0.66, 0.42]),
    (20.0, [0.62, 0.24, 0.17]),
    (90.0, [0.72, 0.28, 0.19]),
    (220.0, [0.80, 0.34, 0.23]),
    (360.0, [0.82, 0.50, 0.36]),
    (550.0, [0.83, 0.74, 0.60]),
    (1000.0, [0.84, 0.83, 0.79]),
];

pub(super) const PRESETS: &[Preset] = &[
    lit(
        "CT-AAA",
        "abdominal aorta and its branches with contrast agent, and the skeleton",
        BLOOD_AND_BONE,
        &[(140.0, 0.0), (200.0, 0.25), (320.0, 0.6), (700.0, 0.85)],
    ),
    lit(
        "CT-AAA2",
        "as CT-AAA, within a veil of organs and thrombus",
        BLOOD_AND_BONE,
        &[(15.0, 0.0), (45.0, 0.012), (110.0, 0.02), (150.0, 0.04), (230.0, 0.4), (700.0, 0.8)],
    ),
    lit(
        "CT-Air",
        "the walls of what is filled with air: airways, sinuses, lungs, gas, the skin",
        &[(-800.0, [0.40, 0.62, 0.82]), (-600.0, [0.66, 0.80, 0.84]), (-350.0, [0.82, 0.84, 0.84])],
        &[(-800.0, 0.0), (-650.0, 0.15), (-450.0, 0.15), (-300.0, 0.0)],
    ),
    lit(
        "CT-Bone",
        "bone as a solid surface",
        IVORY,
        &[(170.0, 0.0), (260.0, 0.35), (450.0, 0.85), (1000.0, 0.95)],
    ),
    lit(
        "CT-Bones",
        "the skeleton, spongy bone translucent around the dense parts",
        IVORY,
        &[(130.0, 0.0), (250.0, 0.03), (500.0, 0.10), (900.0, 0.25), (1500.0, 0.5)],
    ),
    lit(
        "CT-Cardiac",
        "heart with contrast agent: muscle translucent, blood and bone dense",
        FLESH,
        &[(20.0, 0.0), (70.0, 0.04), (130.0, 0.10), (220.0, 0.45), (500.0, 0.75)],
    ),
    lit(
        "CT-Cardiac2",
        "the blood-filled chambers and vessels as surfaces",
        BLOOD_AND_BONE,
        &[(110.0, 0.0), (170.0, 0.4), (260.0, 0.8), (600.0, 0.9)],
    ),
    lit(
        "CT-Cardiac3",
        "heart and great vessels as solid tissue, fat as a faint film",
        FLESH,
        &[(-140.0, 0.0), (-90.0, 0.006), (-30.0, 0.006), (30.0, 0.20), (110.0, 0.55), (300.0, 0.85)],
    ),
    lit(
        "CT-Chest-Contrast-Enhanced",
        "chest with contrast agent: vessels and bone within a veil of soft tissue",
        FLESH,
        &[(-120.0, 0.0), (-60.0, 0.003), (40.0, 0.025), (110.0, 0.05), (180.0, 0.35), (500.0, 0.75)],
    ),
    lit(
        "CT-Chest-Vessels",
        "vessels of the chest, the fine ones within the lung too",
        BLOOD_AND_BONE,
        &[
            (-400.0, 0.0),
            (-280.0, 0.14),
            (-160.0, 0.0),
            (20.0, 0.004),
            (110.0, 0.01),
            (160.0, 0.10),
            (240.0, 0.5),
            (600.0, 0.8),
        ],
    ),
    lit(
        "CT-Coronary-Arteries",
        "coronary arteries on a translucent heart",
        FLESH,
        &[(60.0, 0.0), (110.0, 0.03), (170.0, 0.14), (260.0, 0.5), (450.0, 0.8)],
    ),
    lit(
        "CT-Coronary-Arteries-2",
        "contrast agent and calcium alone, as surfaces",
        BLOOD_AND_BONE,
        &[(160.0, 0.0), (220.0, 0.5), (330.0, 0.9)],
    ),
    lit(
        "CT-Coronary-Arteries-3",
        "contrast agent translucent, calcified plaque and stents dense and white",
        BLOOD_AND_BONE,
        &[(130.0, 0.0), (220.0, 0.10), (400.0, 0.16), (550.0, 0.5), (900.0, 0.9)],
    ),
    lit(
        "CT-Cropped-Volume-Bone",
        "bone with marrow in red, opaque: for volumes that are cut open",
        &[
            (60.0, [0.42, 0.10, 0.07]),
            (180.0, [0.60, 0.20, 0.13]),
            (350.0, [0.78, 0.55, 0.38]),
            (600.0, [0.83, 0.79, 0.64]),
            (1400.0, [0.84, 0.84, 0.81]),
        ],
        &[(90.0, 0.0), (160.0, 0.10), (300.0, 0.45), (600.0, 0.92)],
    ),
    lit(
        "CT-Fat",
        "fat, with bone for orientation",
        &[
            (-160.0, [0.78, 0.60, 0.28]),
            (-90.0, [0.84, 0.69, 0.38]),
            (-30.0, [0.82, 0.62, 0.35]),
            (300.0, [0.82, 0.78, 0.66]),
        ],
        &[(-170.0, 0.0), (-120.0, 0.12), (-70.0, 0.12), (-20.0, 0.0), (250.0, 0.0), (500.0, 0.4)],
    ),
    lit(
        "CT-Liver-Vasculature",
        "vessels in a translucent liver, with contrast agent",
        &[
            (60.0, [0.45, 0.22, 0.15]),
            (110.0, [0.56, 0.28, 0.19]),
            (150.0, [0.35, 0.42, 0.70]),
            (220.0, [0.55, 0.64, 0.83]),
            (350.0, [0.83, 0.81, 0.74]),
        ],
        &[(60.0, 0.0), (95.0, 0.015), (125.0, 0.02), (160.0, 0.2), (240.0, 0.6), (400.0, 0.8)],
    ),
    lit(
        "CT-Lung",
        "lungs and airways: air-filled tissue translucent, vessels within it dense",
        &[
            (-950.0, [0.55, 0.67, 0.82]),
            (-750.0, [0.80, 0.72, 0.75]),
            (-500.0, [0.82, 0.55, 0.50]),
            (-200.0, [0.80, 0.33, 0.27]),
        ],
        &[(-940.0, 0.0), (-850.0, 0.04), (-700.0, 0.08), (-500.0, 0.20), (-300.0, 0.06), (-150.0, 0.0)],
    ),
    unlit(
        Mode::Mip,
        lit(
            "CT-MIP",
            "brightest value of each ray: contrast agent and bone in grey",
            &[
                (-100.0, [0.0; 3]),
                (100.0, [0.25; 3]),
                (400.0, [0.58; 3]),
                (1000.0, [0.80; 3]),
                (2200.0, [1.0; 3]),
            ],
            &[(-700.0, 0.0), (-100.0, 1.0)],
        ),
    ),
    lit(
        "CT-Muscle",
        "muscle and organs as a surface; skin and fat transparent",
        FLESH,
        &[(-20.0, 0.0), (25.0, 0.12), (60.0, 0.45), (150.0, 0.7), (400.0, 0.9)],
    ),
    lit(
        "CT-Pulmonary-Arteries",
        "pulmonary arteries with contrast agent, the lungs a faint veil",
        &[
            (-900.0, [0.30, 0.42, 0.62]),
            (-400.0, [0.45, 0.55, 0.75]),
            (100.0, [0.40, 0.30, 0.55]),
            (220.0, [0.40, 0.48, 0.82]),
            (400.0, [0.66, 0.75, 0.84]),
            (900.0, [0.84, 0.83, 0.80]),
        ],
        &[
            (-900.0, 0.0),
            (-800.0, 0.003),
            (-400.0, 0.006),
            (0.0, 0.0),
            (140.0, 0.0),
            (210.0, 0.4),
            (400.0, 0.8),
        ],
    ),
    lit(
        "CT-Soft-Tissue",
        "the skin, or where it is cut the organs",
        &[
            (-500.0, [0.83, 0.66, 0.53]),
            (-150.0, [0.83, 0.68, 0.52]),
            (-90.0, [0.82, 0.67, 0.46]),
            (50.0, [0.70, 0.38, 0.29]),
            (110.0, [0.74, 0.40, 0.30]),
            (300.0, [0.83, 0.76, 0.60]),
            (1000.0, [0.84, 0.83, 0.80]),
        ],
        &[(-500.0, 0.0), (-300.0, 0.3), (-150.0, 0.6), (50.0, 0.8)],
    ),
    unlit(
        Mode::Composite,
        lit(
            "CT-X-ray",
            "a radiograph: what lies along the ray adds up",
            &[(0.0, [1.0; 3])],
            &[(-950.0, 0.0), (0.0, 0.004), (100.0, 0.0048), (400.0, 0.012), (2000.0, 0.045)],
        ),
    ),
];
