//! Colour spaces that ParaView interpolates colours in.
//!
//! `HSV` with hue in 0..1; `Lab` is CIELAB of D65 white from sRGB (IEC 61966-2-1); `Diverging` is a polar form of it (Msh) with
//! white in the middle (Moreland, "Diverging Color Maps for Scientific Visualization", 2009). Constants are those of VTK, so
//! that colours come out as its users know them.

use std::f64::consts::{PI, TAU};

type Color = [f64; 3];

/// What colours between two points are mixed in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ColorSpace {
    /// Straight lines in RGB, as our own functions have.
    Rgb,
    /// Hue, saturation, value; with `wrap`, hue takes the short way round.
    Hsv {
        /// Whether hue may pass through red.
        wrap: bool,
    },
    /// CIELAB.
    Lab,
    /// Msh, through white between colours far apart.
    Diverging,
    /// The upper colour over the whole stretch between two points.
    Step,
}

impl ColorSpace {
    /// The colour a share `s` (0..=1) of the way from `a` to `b`, in 0..=1.
    pub(super) fn mix(self, a: &Color, b: &Color, s: f64) -> Color {
        let color = match self {
            Self::Rgb => lerp(a, b, s),
            Self::Step => *b,
            Self::Hsv { wrap } => mix_hsv(a, b, s, wrap),
            Self::Lab => rgb_from_lab(&lerp(&lab_from_rgb(a), &lab_from_rgb(b), s)),
            Self::Diverging => mix_diverging(a, b, s),
        };
        // Not a number cannot come of colours in range; it would be 0.
        color.map(|c| if c > 0.0 { c.min(1.0) } else { 0.0 })
    }
}

fn lerp(a: &Color, b: &Color, s: f64) -> Color {
    std::array::from_fn(|i| (1.0 - s) * a[i] + s * b[i])
}

fn mix_hsv(a: &Color, b: &Color, s: f64, wrap: bool) -> Color {
    let (mut a, mut b) = (hsv_from_rgb(a), hsv_from_rgb(b));
    if wrap && a[0] - b[0] > 0.5 {
        a[0] -= 1.0;
    } else if wrap && b[0] - a[0] > 0.5 {
        b[0] -= 1.0;
    }
    let mut mixed = lerp(&a, &b, s);
    if mixed[0] < 0.0 {
        mixed[0] += 1.0;
    }
    rgb_from_hsv(&mixed)
}

fn hsv_from_rgb(rgb: &Color) -> Color {
    let [r, g, b] = *rgb;
    let (least, most) = (r.min(g).min(b), r.max(g).max(b));
    let range = most - least;
    if range <= 0.0 {
        return [0.0, 0.0, most];
    }
    let hue = if most == r {
        (g - b) / range
    } else if most == g {
        2.0 + (b - r) / range
    } else {
        4.0 + (r - g) / range
    };
    [(hue / 6.0).rem_euclid(1.0), range / most, most]
}

fn rgb_from_hsv(hsv: &Color) -> Color {
    let [h, s, v] = *hsv;
    // 1 between a sixth before and a sixth after the channel's own hue, falling to 0 within another sixth.
    let channel = |hue: f64| {
        let away = (h - hue).rem_euclid(1.0);
        let away = 6.0 * away.min(1.0 - away);
        v * (1.0 - s * (away - 1.0).clamp(0.0, 1.0))
    };
    [channel(0.0), channel(1.0 / 3.0), channel(2.0 / 3.0)]
}

/// White of D65 in XYZ.
const WHITE: Color = [0.9505, 1.0, 1.089];

fn lab_from_rgb(rgb: &Color) -> Color {
    let linear = rgb.map(|c| if c > 0.04045 { ((c + 0.055) / 1.055).powf(2.4) } else { c / 12.92 });
    let [r, g, b] = linear;
    let xyz = [
        0.4124 * r + 0.3576 * g + 0.1805 * b,
        0.2126 * r + 0.7152 * g + 0.0722 * b,
        0.0193 * r + 0.1192 * g + 0.9505 * b,
    ];
    let f = |i: usize| {
        let t: f64 = xyz[i] / WHITE[i];
        if t > 0.008856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 }
    };
    [116.0 * f(1) - 16.0, 500.0 * (f(0) - f(1)), 200.0 * (f(1) - f(2))]
}

fn rgb_from_lab(lab: &Color) -> Color {
    let y = (lab[0] + 16.0) / 116.0;
    let f = [lab[1] / 500.0 + y, y, y - lab[2] / 200.0];
    let xyz: Color = std::array::from_fn(|i| {
        let cube = f[i].powi(3);
        WHITE[i] * if cube > 0.008856 { cube } else { (f[i] - 16.0 / 116.0) / 7.787 }
    });
    let [x, y, z] = xyz;
    let linear = [
        3.2406 * x - 1.5372 * y - 0.4986 * z,
        -0.9689 * x + 1.8758 * y + 0.0415 * z,
        0.0557 * x - 0.2040 * y + 1.0570 * z,
    ];
    let rgb = linear.map(|c: f64| if c > 0.0031308 { 1.055 * c.powf(1.0 / 2.4) - 0.055 } else { 12.92 * c });
    // Colours that are too bright keep their hue.
    let most = rgb[0].max(rgb[1]).max(rgb[2]);
    if most > 1.0 { rgb.map(|c| c / most) } else { rgb }
}

