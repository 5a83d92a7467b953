//! Which way patches face, and where their mesh is open.

use std::collections::HashMap;

use cutaway_core::glam::{DVec3, Vec3};

use super::topology::Topology;

/// Which patches belong together, and which of them to turn so that neighbours face the same way.
#[derive(Debug)]
pub(super) struct Orientation {
    /// Patches that face the other way than the first of their component.
    pub(super) turned: Vec<bool>,
    /// Number of the component that a patch belongs to.
    pub(super) component: Vec<usize>,
    pub(super) components: usize,
    /// Edges at which two patches face different ways whatever is turned: a surface with one side only.
    pub(super) misfits: usize,
}

/// Walks over the edges that join exactly two patches.
pub(super) fn of_patches(topology: &Topology) -> Orientation {
    const UNSEEN: usize = usize::MAX;
    let count = topology.patches.len();
    let mut made =
        Orientation { turned: vec![false; count], component: vec![UNSEEN; count], components: 0, misfits: 0 };
    let pairs = topology.edges.iter().filter(|edge| edge.uses.len() == 2 && !edge.collapsed()).map(|edge| {
        let [a, b] = [edge.uses[0], edge.uses[1]];
        // Neighbours that face the same way walk along a common edge in opposite directions.
        let forwards = [a, b].map(|side| side.side.with_the_walk() != side.reversed);
        (a.patch, b.patch, forwards[0] == forwards[1])
    });
    let pairs: Vec<_> = pairs.collect();
    let mut neighbours = vec![Vec::new(); count];
    for &(a, b, turn) in &pairs {
        neighbours[a].push((b, turn));
        neighbours[b].push((a, turn));
    }
    for first in 0..count {
        if made.component[first] != UNSEEN {
            continue;
        }
        let mut stack = vec![first];
        made.component[first] = made.components;
        while let Some(patch) = stack.pop() {
            for &(next, turn) in &neighbours[patch] {
                if made.component[next] == UNSEEN {
                    made.component[next] = made.components;
                    made.turned[next] = made.turned[patch] != turn;
                    stack.push(next);
                }
            }
        }
        made.components += 1;
    }
    made.misfits = pairs.iter().filter(|&&(a, b, turn)| (made.turned[a] != made.turned[b]) != turn).count();
    made
}

/// Lines between two shared vertices, how often they are used, and which way and by which component the first time.
type Lines = HashMap<[u32; 2], (u32, [u32; 2], usize)>;

/// The open ends of a mesh.
#[derive(Debug, Default)]
pub(super) struct Ends {
    /// Vertices round each hole, as its triangles run, and the component it is in.
    pub(super) loops: Vec<(Vec<u32>, usize)>,
    /// Lines that more than two triangles share.
    pub(super) non_manifold: usize,
}

impl Ends {
    /// Of the triangles of each patch. Only the first `shared` vertices lie on edges of patches; whatever touches others
    /// is inside a patch, where each line has two triangles by construction.
    pub(super) fn new<'a>(triangles: impl Iterator<Item = (&'a [u32; 3], usize)>, shared: usize) -> Self {
        let mut lines = Lines::new();
        for (corners, component) in triangles {
            for line in sides(corners).filter(|line| line.iter().all(|&v| (v as usize) < shared)) {
                let [a, b] = line;
                lines.entry([a.min(b), a.max(b)]).or_insert((0, line, component)).0 += 1;
            }
        }
        let non_manifold = lines.values().filter(|(uses, ..)| *uses > 2).count();
        let mut open: Vec<_> = lines.into_values().filter(|(uses, ..)| *uses == 1).collect();
        // A map has no order; a mesh should always come out the same.
        open.sort_unstable();
        let open: Vec<_> = open.into_iter().map(|(_, line, component)| (line, component)).collect();
        Self { loops: loops(&open), non_manifold }
    }
}

pub(super) fn sides([a, b, c]: &[u32; 3]) -> impl Iterator<Item = [u32; 2]> {
    [[*a, *b], [*b, *c], [*c, *a]].into_iter()
}

/// Chains lines to loops; what cannot be closed (a surface with one side) stays an open chain.
fn loops(open: &[([u32; 2], usize)]) -> Vec<(Vec<u32>, usize)> {
    let mut after: HashMap<(usize, u32), Vec<usize>> = HashMap::new();
    for (at, &([from, _], component)) in open.iter().enumerate().rev() {
        after.entry((component, from)).or_default().push(at);
    }
    let mut used = vec![false; open.len()];
    let mut found = Vec::new();
    for first in 0..open.len() {
        if used[first] {
            continue;
        }
        let component = open[first].1;
        let mut chain = Vec::new();
        let mut next = Some(first);
        while let Some(at) = next {
            used[at] = true;
            let [from, to] = open[at].0;
            chain.push(from);
            if to == chain[0] {
                break;
            }
            let candidates = after.get_mut(&(component, to));
            next = candidates.and_then(|list| {
                while let Some(at) = list.pop() {
                    if !used[at] {
                        return Some(at);
                    }
                }
                None
            });
        }
        found.push((chain, component));
    }
    found
}

/// A component with less volume than this, as a part of what its area could hold, is a sheet and has no outside.
const SHEET: f64 = 1e-6;

/// Which components enclose a negative volume, their loops closed by a fan from their middle.
pub(super) fn inside_out<'a>(
    vertices: &[Vec3],
    triangles: impl Iterator<Item = (&'a [u32; 3], usize)>,
    ends: &Ends,
    components: usize,
) -> Vec<bool> {
    let at = |v: u32| vertices[v as usize].as_dvec3();
    let mut sums = vec![(None, 0.0, 0.0_f64); components];
    // Measured from a vertex of the component, for precision far from the origin.
    let mut add = |component: usize, [a, b, c]: [DVec3; 3]| {
        let (origin, volume, area) = &mut sums[component];
        let origin = *origin.get_or_insert(a);
        *volume += (a - origin).dot((b - origin).cross(c - origin)) / 6.0;
        *area += (b - a).cross(c - a).length() / 2.0;
    };
    for (corners, component) in triangles {
        add(component, corners.map(at));
    }
    for (chain, component) in &ends.loops {
        let middle = chain.iter().fold(DVec3::ZERO, |sum, &v| sum + at(v)) / chain.len() as f64;
        for (k, &from) in chain.iter().enumerate() {
            add(*component, [at(chain[(k + 1) % chain.len()]), at(from), middle]);
        }
    }
    sums.into_iter().map(|(_, volume, area)| volume < -SHEET * area.powf(1.5)).collect()
}
