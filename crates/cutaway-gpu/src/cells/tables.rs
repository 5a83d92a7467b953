//! What the fragments' integrals look up: the transfer function in pieces, which values are visible, the psi table.

use bytemuck::{Pod, Zeroable};
use cutaway_core::scene::Scene;
use cutaway_core::transfer_function::{ControlPoint, TransferFunction};

use super::numbers::{BINS, EXPONENTIALS, PSI_SIDE, ROW};
use super::view::CellViewUniforms;
use crate::context::Gpu;
use crate::error::GpuError;
use crate::volume::Texels;

/// Bins of a volume's range, as a number.
pub(super) const BINS_OF_RANGE: f64 = BINS as f64;

/// Pieces that a tetrahedron can name.
const MOST_PIECES: usize = 30_000;

/// The largest error of the psi table, of a mean transmittance of 0 to 1: for optical depths of up to 8, and of denser
/// stretches.
pub const PSI_ERROR: [f64; 2] = [1e-3, 0.03];

/// As `Piece` in `pieces.wgsl`; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct Piece {
    pub(crate) low: [f32; 4],
    pub(crate) rise: [f32; 4],
    pub(crate) begin: f32,
    pub(crate) end: f32,
    pub(crate) inverse: f32,
    pub(crate) seen: u32,
}

/// Of one scene's transfer function, on the device.
#[derive(Debug)]
pub(crate) struct Tables {
    pub(crate) pieces: wgpu::Buffer,
    pub(crate) bins: wgpu::Buffer,
    pub(crate) integrals: wgpu::Buffer,
    /// The pieces as texels, in rows: many threads at a time look them up there faster.
    pub(crate) piece_texels: wgpu::TextureView,
    /// Of each bin, and of the end, how many before it can be visible.
    visible_before: Vec<u32>,
    piece_last: u32,
    value_offset: f32,
    value_scale: f32,
    per_unit: f32,
}

/// The bins that values between two meet, from the first to before the second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BinSpan([u16; 2]);

impl BinSpan {
    /// Of values in bins, as `any_visible` in `pieces.wgsl`.
    pub(super) fn of(least: f32, most: f32) -> Self {
        let first = least.clamp(0.0, BINS as f32 - 1.0) as u16;
        Self([first, most.ceil().clamp(f32::from(first) + 1.0, BINS as f32) as u16])
    }
}

/// From values to bins of a volume's range.
#[derive(Clone, Copy, Debug)]
struct BinMap {
    /// The value of bin 0, and bins a unit of value; negative where texels descend.
    first: f64,
    scale: f64,
}

impl Tables {
    pub(crate) fn new(gpu: &Gpu, scene: &Scene, texels: &Texels) -> Result<Self, GpuError> {
        let volume = scene.volume();
        let [lo, hi] = volume.stored_range().map(f64::from);
        let rescale = volume.rescale();
        let span = rescale.value(hi) - rescale.value(lo);
        let scale = if span == 0.0 { 0.0 } else { f64::from(BINS) / span };
        let map = BinMap { first: rescale.value(lo), scale };
        let function = scene.transfer_function();
        let mut pieces = pieces(function, map);
        note_seen(&mut pieces);
        let bins = bins(function, map, &pieces);
        let texel_span = texels.texel(hi) - texels.texel(lo);
        let value_scale = if texel_span == 0.0 { 0.0 } else { f64::from(BINS) / texel_span };
        let (pieces_on, bins_on, integrals, piece_texels) = gpu.checked("the tables of integrals", || {
            let buffer = |label, bytes: &[u8]| gpu.buffer(label, bytes, wgpu::BufferUsages::STORAGE);
            let integrals = integrals();
            (
                buffer("pieces", bytemuck::cast_slice(&pieces)),
                buffer("bins", bytemuck::cast_slice(&bins)),
                buffer("integrals", bytemuck::cast_slice(&integrals)),
                piece_texels(gpu, &pieces),
            )
        })?;
        Ok(Self {
            pieces: pieces_on,
            bins: bins_on,
            integrals,
            piece_texels,
            visible_before: bins.iter().map(|bin| bin[0]).collect(),
            piece_last: pieces.len() as u32 - 1,
            value_offset: texels.texel(lo) as f32,
            value_scale: value_scale as f32,
            per_unit: (1.0 / scene.unit_distance()) as f32,
        })
    }

