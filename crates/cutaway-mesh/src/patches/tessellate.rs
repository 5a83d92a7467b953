//! From patches to a triangle mesh.
//!
//! Vertices have names, not just positions: a corner is a control point, a vertex on an edge is a cut of that edge. So
//! patches that meet share them, and the mesh is as connected as the patches are. The order is: weld control points and
//! find edges (`topology`), cut edges (`refine`), number shared vertices, cut each patch into cells (`refine`) and those
//! into triangles (`triangulate`), turn patches that face the wrong way (`orientation`), add up normals.

use std::collections::{HashMap, HashSet};

use cutaway_core::glam::{DVec3, Vec3};

use super::orientation::{self, Ends, Orientation};
use super::refine::{self, Boundary, Cells, Place, Quad, Refiner, UNIT};
use super::tessellation::MAX_SEGMENTS;
use super::topology::{Side, Topology};
use super::triangulate::{Corner, Corners, Cut, cut};
use super::{BezierPatch, Method, PatchSet, Tessellated, Tessellation, TessellationError};
use crate::TriangleMesh;
use crate::mesh::origin_of;

/// What single precision and the welding of control points move a vertex by, at most, as a part of the largest
/// coordinate: half a unit in the last place of each coordinate, and again half a unit.
const ROUNDING: f64 = 2.75 / (1 << 24) as f64;

/// The same for coordinates so small that single precision spaces them evenly: twice their distance.
const SMALLEST: f64 = 3e-45;

/// The finest tolerance, in units of that.
const FINEST: f64 = 4.0;

impl PatchSet {
    /// A tolerance for those who have no wish of their own: a thousandth of the diagonal of the bounding box.
    pub fn suggested_tolerance(&self) -> f64 {
        let [low, high] = self.bounds();
        1e-3 * (high - low).length()
    }

    /// Triangles of the patches. Patches with a common boundary curve (the same control points, in either direction)
    /// share its vertices; corners and edges of meshes come from control points, so nothing is welded afterwards.
    pub fn tessellate(&self, settings: &Tessellation) -> Result<Tessellated, TessellationError> {
        let [low, high] = self.bounds();
        let origin = origin_of(low, high);
        if origin == DVec3::ZERO {
            return self.tessellate_here(settings);
        }
        let mut made = self.moved(-origin).tessellate_here(settings)?;
        made.mesh = made.mesh.moved(origin);
        Ok(made)
    }

    /// As [`PatchSet::tessellate`], with vertices rounded where they are.
    fn tessellate_here(&self, settings: &Tessellation) -> Result<Tessellated, TessellationError> {
        let [low, high] = self.bounds();
        let largest = low.abs().max(high.abs()).max_element();
        let rounding = ROUNDING * largest + SMALLEST;
        let mut plan = Plan { settings: *settings, unit: UNIT, step: UNIT, tolerance: 0.0 };
        match settings.method {
            Method::Uniform { segments } => plan.check_uniform(segments, self.patches().len())?,
            Method::Adaptive { tolerance } => {
                plan.check_adaptive(tolerance, rounding, largest, self.patches())?
            }
        }
        let topology = Topology::new(self, largest);
        let orientation = orientation::of_patches(&topology);
        let cuts = plan.cut_edges(&topology)?;
        let mut builder = Builder::new(&topology, &cuts, &plan);
        let mut strict = vec![false; self.patches().len()];
        builder.all_patches(&strict)?;
        if builder.find_collisions(&mut strict) {
            builder.forget_patches();
            builder.all_patches(&strict)?;
        }
        builder.finish(orientation, rounding)
    }
}

/// What was asked for.
struct Plan {
    settings: Tessellation,
    /// Denominator of parameters.
    unit: u32,
    /// Width of a uniform cell in those; `unit` itself in adaptive tessellation.
    step: u32,
    /// Of adaptive tessellation, less what rounding takes; 0 in uniform.
    tolerance: f64,
}

