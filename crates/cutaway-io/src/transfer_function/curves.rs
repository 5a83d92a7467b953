//! VTK's curves between points as straight lines.
//!
//! A point of VTK's functions has a midpoint and a sharpness, which shape the curve from it to the next: `midpoint` (0..=1) is
//! where on the way the mean is reached; `sharpness` is 0 for straight lines, 1 for a step at the midpoint, and in between a
//! Hermite curve of compressed time (vtkPiecewiseFunction, vtkColorTransferFunction). Straight lines and steps are taken over
//! exactly; whatever bends, and colours mixed in another space than RGB, is sampled until it is off by less than
//! [`TOLERANCE`].

use super::spaces::ColorSpace;

/// How far sampled curves may be off: half of what 8 bits can show. A quarter of it is left for what lies between the places
/// that are looked at.
const TOLERANCE: f64 = 0.5 / 255.0;

/// How often a stretch is halved at most; 4096 pieces are finer than any display.
const DEEPEST: u32 = 12;

/// A point of one of VTK's functions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Node<const N: usize> {
    /// The value.
    pub(super) x: f64,
    /// Opacity, or red, green and blue; 0..=1.
    pub(super) y: [f64; N],
    /// Where the mean is reached on the way to the next point, 0..=1.
    pub(super) midpoint: f64,
    /// From straight (0) to a step (1).
    pub(super) sharpness: f64,
}

impl<const N: usize> Node<N> {
    /// A point with straight lines on both sides.
    pub(super) fn straight(x: f64, y: [f64; N]) -> Self {
        Self { x, y, midpoint: 0.5, sharpness: 0.0 }
    }
}

/// Points with straight lines between them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Polyline<const N: usize> {
    pub(super) points: Vec<(f64, [f64; N])>,
    /// Whether any of them was not in the file.
    pub(super) sampled: bool,
}

/// Opacities as straight lines; none where there would be more than `most` points.
pub(super) fn opacities(nodes: Vec<Node<1>>, most: usize) -> Option<Polyline<1>> {
    straightened(nodes, most, false, |a, b, _, w| [a[0] + (b[0] - a[0]) * w])
}

/// Colours as straight lines; none where there would be more than `most` points.
pub(super) fn colors(nodes: Vec<Node<3>>, space: ColorSpace, most: usize) -> Option<Polyline<3>> {
    if space == ColorSpace::Step {
        return stepped(nodes, most);
    }
    // VTK leaves the Hermite curve out where it diverges.
    let share = |s, w| if space == ColorSpace::Diverging { s } else { w };
    straightened(nodes, most, space != ColorSpace::Rgb, |a, b, s, w| space.mix(a, b, share(s, w)))
}

/// Points by value. Those that are one step of a float apart are a step, which VTK cannot hold: it is how Slicer and we write
/// one.
fn ordered<const N: usize>(mut nodes: Vec<Node<N>>) -> Vec<Node<N>> {
    nodes.sort_by(|a, b| a.x.total_cmp(&b.x));
    let mut last = None;
    for node in &mut nodes {
        let own = node.x;
        if let Some((read, taken)) = last
            && f64::next_up(read) == own
        {
            node.x = taken;
        }
        last = Some((own, node.x));
    }
    nodes
}

fn stepped(nodes: Vec<Node<3>>, most: usize) -> Option<Polyline<3>> {
    let nodes = ordered(nodes);
    let mut points = Vec::with_capacity(nodes.len());
    for (index, node) in nodes.iter().enumerate() {
        points.push((node.x, node.y));
        if let Some(next) = nodes.get(index + 1).filter(|next| next.x > node.x) {
            points.push((node.x, next.y));
        }
    }
    (points.len() <= most).then_some(Polyline { points, sampled: false })
}

fn straightened<const N: usize>(
    nodes: Vec<Node<N>>,
    most: usize,
    curved: bool,
    mix: impl Fn(&[f64; N], &[f64; N], f64, f64) -> [f64; N],
) -> Option<Polyline<N>> {
    let nodes = ordered(nodes);
    let mut line = Polyline { points: Vec::with_capacity(nodes.len()), sampled: false };
    for pair in nodes.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        line.points.push((a.x, a.y));
        if a.x < b.x && a.y != b.y {
            between(a, b, curved, &mix, most, &mut line);
        }
        if line.points.len() > most {
            return None;
        }
    }
    line.points.extend(nodes.last().map(|last| (last.x, last.y)));
    (line.points.len() <= most).then_some(line)
}

