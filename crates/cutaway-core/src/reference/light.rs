//! Light within a cell, and on and behind clip surfaces.

use glam::DVec3;

use super::{CastRay, Caster, CellPiece};
use crate::camera::Ray;
use crate::clip::{ClipSegment, FlatClip, Impregnation};
use crate::field;

/// What light makes of a colour: a factor, and white that is added.
pub(super) type Terms = (f64, f64);

/// A colour in that light.
pub(super) fn lit(color: [f64; 3], (factor, white): Terms) -> [f64; 3] {
    color.map(|c| c * factor + white)
}

/// The surface at the near end of a segment, lit.
#[derive(Clone, Copy)]
pub(super) struct Face {
    /// Where the ray meets it.
    pub(super) t: f64,
    pub(super) terms: Terms,
    /// Of the angle between ray and normal, 0..=1.
    cosine: f64,
}

impl Face {
    /// None where the segment begins at no surface.
    pub(super) fn new(caster: &Caster, clip: &FlatClip, ray: &Ray, segment: &ClipSegment) -> Option<Self> {
        let normal = segment.near_normal(clip, ray)?;
        let lighting = caster.scene.lighting();
        let terms = if lighting.shade {
            let (l, h) = lighting.directions(ray.direction);
            // The normal of a gradient is against it.
            lighting.terms(-normal, 0.0, l, h)
        } else {
            (1.0, 0.0)
        };
        Some(Self { t: segment.segment.t_near(), terms, cosine: normal.dot(ray.direction).abs() })
    }
}

/// The stretch behind a clip surface where the surface's light takes part; see [`Impregnation`].
///
/// What is mixed is the light of the two normals, not the normals: noisy ones that point the other way would take from
/// the surface's, where two-sided light does not care; and where there is no gradient there is nothing to mix with.
#[derive(Clone, Copy)]
pub(super) struct Layer {
    kind: Impregnation,
    terms: Terms,
    t_near: f64,
    /// How far it goes along the ray.
    length: f64,
}

impl Layer {
    /// None where there is no impregnation.
    pub(super) fn new(caster: &Caster, face: &Face) -> Option<Self> {
        let depth = caster.scene.impregnation_depth()?;
        let length = depth / face.cosine.max(Impregnation::LEAST_COSINE);
        let kind = caster.scene.clip_shading().impregnation;
        Some(Self { kind, terms: face.terms, t_near: face.t, length })
    }

    /// Where it ends.
    pub(super) fn t_far(&self) -> f64 {
        self.t_near + self.length
    }

    fn mixed(&self, t: f64, (factor, white): Terms) -> Terms {
        let w = self.kind.weight((t - self.t_near) / self.length);
        let mix = |surface: f64, volume: f64| w * surface + (1.0 - w) * volume;
        (mix(self.terms.0, factor), mix(self.terms.1, white))
    }
}

/// The light within one cell: its corners' gradients, and the ray's way through it.
pub(super) struct CellLight<'a> {
    gradients: [DVec3; 8],
    /// Position within the cell at `s` = 0, and what `s` adds to it.
    start: DVec3,
    stride: DVec3,
    l: DVec3,
    h: DVec3,
    layer: Option<Layer>,
    piece: &'a CellPiece,
}

impl<'a> CellLight<'a> {
    pub(super) fn new(caster: &Caster, cast: &CastRay, layer: Option<Layer>, piece: &'a CellPiece) -> Self {
        let volume = caster.scene.volume();
        let t = |s: f64| piece.segment.t_near() + s * piece.segment.length();
        let at = |s: f64| cast.ray_in_voxel.origin + cast.ray_in_voxel.direction * t(s);
        let (cell, _) = field::cell_of(volume, at(0.5));
        let base = DVec3::new(cell[0] as f64, cell[1] as f64, cell[2] as f64);
        let (l, h) = caster.scene.lighting().directions(cast.ray.direction);
        Self {
            gradients: field::corner_gradients_in_world(volume, cell),
            start: at(0.0) - base,
            stride: at(1.0) - at(0.0),
            l,
            h,
            layer,
            piece,
        }
    }

    /// At `s` of the cell's stretch.
    pub(super) fn at(&self, caster: &Caster, s: f64) -> Terms {
        let gradient = field::trilinear_vector(&self.gradients, self.start + self.stride * s);
        let terms = caster.scene.lighting().terms(gradient, caster.vanishing, self.l, self.h);
        let t = self.piece.segment.t_near() + s * self.piece.segment.length();
        self.layer.map_or(terms, |layer| layer.mixed(t, terms))
    }
}