impl Plan {
    fn check_uniform(&mut self, segments: u32, patches: usize) -> Result<(), TessellationError> {
        if !(1..=MAX_SEGMENTS).contains(&segments) {
            return Err(TessellationError::Segments { found: segments });
        }
        let about = 2 * u64::from(segments).pow(2) * patches as u64;
        if about > self.settings.max_triangles {
            return Err(self.too_many(about as f64));
        }
        // Even, so that a cell has a middle.
        (self.unit, self.step) = (2 * segments, 2);
        Ok(())
    }

    fn check_adaptive(
        &mut self,
        tolerance: f64,
        rounding: f64,
        largest: f64,
        patches: &[BezierPatch],
    ) -> Result<(), TessellationError> {
        if !(tolerance.is_finite() && tolerance > 0.0) {
            return Err(TessellationError::Tolerance { found: tolerance });
        }
        let finest = FINEST * rounding;
        if tolerance < finest {
            return Err(TessellationError::TooFine { found: tolerance, largest, finest });
        }
        self.tolerance = tolerance - rounding;
        let halvings = if patches.len() < 1000 { 6 } else { 2 };
        let cells = |patch| refine::estimated_cells(patch, self.tolerance, halvings);
        let about = 2.0 * patches.iter().map(cells).sum::<f64>();
        // The estimate may be off by a factor; whoever is near the limit is counted exactly.
        if about > 4.0 * self.settings.max_triangles as f64 {
            return Err(self.too_many(about));
        }
        Ok(())
    }

    fn too_many(&self, about: f64) -> TessellationError {
        let limit = self.settings.max_triangles;
        let hint = match self.settings.method {
            Method::Uniform { .. } => "take fewer segments or raise the limit",
            Method::Adaptive { .. } => "give a larger tolerance or raise the limit",
        };
        TessellationError::TooMany { about: (about as u64).max(limit.saturating_add(1)), limit, hint }
    }

    fn uniform(&self) -> bool {
        matches!(self.settings.method, Method::Uniform { .. })
    }

    /// A whole number of units as a parameter.
    fn parameter(&self, k: u32) -> f64 {
        f64::from(k) / f64::from(self.unit)
    }

    /// For each edge the parameters of its vertices.
    fn cut_edges(&self, topology: &Topology) -> Result<Vec<Vec<u32>>, TessellationError> {
        if self.uniform() {
            let even = || (0..=self.unit).step_by(self.step as usize).collect();
            let pole = || vec![0, self.unit];
            return Ok(topology.edges.iter().map(|e| if e.collapsed() { pole() } else { even() }).collect());
        }
        let mut left = self.settings.max_triangles;
        let mut cuts = Vec::with_capacity(topology.edges.len());
        for edge in &topology.edges {
            // Each piece has a triangle at least.
            let made = refine::cut_edge(edge, self.tolerance, left);
            let made = made.ok_or_else(|| self.too_many(self.settings.max_triangles as f64 * 2.0))?;
            left -= (made.len() as u64 - 1).min(left);
            cuts.push(made);
        }
        part_twins(topology, &mut cuts);
        Ok(cuts)
    }
}

/// Halves edges that would be one line with another edge: different curves between the same two points, with a
/// tolerance larger than what is between them.
fn part_twins(topology: &Topology, cuts: &mut [Vec<u32>]) {
    let mut lines: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
    for (number, edge) in topology.edges.iter().enumerate() {
        if cuts[number].len() == 2 && !edge.collapsed() {
            let ends = [edge.points[0], edge.points[edge.points.len() - 1]];
            lines.entry([ends[0].min(ends[1]), ends[0].max(ends[1])]).or_default().push(number);
        }
    }
    for number in lines.into_values().filter(|twins| twins.len() > 1).flatten() {
        cuts[number].insert(1, UNIT / 2);
    }
}

