//! Where a plane cuts a box, by a corner of the polygon (Rezk-Salama and Kolb 2005, section 4 and listing 1): the tables of
//! `intersection.wgsl`, which explains them, and a twin of it for the host, which is what they are tried on.

/// For each front corner: the corners V0 to V7 of a box whose corner `c` is at `(c & 1, c >> 1 & 1, c >> 2)`.
#[rustfmt::skip]
const SEQUENCE: [u32; 64] = [
    0, 1, 2, 4, 5, 3, 6, 7,
    1, 0, 3, 5, 4, 2, 7, 6,
    2, 3, 0, 6, 7, 1, 4, 5,
    3, 2, 1, 7, 6, 0, 5, 4,
    4, 5, 6, 0, 1, 7, 2, 3,
    5, 4, 7, 1, 0, 6, 3, 2,
    6, 7, 4, 2, 3, 5, 0, 1,
    7, 6, 5, 3, 2, 4, 1, 0,
];

/// The corners V0 to V7 for a front corner, four bits each, V0 in the lowest.
pub(super) fn sequence(front: u32) -> u32 {
    (0..8).map(|v| SEQUENCE[(front * 8 + v) as usize] << (4 * v)).sum()
}

#[cfg(test)]
mod tests {
    use cutaway_core::glam::DVec3;

    use super::super::pipelines::SHADER;
    use super::super::planes::front_corner;
    use super::*;

    /// For each corner of the polygon: where the edges begin that it may lie on, in the order in which they are tried.
#[rustfmt::skip]
const EDGE_BEGINS: [u32; 24] = [
    0, 1, 4, 4,
    1, 0, 1, 4,
    0, 2, 5, 5,
    2, 0, 2, 5,
    0, 3, 6, 6,
    3, 0, 3, 6,
];

    /// And where they end.
#[rustfmt::skip]
const EDGE_ENDS: [u32; 24] = [
    1, 4, 7, 7,
    5, 1, 4, 7,
    2, 5, 7, 7,
    6, 2, 5, 7,
    3, 6, 7, 7,
    4, 3, 6, 7,
];

    /// A box: its corner of least coordinates, and its size.
    #[derive(Clone, Copy, Debug)]
    struct Block {
        origin: DVec3,
        size: DVec3,
    }

    impl Block {
        fn corner(&self, corner: u32) -> DVec3 {
            let bits = DVec3::new((corner & 1).into(), (corner >> 1 & 1).into(), (corner >> 2).into());
            self.origin + self.size * bits
        }
    }

    /// Corner 0 to 5 of the polygon in which the plane of points `p` with `normal.dot(p) == distance` cuts a box.
    fn polygon_corner(normal: DVec3, distance: f64, block: &Block, corner: usize) -> DVec3 {
        let sequence = sequence(front_corner(normal));
        let vertex = |v: u32| block.corner(sequence >> (4 * v) & 15);
        let mut begin = DVec3::ZERO;
        for e in 0..4 {
            begin = vertex(EDGE_BEGINS[corner * 4 + e]);
            let end = vertex(EDGE_ENDS[corner * 4 + e]);
            let (near, far) = (normal.dot(begin), normal.dot(end));
            if near <= distance && distance <= far && near < far {
                return begin + (end - begin) * ((distance - near) / (far - near));
            }
        }
        begin
    }