/// The points between two, without either.
fn between<const N: usize>(
    a: &Node<N>,
    b: &Node<N>,
    curved: bool,
    mix: &impl Fn(&[f64; N], &[f64; N], f64, f64) -> [f64; N],
    most: usize,
    line: &mut Polyline<N>,
) {
    // As far from the ends as VTK keeps it.
    let middle = a.midpoint.clamp(1e-5, 1.0 - 1e-5);
    // Weighing both ends cannot overflow.
    let x = |t: f64| (a.x * (1.0 - t) + b.x * t).clamp(a.x, b.x);
    if a.sharpness > 0.99 {
        line.points.extend([(x(middle), a.y), (x(middle), b.y)]);
        line.sampled = true;
        return;
    }
    let at = |t: f64| {
        let s = if t < middle { 0.5 * t / middle } else { 0.5 + 0.5 * (t - middle) / (1.0 - middle) };
        let (s, w) = sharpened(s, a.sharpness);
        mix(&a.y, &b.y, s, w)
    };
    if !curved && a.sharpness < 0.01 {
        if a.midpoint != 0.5 {
            line.points.push((x(middle), at(middle)));
            line.sampled = true;
        }
        return;
    }
    line.sampled = true;
    let mut place = |t: f64, y: [f64; N]| {
        line.points.push((x(t), y));
        line.points.len() <= most
    };
    let (first, last) = ((0.0, a.y), (1.0, b.y));
    // The midpoint is a corner, and where diverging colours are whitest.
    let corner = (middle, at(middle));
    let _ = halved(&at, first, corner, DEEPEST, &mut place)
        && place(corner.0, corner.1)
        && halved(&at, corner, last, DEEPEST, &mut place);
}

/// The share of the way and of the rise, of a share of the way that has its mean at a half.
fn sharpened(s: f64, sharpness: f64) -> (f64, f64) {
    if sharpness < 0.01 {
        return (s, s);
    }
    let power = 1.0 + 10.0 * sharpness;
    let s = if s < 0.5 { 0.5 * (2.0 * s).powf(power) } else { 1.0 - 0.5 * (2.0 - 2.0 * s).powf(power) };
    let (ss, sss) = (s * s, s * s * s);
    let rise = 3.0 * ss - 2.0 * sss;
    let slopes = 2.0 * sss - 3.0 * ss + s;
    (s, (rise + (1.0 - sharpness) * slopes).clamp(0.0, 1.0))
}