/// The mesh as it grows.
struct Builder<'a> {
    topology: &'a Topology,
    cuts: &'a [Vec<u32>],
    plan: &'a Plan,
    /// For each edge the vertices at its cuts.
    on_edges: Vec<Vec<u32>>,
    vertices: Vec<Vec3>,
    /// How many of the vertices lie on edges; they come first.
    shared: usize,
    triangles: Vec<[u32; 3]>,
    /// A vertex and the unit normal that a patch has there.
    normals: Vec<(u32, Vec3)>,
    /// For each patch where its triangles and its normals end.
    ends: Vec<[usize; 2]>,
    deviation: f64,
}

impl<'a> Builder<'a> {
    fn new(topology: &'a Topology, cuts: &'a [Vec<u32>], plan: &'a Plan) -> Self {
        let mut made = Self {
            topology,
            cuts,
            plan,
            on_edges: Vec::with_capacity(topology.edges.len()),
            vertices: Vec::new(),
            shared: 0,
            triangles: Vec::new(),
            normals: Vec::new(),
            ends: Vec::with_capacity(topology.patches.len()),
            deviation: 0.0,
        };
        let mut corners = HashMap::new();
        for (edge, cuts) in topology.edges.iter().zip(cuts) {
            let mut corner = |point: u32| {
                let vertices = &mut made.vertices;
                *corners.entry(point).or_insert_with(|| {
                    vertices.push(topology.points[point as usize].as_vec3());
                    vertices.len() as u32 - 1
                })
            };
            let [first, last] = [edge.points[0], edge.points[edge.points.len() - 1]].map(&mut corner);
            let mut on_edge = vec![first];
            for &cut in &cuts[1..cuts.len() - 1] {
                on_edge.push(made.vertices.len() as u32);
                made.vertices.push(edge.curve.at(plan.parameter(cut), 0.0).position.as_vec3());
            }
            on_edge.push(last);
            made.on_edges.push(on_edge);
        }
        made.shared = made.vertices.len();
        made
    }

    fn all_patches(&mut self, strict: &[bool]) -> Result<(), TessellationError> {
        (0..strict.len()).try_for_each(|number| self.patch(number, strict[number]))
    }

    fn forget_patches(&mut self) {
        self.vertices.truncate(self.shared);
        self.triangles.clear();
        self.normals.clear();
        self.ends.clear();
        self.deviation = 0.0;
    }

    fn patch(&mut self, number: usize, strict: bool) -> Result<(), TessellationError> {
        let patch = &self.topology.patches[number];
        if patch.is_point() {
            self.ends.push([self.triangles.len(), self.normals.len()]);
            return Ok(());
        }
        let boundary = self.topology.sides[number]
            .map(|side| Boundary::new(self.topology, side, self.cuts, self.plan.unit));
        let cells = self.cells(patch, &boundary, strict)?;
        self.deviation = self.deviation.max(cells.deviation);
        let corners = self.corners(number, &boundary, &cells.quads);
        for quad in &cells.quads {
            let polygon = corners.polygon(quad);
            match cut(&polygon, strict) {
                Cut::Triangles(made) => made.into_iter().for_each(|corners| self.triangle(corners)),
                Cut::Fan(middle) => {
                    let (middle, _) = self.inside(patch, middle);
                    for (k, corner) in polygon.iter().enumerate() {
                        self.triangle([corner.vertex, polygon[(k + 1) % polygon.len()].vertex, middle]);
                    }
                }
            }
        }
        if self.triangles.len() as u64 > self.plan.settings.max_triangles {
            return Err(self.plan.too_many(self.triangles.len() as f64));
        }
        self.ends.push([self.triangles.len(), self.normals.len()]);
        Ok(())
    }

