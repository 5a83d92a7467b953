//! The integral along a ray: three-point Gauss-Legendre collocation, both integrals at once.

/// Nodes, weights and integration matrix of three-point Gauss-Legendre collocation on 0..1.
const ROOT15: f64 = 3.872_983_346_207_417;
pub(super) const GAUSS_NODES: [f64; 3] = [0.5 - ROOT15 / 10.0, 0.5, 0.5 + ROOT15 / 10.0];
const GAUSS_WEIGHTS: [f64; 3] = [5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0];
const GAUSS_PARTIAL: [[f64; 3]; 3] = [
    [5.0 / 36.0, 2.0 / 9.0 - ROOT15 / 15.0, 5.0 / 36.0 - ROOT15 / 30.0],
    [5.0 / 36.0 + ROOT15 / 24.0, 2.0 / 9.0, 5.0 / 36.0 - ROOT15 / 24.0],
    [5.0 / 36.0 + ROOT15 / 30.0, 2.0 / 9.0 + ROOT15 / 15.0, 5.0 / 36.0],
];

/// What a ray has gathered so far.
#[derive(Clone, Copy)]
pub(super) struct Integral {
    pub(super) color: [f64; 3],
    pub(super) transmittance: f64,
    /// Where the opacity passes one half.
    pub(super) depth: f64,
}

impl Integral {
    /// Nothing yet.
    pub(super) const START: Self = Self { color: [0.0; 3], transmittance: 1.0, depth: f64::INFINITY };

    /// Adds a surface of a colour that is already lit.
    pub(super) fn add_surface(&mut self, color: [f64; 3], opacity: f64, t: f64) {
        for (sum, color) in self.color.iter_mut().zip(color) {
            *sum += self.transmittance * opacity * color;
        }
        self.transmittance *= 1.0 - opacity;
        if self.depth.is_infinite() && self.transmittance <= 0.5 {
            self.depth = t;
        }
    }

    /// Adds a stretch of `length` from three samples (colour, extinction) at its Gauss nodes.
    pub(super) fn add(&mut self, samples: &[([f64; 3], f64); 3], t_start: f64, length: f64) {
        for i in 0..3 {
            let depth_to_node: f64 = (0..3).map(|j| GAUSS_PARTIAL[i][j] * samples[j].1).sum::<f64>() * length;
            let weight =
                self.transmittance * (-depth_to_node).exp() * GAUSS_WEIGHTS[i] * samples[i].1 * length;
            for (sum, color) in self.color.iter_mut().zip(samples[i].0) {
                *sum += weight * color;
            }
        }
        let depth: f64 = (0..3).map(|i| GAUSS_WEIGHTS[i] * samples[i].1).sum::<f64>() * length;
        let after = self.transmittance * (-depth).exp();
        if self.depth.is_infinite() && after <= 0.5 && depth > 0.0 {
            self.depth = t_start + length * (self.transmittance / 0.5).ln() / depth;
        }
        self.transmittance = after;
    }

    /// The largest difference of any channel.
    pub(super) fn difference(&self, other: &Self) -> f64 {
        let color = self.color.iter().zip(other.color).map(|(a, b)| (a - b).abs());
        color.fold((self.transmittance - other.transmittance).abs(), f64::max)
    }
}