/// Places points between two until lines between them are near enough; whether there was room for all.
fn halved<const N: usize>(
    at: &impl Fn(f64) -> [f64; N],
    first: (f64, [f64; N]),
    last: (f64, [f64; N]),
    depth: u32,
    place: &mut impl FnMut(f64, [f64; N]) -> bool,
) -> bool {
    const LOOKS: u32 = 8;
    let straight_enough = (1..LOOKS).all(|i| {
        let w = f64::from(i) / f64::from(LOOKS);
        let found = at(first.0 + (last.0 - first.0) * w);
        (0..N).all(|c| {
            let expected = first.1[c] + (last.1[c] - first.1[c]) * w;
            (found[c] - expected).abs() <= 0.75 * TOLERANCE
        })
    });
    if straight_enough || depth == 0 {
        return true;
    }
    let t = 0.5 * (first.0 + last.0);
    let middle = (t, at(t));
    halved(at, first, middle, depth - 1, place)
        && place(middle.0, middle.1)
        && halved(at, middle, last, depth - 1, place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn evaluate<const N: usize>(line: &Polyline<N>, x: f64) -> [f64; N] {
        let upper = line.points.partition_point(|p| p.0 <= x).clamp(1, line.points.len() - 1);
        let (a, b) = (line.points[upper - 1], line.points[upper]);
        let w = if b.0 > a.0 { ((x - a.0) / (b.0 - a.0)).clamp(0.0, 1.0) } else { 1.0 };
        std::array::from_fn(|c| a.1[c] + (b.1[c] - a.1[c]) * w)
    }

    fn opacity_curve(midpoint: f64, sharpness: f64) -> Polyline<1> {
        let first = Node { x: 0.0, y: [0.0], midpoint, sharpness };
        opacities(vec![first, Node::straight(1.0, [1.0])], 100_000).unwrap()
    }

    /// Values of VTK's GetTable for the same points.
    #[test]
    fn curves_are_those_of_vtk() {
        for (midpoint, sharpness, expected) in GOLDEN_OPACITIES {
            let line = opacity_curve(midpoint, sharpness);
            for (i, expected) in expected.iter().enumerate() {
                let found = evaluate(&line, 0.1 * (i + 1) as f64)[0];
                assert!(
                    (found - expected).abs() < 1.0 / 255.0,
                    "{midpoint} {sharpness} {i}: {found}, expected {expected}"
                );
            }
        }
    }

    #[test]
    fn colours_in_other_spaces_are_those_of_vtk() {
        for (space, a, b, expected) in GOLDEN_COLORS {
            let line = colors(vec![Node::straight(0.0, a), Node::straight(1.0, b)], space, 100_000).unwrap();
            for (i, expected) in expected.iter().enumerate() {
                let found = evaluate(&line, 0.125 * (i + 1) as f64);
                let off = (0..3).map(|c| (found[c] - expected[c]).abs()).fold(0.0, f64::max);
                assert!(off < 1.0 / 255.0, "{space:?} {i}: {found:?}, expected {expected:?}");
            }
        }
    }

    #[test]
    fn straight_lines_stay_and_steps_are_steps() {
        let nodes = vec![Node::straight(3.0, [0.5]), Node::straight(1.0, [0.25])];
        let line = opacities(nodes, 10).unwrap();
        assert_eq!(line, Polyline { points: vec![(1.0, [0.25]), (3.0, [0.5])], sampled: false });
        let line = opacity_curve(0.25, 1.0);
        assert_eq!(line.points, [(0.0, [0.0]), (0.25, [0.0]), (0.25, [1.0]), (1.0, [1.0])]);
        let line = opacity_curve(0.25, 0.0);
        assert_eq!(line.points, [(0.0, [0.0]), (0.25, [0.5]), (1.0, [1.0])]);
        // One step of a float apart is one value.
        let nodes = [2.0, f64::next_up(2.0), f64::next_up(f64::next_up(2.0)), 3.0];
        let nodes = nodes.iter().enumerate().map(|(i, x)| Node::straight(*x, [0.1 * i as f64])).collect();
        let values: Vec<f64> = opacities(nodes, 10).unwrap().points.iter().map(|p| p.0).collect();
        assert_eq!(values, [2.0, 2.0, 2.0, 3.0]);
        let nodes = vec![Node::straight(0.0, [0.0; 3]), Node::straight(1.0, [1.0; 3])];
        let line = colors(nodes, ColorSpace::Step, 10).unwrap();
        assert_eq!(line.points, [(0.0, [0.0; 3]), (0.0, [1.0; 3]), (1.0, [1.0; 3])]);
    }

    #[test]
    fn too_many_points_are_none() {
        let nodes = vec![Node::straight(0.0, [1.0, 0.0, 0.0]), Node::straight(1.0, [0.0, 0.0, 1.0])];
        assert!(colors(nodes.clone(), ColorSpace::Lab, 5).is_none());
        assert!(colors(nodes.clone(), ColorSpace::Lab, 500).is_some());
        assert!(colors(nodes, ColorSpace::Rgb, 1).is_none());
    }

    proptest! {
        #[test]
        fn sampled_colours_are_off_by_less_than_a_255th(
            a in [0.0..=1.0, 0.0..=1.0, 0.0..=1.0],
            b in [0.0..=1.0, 0.0..=1.0, 0.0..=1.0],
            s in 0.0..=1.0,
        ) {
            for space in [ColorSpace::Hsv { wrap: true }, ColorSpace::Lab, ColorSpace::Diverging] {
                let line =
                    colors(vec![Node::straight(0.0, a), Node::straight(1.0, b)], space, 100_000).unwrap();
                prop_assert!(line.points.len() < 300, "{}", line.points.len());
                let (found, expected) = (evaluate(&line, s), space.mix(&a, &b, s));
                let off = (0..3).map(|c| (found[c] - expected[c]).abs()).fold(0.0, f64::max);
                prop_assert!(off < 1.0 / 255.0, "{space:?}: {found:?}, expected {expected:?}");
            }
        }
    }

    type OpacityGolden = (f64, f64, [f64; 9]);
    /// Midpoint, sharpness and the values at 0.1, 0.2 to 0.9, of vtkPiecewiseFunction (VTK 9.7.2).
    const GOLDEN_OPACITIES: [OpacityGolden; 6] = [
        (0.5, 0.0, [0.1000, 0.2000, 0.3000, 0.4000, 0.5000, 0.6000, 0.7000, 0.8000, 0.9000]),
        (0.3, 0.0, [0.1667, 0.3333, 0.5000, 0.5714, 0.6429, 0.7143, 0.7857, 0.8571, 0.9286]),
        (0.5, 0.5, [0.0000, 0.0010, 0.0125, 0.0891, 0.5000, 0.9109, 0.9875, 0.9990, 1.0000]),
        (0.25, 0.2, [0.0262, 0.2374, 0.6025, 0.7626, 0.8696, 0.9360, 0.9738, 0.9924, 0.9991]),
        (0.7, 0.9, [0.0000, 0.0000, 0.0000, 0.0002, 0.0025, 0.0394, 0.5000, 0.9989, 1.0000]),
        (0.5, 0.05, [0.0428, 0.1224, 0.2276, 0.3545, 0.5000, 0.6455, 0.7724, 0.8776, 0.9572]),
    ];

    type ColorGolden = (ColorSpace, [f64; 3], [f64; 3], [[f64; 3]; 7]);
    /// A space, two colours, and those an eighth of the way apart between them, of vtkColorTransferFunction.
    const GOLDEN_COLORS: [ColorGolden; 8] = [
        (
            ColorSpace::Lab,
            [1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0],
            [
                [0.9572, 0.0000, 0.1920],
                [0.9097, 0.0000, 0.3118],
                [0.8551, 0.0000, 0.4238],
                [0.7903, 0.0000, 0.5352],
                [0.7102, 0.0000, 0.6480],
                [0.6052, 0.0000, 0.7629],
                [0.4507, 0.0000, 0.8803],
            ],
        ),
        (
            ColorSpace::Lab,
            [0.2, 0.7, 0.1],
            [0.9, 0.9, 0.3],
            [
                [0.3248, 0.7267, 0.1279],
                [0.4229, 0.7529, 0.1542],
                [0.5104, 0.7786, 0.1794],
                [0.5926, 0.8038, 0.2040],
                [0.6716, 0.8286, 0.2283],
                [0.7488, 0.8529, 0.2523],
                [0.8247, 0.8767, 0.2762],
            ],
        ),
        (
            ColorSpace::Diverging,
            [0.23, 0.299, 0.754],
            [0.706, 0.016, 0.15],
            [
                [0.3833, 0.5096, 0.9176],
                [0.5532, 0.6890, 0.9954],
                [0.7223, 0.8140, 0.9766],
                [0.8654, 0.8654, 0.8654],
                [0.9590, 0.7699, 0.6782],
                [0.9583, 0.6030, 0.4819],
                [0.8695, 0.3785, 0.3003],
            ],
        ),
        (
            ColorSpace::Diverging,
            [0.1, 0.5, 0.2],
            [0.6, 0.6, 0.6],
            [
                [0.2277, 0.5451, 0.2753],
                [0.3181, 0.5812, 0.3442],
                [0.3927, 0.6079, 0.4067],
                [0.4554, 0.6250, 0.4620],
                [0.5073, 0.6325, 0.5095],
                [0.5486, 0.6306, 0.5486],
                [0.5795, 0.6196, 0.5788],
            ],
        ),
        (
            ColorSpace::Diverging,
            [0.8, 0.8, 0.8],
            [0.4, 0.1, 0.5],
            [
                [0.8601, 0.7443, 0.7730],
                [0.8829, 0.6714, 0.7454],
                [0.8708, 0.5852, 0.7163],
                [0.8261, 0.4900, 0.6844],
                [0.7524, 0.3902, 0.6481],
                [0.6537, 0.2898, 0.6060],
                [0.5348, 0.1923, 0.5568],
            ],
        ),
        (
            ColorSpace::Hsv { wrap: false },
            [1.0, 0.0, 0.2],
            [0.0, 0.3, 1.0],
            [
                [1.0000, 0.0000, 0.4625],
                [1.0000, 0.0000, 0.7250],
                [1.0000, 0.0000, 0.9875],
                [0.7500, 0.0000, 1.0000],
                [0.4875, 0.0000, 1.0000],
                [0.2250, 0.0000, 1.0000],
                [0.0000, 0.0375, 1.0000],
            ],
        ),
        (
            ColorSpace::Hsv { wrap: true },
            [1.0, 0.0, 0.2],
            [0.0, 0.3, 1.0],
            [
                [1.0000, 0.0000, 0.4625],
                [1.0000, 0.0000, 0.7250],
                [1.0000, 0.0000, 0.9875],
                [0.7500, 0.0000, 1.0000],
                [0.4875, 0.0000, 1.0000],
                [0.2250, 0.0000, 1.0000],
                [0.0000, 0.0375, 1.0000],
            ],
        ),
        (
            ColorSpace::Hsv { wrap: true },
            [0.5, 0.1, 0.2],
            [0.3, 0.9, 0.4],
            [
                [0.5500, 0.1416, 0.1192],
                [0.6000, 0.3029, 0.1400],
                [0.6500, 0.4824, 0.1625],
                [0.7000, 0.6786, 0.1867],
                [0.6100, 0.7500, 0.2125],
                [0.4850, 0.8000, 0.2400],
                [0.3478, 0.8500, 0.2692],
            ],
        ),
    ];
}
