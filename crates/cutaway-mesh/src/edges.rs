//! Which triangles use which edges: all there is to know about whether a surface is closed.
//!
//! A surface is a sum of triangles, its boundary the sum of their directed edges (a 2-chain and its boundary). Closed
//! means that this sum is zero: every edge is used as often in one direction as in the other. Only then is the winding
//! number of a point, and with it the inside, defined.

/// One triangle's use of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct EdgeUse {
    /// The lower vertex in the upper half, the higher one in the lower half.
    edge: u64,
    /// The triangle, doubled; odd where it runs from the lower vertex to the higher one.
    tag: u64,
}

impl EdgeUse {
    /// The triangle.
    pub(crate) fn triangle(self) -> usize {
        (self.tag >> 1) as usize
    }

    /// Whether the triangle runs from the lower vertex to the higher one.
    pub(crate) fn forward(self) -> bool {
        self.tag & 1 == 1
    }

    /// The vertices in the order in which the triangle runs.
    pub(crate) fn directed(self) -> [u32; 2] {
        let (low, high) = ((self.edge >> 32) as u32, self.edge as u32);
        if self.forward() { [low, high] } else { [high, low] }
    }
}

/// All uses of all edges, sorted by edge.
pub(crate) struct Edges {
    uses: Vec<EdgeUse>,
}

impl Edges {
    /// The edges of triangles; those with a repeated corner have none (theirs cancel).
    pub(crate) fn new(triangles: &[[u32; 3]]) -> Self {
        let mut uses = Vec::with_capacity(triangles.len() * 3);
        for (triangle, &[a, b, c]) in triangles.iter().enumerate() {
            if a == b || b == c || c == a {
                continue;
            }
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let edge = u64::from(from.min(to)) << 32 | u64::from(from.max(to));
                uses.push(EdgeUse { edge, tag: (triangle as u64) << 1 | u64::from(from < to) });
            }
        }
        uses.sort_unstable();
        Self { uses }
    }

    /// The uses of one edge after the other.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &[EdgeUse]> {
        self.uses.chunk_by(|a, b| a.edge == b.edge)
    }
}

/// Whether triangles make a closed surface, as they are wound.
pub(crate) fn is_balanced(triangles: &[[u32; 3]]) -> bool {
    Edges::new(triangles).iter().all(|uses| net(uses) == 0)
}

/// Whether some edge has one triangle, three, five, ...: no winding of them can close that.
pub(crate) fn has_odd_edge(triangles: &[[u32; 3]]) -> bool {
    Edges::new(triangles).iter().any(|uses| !uses.len().is_multiple_of(2))
}

/// How much more often an edge is used forward than backward.
pub(crate) fn net(uses: &[EdgeUse]) -> i64 {
    uses.iter().map(|u| if u.forward() { 1 } else { -1 }).sum()
}