    pub(crate) fn describe(&self, view: &mut CellViewUniforms) {
        view.value_offset = self.value_offset;
        view.value_scale = self.value_scale;
        view.per_unit = self.per_unit;
        view.piece_last = self.piece_last;
    }

    /// Whether anything of a span can be visible.
    pub(super) fn shows(&self, BinSpan([first, end]): BinSpan) -> bool {
        self.visible_before[usize::from(end)] > self.visible_before[usize::from(first)]
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.pieces.size() + self.bins.size() + self.integrals.size()
    }
}

/// Three texels a piece.
fn piece_texels(gpu: &Gpu, pieces: &[Piece]) -> wgpu::TextureView {
    let mut texels: Vec<[f32; 4]> = bytemuck::cast_slice(pieces).to_vec();
    let height = (texels.len() as u32).div_ceil(ROW);
    texels.resize((height * ROW) as usize, [0.0; 4]);
    let size = wgpu::Extent3d { width: ROW, height, depth_or_array_layers: 1 };
    let texture = gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some("pieces"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(16 * ROW), rows_per_image: None };
    gpu.queue().write_texture(texture.as_image_copy(), bytemuck::cast_slice(&texels), layout, size);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

impl BinMap {
    fn bin(&self, value: f64) -> f64 {
        (value - self.first) * self.scale
    }

    fn value(&self, bin: f64) -> f64 {
        if self.scale == 0.0 { self.first } else { self.first + bin / self.scale }
    }
}

/// Ascending in bins; never none. Below the first point and above the last one the function is constant.
fn pieces(function: &TransferFunction, map: BinMap) -> Vec<Piece> {
    let resampled: Vec<ControlPoint>;
    let mut points = function.points();
    if points.len() > MOST_PIECES {
        let count = 4 * BINS;
        let at = |i: u32| map.value(f64::from(i) * f64::from(BINS) / f64::from(count));
        let sample = |value: f64| {
            let (color, opacity) = function.evaluate(value);
            ControlPoint { value, color, opacity }
        };
        let mut made: Vec<ControlPoint> = (0..=count).map(|i| sample(at(i))).collect();
        made.sort_by(|a, b| a.value.total_cmp(&b.value));
        resampled = made;
        points = &resampled;
    }
    let mut pieces = Vec::new();
    if map.scale == 0.0 {
        let (color, opacity) = function.evaluate(map.first);
        let all = ControlPoint { value: map.first, color, opacity };
        add(&mut pieces, [&all, &all], [-1e30, 1e30]);
        return pieces;
    }
    let descending = map.scale < 0.0;
    let mut add_in_order = |a: &ControlPoint, b: &ControlPoint, begin: f64, end: f64| {
        if descending {
            add(&mut pieces, [b, a], [end, begin]);
        } else {
            add(&mut pieces, [a, b], [begin, end]);
        }
    };
    let (first, last) = (&points[0], &points[points.len() - 1]);
    let far = if descending { 1e30 } else { -1e30 };
    add_in_order(first, first, far, map.bin(first.value));
    for pair in points.windows(2) {
        add_in_order(&pair[0], &pair[1], map.bin(pair[0].value), map.bin(pair[1].value));
    }
    add_in_order(last, last, map.bin(last.value), -far);
    pieces.sort_by(|a, b| a.begin.total_cmp(&b.begin));
    pieces
}

/// Which piece that can be seen comes next after each, and which was the last before it.
fn note_seen(pieces: &mut [Piece]) {
    let is_seen = |piece: &Piece| piece.low[3].max(piece.low[3] + piece.rise[3]) > 0.0;
    let mut last = 0xffff;
    for (i, piece) in pieces.iter_mut().enumerate() {
        last = if is_seen(piece) { i as u32 } else { last };
        piece.seen = last << 16;
    }
    let mut next = 0xffff;
    for (i, piece) in pieces.iter_mut().enumerate().rev() {
        next = if is_seen(piece) { i as u32 } else { next };
        piece.seen |= next;
    }
}

/// Adds the piece between two points.
fn add(pieces: &mut Vec<Piece>, [low, high]: [&ControlPoint; 2], [begin, end]: [f64; 2]) {
    // What f32 cannot tell apart is a step.
    if (begin as f32) >= (end as f32) {
        return;
    }
    let color = |c: usize| (high.color[c] - low.color[c]) as f32;
    let inverse = if end - begin > 1e20 { 0.0 } else { 1.0 / (end - begin) };
    pieces.push(Piece {
        low: [low.color[0] as f32, low.color[1] as f32, low.color[2] as f32, low.opacity as f32],
        rise: [color(0), color(1), color(2), (high.opacity - low.opacity) as f32],
        begin: begin as f32,
        end: end as f32,
        inverse: inverse as f32,
        seen: 0,
    });
}

/// Of each bin and of the end: how many before it can be visible, and the first piece that reaches beyond its beginning.
fn bins(function: &TransferFunction, map: BinMap, pieces: &[Piece]) -> Vec<[u32; 2]> {
    let last = pieces.len() - 1;
    let mut count = 0;
    (0..=BINS)
        .map(|bin| {
            let before = count;
            let ends = [f64::from(bin) - 1e-3, f64::from(bin) + 1.001].map(|b| map.value(b));
            let (lo, hi) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            count += u32::from(function.max_opacity(lo, hi) > 0.0);
            let piece = pieces.partition_point(|p| p.end <= bin as f32).min(last);
            [before, piece as u32]
        })
        .collect()
}

/// The psi table, then the exponential table.
fn integrals() -> Vec<f32> {
    let density = |i: usize| {
        let gamma = i as f64 / (PSI_SIDE - 1) as f64;
        gamma / (1.0 - gamma)
    };
    let mut table = Vec::with_capacity(PSI_SIDE * PSI_SIDE + EXPONENTIALS);
    for back in 0..PSI_SIDE {
        table.extend((0..PSI_SIDE).map(|front| psi(density(front), density(back)) as f32));
    }
    table.extend((0..EXPONENTIALS).map(|i| (-(i as f64) / (EXPONENTIALS - 1) as f64).exp() as f32));
    table
}

/// The mean transmittance of a stretch whose optical density goes linearly from `a` to `b`: the integral over u from 0 to 1 of
/// exp(-(a u + (b - a) u^2 / 2)) (Moreland and Angel). By Gauss-Legendre on intervals that double from where it falls
/// fastest.
fn psi(a: f64, b: f64) -> f64 {
    if !a.is_finite() || !b.is_finite() {
        return 0.0;
    }
    const NODES: [(f64, f64); 5] = [
        (0.046_910_077_030_668, 0.118_463_442_528_095),
        (0.230_765_344_947_158, 0.239_314_335_249_683),
        (0.5, 0.284_444_444_444_444),
        (0.769_234_655_052_842, 0.239_314_335_249_683),
        (0.953_089_922_969_332, 0.118_463_442_528_095),
    ];
    let mut sum = 0.0;
    let mut begin = 0.0;
    let mut width = (0.5 / (1.0 + a + b)).min(1.0);
    while begin < 1.0 {
        let end = if begin + 1.5 * width > 1.0 { 1.0 } else { begin + width };
        for (node, weight) in NODES {
            let u = begin + (end - begin) * node;
            sum += weight * (end - begin) * (-(a * u + (b - a) * u * u / 2.0)).exp();
        }
        begin = end;
        // Where density grows, what is left falls ever faster.
        width *= 1.25;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn psi_has_its_closed_forms() {
        for a in [1e-6, 0.1, 1.0, 7.0, 60.0, 126.0] {
            // Constant density.
            assert!((psi(a, a) + f64::exp_m1(-a) / a).abs() < 1e-9, "{a}");
        }
        // From nothing to b: half a Gaussian.
        let b: f64 = 40.0;
        let gaussian = (std::f64::consts::PI / (2.0 * b)).sqrt();
        assert!((psi(0.0, b) - gaussian).abs() < 1e-7, "{}", psi(0.0, b) - gaussian);
        // Of a whole and its mirror image the transmittance at the end is the same, the mean is not.
        assert!(psi(0.0, 3.0) > psi(3.0, 0.0));
    }

    /// The error that the docs state: of the bilinear look-up, by the optical depth of the stretch.
    #[test]
    fn the_psi_table_is_off_by_at_most_what_is_stated() {
        let table = integrals();
        let look_up = |a: f64, b: f64| {
            let at = [a, b].map(|x| x / (1.0 + x) * (PSI_SIDE - 1) as f64);
            let cell = at.map(|x| (x as usize).min(PSI_SIDE - 2));
            let [f, g] = [at[0] - cell[0] as f64, at[1] - cell[1] as f64];
            let entry = |i: usize, j: usize| f64::from(table[(cell[1] + j) * PSI_SIDE + cell[0] + i]);
            let line = |j| entry(0, j) * (1.0 - f) + entry(1, j) * f;
            line(0) * (1.0 - g) + line(1) * g
        };
        let mut worst = [0.0f64; 2];
        for i in 0..200 {
            for j in 0..200 {
                let [a, b] = [i, j].map(|k| f64::from(k) / 199.5).map(|g| g / (1.0 - g));
                let worst = &mut worst[usize::from(a + b > 16.0)];
                *worst = worst.max((look_up(a, b) - psi(a, b)).abs());
            }
        }
        println!("psi table: largest errors {worst:?}");
        let stated = super::PSI_ERROR;
        assert!(worst[0] < stated[0] && worst[1] < stated[1], "{worst:?}");
    }

    #[test]
    fn pieces_are_the_function() {
        let point = |value: f64, gray: f64, opacity: f64| ControlPoint { value, color: [gray; 3], opacity };
        let points =
            vec![point(10.0, 0.0, 0.0), point(20.0, 1.0, 0.5), point(20.0, 0.3, 0.1), point(40.0, 0.7, 0.9)];
        let function = TransferFunction::new(points).expect("ordered points");
        for map in [BinMap { first: 0.0, scale: 20.0 }, BinMap { first: 51.2, scale: -20.0 }] {
            let pieces = pieces(&function, map);
            assert!(pieces.len() == 4 && pieces.windows(2).all(|w| w[0].end == w[1].begin));
            for k in 0..=1000 {
                let value = 0.03 + f64::from(k) * 0.05;
                let bin = map.bin(value) as f32;
                let piece = pieces.iter().find(|p| (p.begin..p.end).contains(&bin)).expect("no gap");
                let w = ((bin - piece.begin) * piece.inverse).clamp(0.0, 1.0);
                let opacity = f64::from(piece.low[3] + w * piece.rise[3]);
                assert!((opacity - function.evaluate(value).1).abs() < 1e-4, "{value}: {opacity}");
                let gray = f64::from(piece.low[0] + w * piece.rise[0]);
                assert!((gray - function.evaluate(value).0[0]).abs() < 1e-4);
            }
            let bins = bins(&function, map, &pieces);
            let visible = |lo: f64, hi: f64| {
                let ends = [map.bin(lo), map.bin(hi)];
                let (lo, hi) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
                bins[hi.ceil() as usize][0] > bins[lo.floor() as usize][0]
            };
            assert!(visible(9.0, 11.0) && visible(40.0, 51.0) && !visible(2.0, 9.0));
        }
    }
}