fn msh_from_lab(lab: &Color) -> Color {
    let [l, a, b] = *lab;
    let m = (l * l + a * a + b * b).sqrt();
    let s = if m > 0.001 { (l / m).clamp(-1.0, 1.0).acos() } else { 0.0 };
    let h = if s > 0.001 { b.atan2(a) } else { 0.0 };
    [m, s, h]
}

fn lab_from_msh(msh: &Color) -> Color {
    let [m, s, h] = *msh;
    [m * s.cos(), m * s.sin() * h.cos(), m * s.sin() * h.sin()]
}

/// Below this angle (radians) a colour has no hue worth the name.
const UNSATURATED: f64 = 0.05;

/// Moreland's algorithm: white goes between two saturated colours of different hue; a colour without hue takes one that
/// makes the way to it look even.
fn mix_diverging(a: &Color, b: &Color, s: f64) -> Color {
    let (mut a, mut b) = (msh_from_lab(&lab_from_rgb(a)), msh_from_lab(&lab_from_rgb(b)));
    let mut s = s;
    let apart = (a[2] - b[2]).abs().rem_euclid(TAU);
    let apart = apart.min(TAU - apart);
    if a[1] > UNSATURATED && b[1] > UNSATURATED && apart > 0.33 * PI {
        let white = [a[0].max(b[0]).max(88.0), 0.0, 0.0];
        if s < 0.5 {
            b = white;
            s *= 2.0;
        } else {
            a = white;
            s = 2.0 * s - 1.0;
        }
    }
    if a[1] < UNSATURATED && b[1] > UNSATURATED {
        a[2] = hue_beside(&b, a[0]);
    } else if b[1] < UNSATURATED && a[1] > UNSATURATED {
        b[2] = hue_beside(&a, b[0]);
    }
    rgb_from_lab(&lab_from_msh(&lerp(&a, &b, s)))
}

/// The hue for a colour without one, of magnitude `m`, beside a saturated one.
fn hue_beside(saturated: &Color, m: f64) -> f64 {
    let [own, s, h] = *saturated;
    if own >= m - 0.1 {
        return h;
    }
    let spin = s * (m * m - own * own).sqrt() / (own * s.sin());
    if h > -0.3 * PI { h + spin } else { h - spin }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn color() -> impl Strategy<Value = Color> {
        [0.0..=1.0, 0.0..=1.0, 0.0..=1.0]
    }

    const ALL: [ColorSpace; 5] = [
        ColorSpace::Rgb,
        ColorSpace::Hsv { wrap: false },
        ColorSpace::Hsv { wrap: true },
        ColorSpace::Lab,
        ColorSpace::Diverging,
    ];

    proptest! {
        /// The published constants of sRGB are rounded to four places: there and back is off by less than 2e-3. Moreland's
        /// algorithm gives the nearly grey another hue: at an angle of 0.05 that moves a channel by up to 0.1.
        #[test]
        fn every_space_begins_and_ends_at_the_colours_it_mixes(a in color(), b in color()) {
            for space in ALL {
                for (s, end) in [(0.0, a), (1.0, b)] {
                    let mixed = space.mix(&a, &b, s);
                    let off = (0..3).map(|i| (mixed[i] - end[i]).abs()).fold(0.0, f64::max);
                    let bound = if space == ColorSpace::Diverging { 0.1 } else { 2e-3 };
                    prop_assert!(off < bound, "{space:?} {s}: {mixed:?}, expected {end:?}");
                }
            }
        }

        #[test]
        fn mixtures_are_colours(a in color(), b in color(), s in 0.0..=1.0) {
            for space in ALL {
                prop_assert!(space.mix(&a, &b, s).iter().all(|c| (0.0..=1.0).contains(c)));
            }
        }
    }

    /// Between the blue and the red of Moreland's paper lies the light grey that it prints (0.865 a channel).
    #[test]
    fn diverging_goes_through_light_grey() {
        let mixed = ColorSpace::Diverging.mix(&[0.230, 0.299, 0.754], &[0.706, 0.016, 0.150], 0.5);
        assert!(mixed.iter().all(|c| (c - 0.865).abs() < 0.004), "{mixed:?}");
    }

    #[test]
    fn known_colours_have_the_published_coordinates() {
        // Lindbloom's calculator for sRGB red, D65: 53.24, 80.09, 67.20.
        let [l, a, b] = lab_from_rgb(&[1.0, 0.0, 0.0]);
        assert!((l - 53.24).abs() < 0.05 && (a - 80.09).abs() < 0.1 && (b - 67.20).abs() < 0.1);
        assert_eq!(hsv_from_rgb(&[0.0, 0.5, 0.0]), [1.0 / 3.0, 1.0, 0.5]);
        // From red to blue over green, or through magenta.
        let (red, blue) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
        let near = |a: Color, b: Color| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near(ColorSpace::Hsv { wrap: false }.mix(&red, &blue, 0.5), [0.0, 1.0, 0.0]));
        assert!(near(ColorSpace::Hsv { wrap: true }.mix(&red, &blue, 0.5), [1.0, 0.0, 1.0]));
    }
}