    /// Random numbers of 0 to 1 that are the same every time.
    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }

        fn vector(&mut self, lo: f64, hi: f64) -> DVec3 {
            DVec3::new(self.next(), self.next(), self.next()) * (hi - lo) + lo
        }

        /// A box, one side of which may be a hundred times another.
        fn block(&mut self) -> Block {
            let size = self.vector(-2.0, 2.0);
            Block {
                origin: self.vector(-20.0, 20.0),
                size: DVec3::from_array(size.to_array().map(f64::exp2)) * 4.0,
            }
        }

        /// A direction; of every eight one along a face, and one along an edge.
        fn normal(&mut self) -> DVec3 {
            loop {
                let mut normal = self.vector(-1.0, 1.0);
                let zeros = match (self.next() * 8.0) as u32 {
                    0 => 1,
                    1 => 2,
                    _ => 0,
                };
                let first = (self.next() * 3.0) as usize;
                for i in 0..zeros {
                    normal[(first + i) % 3] = 0.0;
                }
                if normal.length() > 0.05 {
                    return normal.normalize();
                }
            }
        }
    }

    /// What of a convex polygon is not behind a plane: one step of Sutherland and Hodgman.
    fn clipped(polygon: &[DVec3], normal: DVec3, distance: f64) -> Vec<DVec3> {
        let mut kept = Vec::new();
        for (i, &a) in polygon.iter().enumerate() {
            let b = polygon[(i + 1) % polygon.len()];
            let (da, db) = (normal.dot(a) - distance, normal.dot(b) - distance);
            if da >= 0.0 {
                kept.push(a);
            }
            if (da >= 0.0) != (db >= 0.0) {
                kept.push(a + (b - a) * (da / (da - db)));
            }
        }
        kept
    }

    /// The polygon by clipping a square that is larger than everything.
    fn by_clipping(normal: DVec3, distance: f64, block: &Block) -> Vec<DVec3> {
        let (u, v) = normal.any_orthonormal_pair();
        let middle = block.origin + block.size * 0.5;
        let middle = middle + normal * (distance - normal.dot(middle));
        let mut polygon: Vec<DVec3> = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(a, b)| middle + (u * a + v * b) * 200.0)
            .to_vec();
        for axis in DVec3::AXES {
            polygon = clipped(&polygon, axis, axis.dot(block.origin));
            polygon = clipped(&polygon, -axis, -axis.dot(block.origin + block.size));
        }
        polygon
    }

    /// Twice the area, as seen along the normal: negative where corners go round the other way.
    fn doubled_area(polygon: &[DVec3], normal: DVec3) -> f64 {
        let corner = polygon.first().copied().unwrap_or_default();
        polygon.windows(2).map(|w| (w[0] - corner).cross(w[1] - corner).dot(normal)).sum()
    }

    /// The greatest distance of a corner of one polygon from the border of another.
    fn apart(from: &[DVec3], to: &[DVec3]) -> f64 {
        let from_edge = |p: DVec3, a: DVec3, b: DVec3| {
            let along = (b - a).length_squared();
            let share = if along > 0.0 { ((p - a).dot(b - a) / along).clamp(0.0, 1.0) } else { 0.0 };
            p.distance(a + (b - a) * share)
        };
        let from_border = |p: &DVec3| {
            (0..to.len()).map(|i| from_edge(*p, to[i], to[(i + 1) % to.len()])).fold(f64::INFINITY, f64::min)
        };
        from.iter().map(from_border).fold(0.0, f64::max)
    }

    #[test]
    fn polygons_are_what_clipping_makes() {
        let mut random = Random(20_050_901);
        let (mut triangles_to_hexagons, mut coplanar) = ([0u32; 7], 0);
        for case in 0..100_000 {
            let (block, normal) = (random.block(), random.normal());
            let distances: [f64; 8] = std::array::from_fn(|c| normal.dot(block.corner(c as u32)));
            let (lo, hi) =
                distances.iter().fold((f64::MAX, f64::MIN), |(lo, hi), d| (lo.min(*d), hi.max(*d)));
            // Of every eight one goes through a corner, and with it through the edge or face that is along the plane.
            let through_corner = case % 8 == 0;
            let distance =
                if through_corner { distances[case / 8 % 8] } else { lo + random.next() * (hi - lo) };
            let found: Vec<DVec3> = (0..6).map(|c| polygon_corner(normal, distance, &block, c)).collect();
            let size = block.size.length();
            let what = format!("case {case}: {block:?} cut by {normal:?} at {distance}: {found:?}");
            for p in &found {
                assert!((normal.dot(*p) - distance).abs() < 1e-9 * size, "{what}");
                let outside = (block.origin - *p).max(*p - block.origin - block.size).max_element();
                assert!(outside < 1e-9 * size, "{what}");
            }
            let expected = by_clipping(normal, distance, &block);
            let (area, expected_area) = (doubled_area(&found, normal), doubled_area(&expected, normal));
            if through_corner && (distance - lo < 1e-9 * size || hi - distance < 1e-9 * size) {
                // The plane only touches the box: in a corner, an edge or a face, which clipping may or may not keep.
                coplanar += u32::from(area.abs() > 1e-6 * size * size);
                continue;
            }
            assert!((area.abs() - expected_area.abs()).abs() < 1e-5 * size * size, "{what}: {expected:?}");
            assert!(
                apart(&found, &expected).max(apart(&expected, &found)) < 1e-7 * size,
                "{what}: {expected:?}"
            );
            let mut distinct: Vec<DVec3> = Vec::new();
            for p in &found {
                if distinct.iter().all(|q| q.distance(*p) > 1e-9 * size) {
                    distinct.push(*p);
                }
            }
            if area.abs() > 1e-9 * size * size {
                assert!((3..=6).contains(&distinct.len()), "{what}");
                triangles_to_hexagons[distinct.len()] += 1;
            }
            // Convex, and in order: every turn goes the same way.
            for i in 0..distinct.len() {
                let [a, b, c] = [0, 1, 2].map(|k| distinct[(i + k) % distinct.len()]);
                let turn = (b - a).cross(c - b).dot(normal) * area.signum();
                assert!(turn > -1e-9 * size * size, "{what}");
            }
        }
        assert!(triangles_to_hexagons[3..].iter().all(|n| *n > 1000), "{triangles_to_hexagons:?}");
        assert!(coplanar > 100, "{coplanar}");
    }

    #[test]
    fn the_shader_has_the_same_edges() {
        let text = SHADER.linked.split_once("EDGES").expect("the table").1;
        let (_, words) = text.split_once('(').expect("an array");
        let (words, _) = words.split_once(')').expect("its end");
        let words = words.split(',').map(|word| word.trim().trim_end_matches('u')).filter(|w| !w.is_empty());
        let parsed = words.map(|word| match word.strip_prefix("0x") {
            Some(digits) => u32::from_str_radix(digits, 16),
            None => word.parse(),
        });
        let expected: Vec<u32> = (0..6)
            .map(|corner| {
                let ends = |e: usize| EDGE_BEGINS[corner * 4 + e] | EDGE_ENDS[corner * 4 + e] << 4;
                (0..4).map(|e| ends(e) << (8 * e)).sum()
            })
            .collect();
        assert_eq!(parsed.collect::<Result<Vec<u32>, _>>(), Ok(expected));
    }
}