    fn cells(
        &self,
        patch: &BezierPatch,
        boundary: &[Boundary<'_>; 4],
        strict: bool,
    ) -> Result<Cells, TessellationError> {
        let plan = self.plan;
        if plan.uniform() {
            let step = plan.step;
            let along = || (0..plan.unit).step_by(step as usize);
            let quad = |u, v| [(u, v), (u + step, v), (u + step, v + step), (u, v + step)];
            let quads = along().flat_map(|u| along().map(move |v| quad(u, v))).collect();
            let segments = f64::from(plan.unit / step);
            return Ok(Cells { quads, deviation: patch.flatness() / (segments * segments) });
        }
        // Every cell makes one triangle at least.
        let most = plan.settings.max_triangles.saturating_sub(self.triangles.len() as u64);
        let refiner =
            Refiner { boundary: *boundary, tolerance: plan.tolerance, at_least_halved: strict, most };
        refiner.cells(patch).ok_or_else(|| plan.too_many(plan.settings.max_triangles as f64 * 2.0))
    }

    /// All vertices of a patch: those that its cells ask for and those of its edges.
    fn corners(&mut self, number: usize, boundary: &[Boundary<'_>; 4], quads: &[Quad]) -> Corners {
        let unit = self.plan.unit;
        let mut places: Vec<Place> = quads.iter().flatten().copied().collect();
        for (side, edge) in Side::ALL.into_iter().zip(boundary) {
            places.extend(edge.parameters().map(|at| match side {
                Side::ULow => (0, at),
                Side::UHigh => (unit, at),
                Side::VLow => (at, 0),
                Side::VHigh => (at, unit),
            }));
        }
        places.sort_unstable();
        places.dedup();
        let patch = &self.topology.patches[number];
        let corner = |place: Place| {
            if let Some(vertex) = self.on_boundary(number, boundary, place) {
                let position = self.vertices[vertex as usize].as_dvec3();
                self.normal(patch, vertex, place, None);
                return Corner { place, vertex, shared: true, position };
            }
            let (vertex, position) = self.inside(patch, place);
            Corner { place, vertex, shared: false, position }
        };
        Corners::new(places.into_iter().map(corner).collect())
    }

    /// The vertex at a place on the outer boundary of a patch.
    fn on_boundary(&self, number: usize, boundary: &[Boundary<'_>; 4], (u, v): Place) -> Option<u32> {
        let unit = self.plan.unit;
        let sides = [(u == 0, v), (u == unit, v), (v == 0, u), (v == unit, u)];
        (0..4).filter(|&side| sides[side].0).find_map(|side| {
            let cut = boundary[side].cut_at(sides[side].1)?;
            Some(self.on_edges[self.topology.sides[number][side].edge][cut])
        })
    }

    /// Adds a vertex inside a patch.
    fn inside(&mut self, patch: &BezierPatch, place: Place) -> (u32, DVec3) {
        let vertex = self.vertices.len() as u32;
        let [u, v] = [place.0, place.1].map(|k| self.plan.parameter(k));
        let point = patch.at(u, v);
        self.vertices.push(point.position.as_vec3());
        self.normal(patch, vertex, place, Some(point));
        (vertex, point.position)
    }

    fn normal(&mut self, patch: &BezierPatch, vertex: u32, place: Place, point: Option<super::SurfacePoint>) {
        let [u, v] = [place.0, place.1].map(|k| self.plan.parameter(k));
        let point = point.unwrap_or_else(|| patch.at(u, v));
        let normal = patch.normal_of(&point, u, v).map_or(Vec3::ZERO, |n| n.as_vec3());
        self.normals.push((vertex, normal));
    }

    /// Adds a triangle, unless it is a line at a pole.
    fn triangle(&mut self, corners: [u32; 3]) {
        let [a, b, c] = corners;
        if a != b && b != c && c != a {
            self.triangles.push(corners);
        }
    }

    fn triangles_of(&self, patch: usize) -> std::ops::Range<usize> {
        let start = if patch == 0 { 0 } else { self.ends[patch - 1][0] };
        start..self.ends[patch][0]
    }

    /// Marks patches that have drawn a line between the same two shared vertices as another patch has. With a tolerance
    /// large enough, two patches between the same two edges both become the same flat triangles.
    fn find_collisions(&self, marked: &mut [bool]) -> bool {
        let mut allowed: HashMap<[u32; 2], usize> = HashMap::new();
        for (edge, on_edge) in
            self.topology.edges.iter().zip(&self.on_edges).filter(|(edge, _)| !edge.collapsed())
        {
            for pair in on_edge.windows(2) {
                *allowed.entry([pair[0].min(pair[1]), pair[0].max(pair[1])]).or_default() += edge.uses.len();
            }
        }
        let shared = |line: &[u32; 2]| line.iter().all(|&v| (v as usize) < self.shared);
        let lines = |patch| {
            self.triangles[self.triangles_of(patch)]
                .iter()
                .flat_map(orientation::sides)
                .filter(shared)
                .map(|[a, b]| [a.min(b), a.max(b)])
        };
        let mut uses: HashMap<[u32; 2], usize> = HashMap::new();
        for line in (0..marked.len()).flat_map(lines) {
            *uses.entry(line).or_default() += 1;
        }
        uses.retain(|line, uses| *uses > allowed.get(line).copied().unwrap_or(2));
        let too_often: HashSet<_> = uses.into_keys().collect();
        for (patch, mark) in marked.iter_mut().enumerate() {
            *mark = !too_often.is_empty() && lines(patch).any(|line| too_often.contains(&line));
        }
        !too_often.is_empty()
    }

    /// Turns what faces the wrong way, adds up normals, and looks for holes.
    fn finish(
        mut self,
        mut orientation: Orientation,
        rounding: f64,
    ) -> Result<Tessellated, TessellationError> {
        let has_area = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|v| self.vertices[v as usize].as_dvec3());
            (b - a).cross(c - a) != DVec3::ZERO
        };
        if !self.triangles.iter().any(has_area) {
            return Err(TessellationError::NoArea);
        }
        self.turn(&orientation.turned);
        let component =
            |patch: usize| std::iter::repeat_n(orientation.component[patch], self.triangles_of(patch).len());
        let components: Vec<_> = (0..self.ends.len()).flat_map(component).collect();
        let pairs = || self.triangles.iter().zip(components.iter().copied());
        let mut ends = Ends::new(pairs(), self.shared);
        let wrong = orientation::inside_out(&self.vertices, pairs(), &ends, orientation.components);
        let inside_out: Vec<_> = orientation.component.iter().map(|&c| wrong[c]).collect();
        self.turn(&inside_out);
        for (chain, _) in ends.loops.iter_mut().filter(|(_, component)| wrong[*component]) {
            chain.reverse();
        }
        orientation.turned.iter_mut().zip(&inside_out).for_each(|(turned, again)| *turned ^= again);
        let normals = self.added_normals(&orientation.turned);
        Ok(Tessellated {
            mesh: TriangleMesh::new(self.vertices, self.triangles)?,
            normals,
            error_bound: self.deviation + rounding,
            boundary_loops: ends.loops.into_iter().map(|(chain, _)| chain).collect(),
            non_manifold_edges: ends.non_manifold,
            patches: orientation.turned.len(),
            turned_patches: orientation.turned.iter().filter(|turned| **turned).count(),
            one_sided_edges: orientation.misfits,
        })
    }

    fn turn(&mut self, patches: &[bool]) {
        for patch in (0..patches.len()).filter(|&patch| patches[patch]) {
            let range = self.triangles_of(patch);
            self.triangles[range].iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
        }
    }

    /// The mean of the patches' normals at each vertex.
    fn added_normals(&self, turned: &[bool]) -> Vec<Vec3> {
        let mut sums = vec![Vec3::ZERO; self.vertices.len()];
        let mut start = 0;
        for (patch, &[_, end]) in self.ends.iter().enumerate() {
            let sign = if turned[patch] { -1.0 } else { 1.0 };
            for &(vertex, normal) in &self.normals[start..end] {
                sums[vertex as usize] += sign * normal;
            }
            start = end;
        }
        sums.into_iter().map(|sum| if sum.length() > 1e-3 { sum.normalize() } else { Vec3::ZERO }).collect()
    }
}
