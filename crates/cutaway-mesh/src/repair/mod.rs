//! Making a closed surface of what files hold.
//!
//! What enters: any [`TriangleMesh`]. What leaves: a [`ClosedMesh`] and one notice for everything that was changed, or
//! an error with the counts of what stands in the way. In this order:
//!
//! 1. **Weld** vertices at exactly one place, for files that split vertices for the sake of normals and texture
//!    coordinates; then those on the boundary that are within a tolerance of one another, for files without connectivity
//!    whose coordinates were rounded.
//! 2. **Drop** triangles with a repeated corner; all but one of the triangles with the same three corners; walls (see
//!    `clean`), and fins without area. Where that would open what is closed, drop only what cancels.
//! 3. **Rewind** each patch (triangles joined by edges of exactly two) so that its windings are consistent, turning as
//!    few triangles as possible. One-sided patches are refused.
//! 4. **Cap** boundary loops: ears clipped in the loop's plane, or a fan around its centre where that does not work.
//!    Edges of three or more triangles may stay where they are used as often in one direction as in the other (solids
//!    that touch); otherwise the mesh is refused.
//! 5. **Drop** shells that enclose nothing.
//! 6. **Turn outward**: an outermost shell of negative volume is turned, and *everything inside it with it*. A shell
//!    inside another is otherwise left as it is: wound against the shell around it, it is a cavity; wound like
//!    it, it is a part of the same solid (inside is where the winding number is not zero).
//!
//! Time is n log n for n triangles, memory about 150 bytes each; what could take longer (large holes, many nested
//! shells) has a budget and a plainer way when that is used up.

mod cap;
mod clean;
mod nesting;
mod notice;
mod orient;
mod weld;

use cutaway_core::glam::Vec3;

pub use notice::{RepairError, RepairNotice};

use crate::closed::ClosedMesh;
use crate::edges::{has_odd_edge, is_balanced};
use crate::mesh::TriangleMesh;

/// How to repair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RepairOptions {
    /// Vertices on the boundary that are at most this far apart are welded, as a share of the diagonal of the bounds: 0
    /// for none but those at exactly the same place, or 1e-9 to 0.1.
    pub weld_tolerance: f64,
}

impl Default for RepairOptions {
    /// A millionth: some ten times the resolution of coordinates, where programs that write triangles without
    /// sharing vertices differ.
    fn default() -> Self {
        Self { weld_tolerance: 1e-6 }
    }
}

/// A closed mesh and how it came to be closed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Repaired {
    /// The mesh.
    pub mesh: ClosedMesh,
    /// What was changed, in order; empty where nothing was.
    pub notices: Vec<RepairNotice>,
}

/// A mesh under repair. Its vertices are relative to the origin of the mesh that it came from.
struct Work {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    notices: Vec<RepairNotice>,
}

/// Makes a closed surface of a mesh; the module's documentation says how.
///
/// # Errors
/// [`RepairError`] names the counts of what cannot be mended.
pub fn repair(mesh: &TriangleMesh, options: &RepairOptions) -> Result<Repaired, RepairError> {
    let tolerance = options.weld_tolerance;
    // Below the resolution of coordinates there is nothing to weld, and cells for it could not be counted.
    if tolerance != 0.0 && !(1e-9..=0.1).contains(&tolerance) {
        return Err(RepairError::Tolerance { found: tolerance });
    }
    let found = mesh.triangles().len();
    if found == 0 {
        return Err(RepairError::Empty);
    }
    let mut work = Work { vertices: vec![], triangles: mesh.triangles().to_vec(), notices: vec![] };
    weld::weld(&mut work, mesh, tolerance);
    clean::drop_repeated_corners(&mut work);
    work.clean();
    if work.triangles.is_empty() {
        return Err(RepairError::NothingLeft { found });
    }
    orient::make_consistent(&mut work)?;
    cap::cap_loops(&mut work)?;
    nesting::settle_shells(&mut work)?;
    work.compact();
    let Work { vertices, triangles, notices } = work;
    let mesh = TriangleMesh::from_checked(mesh.origin(), vertices, triangles);
    Ok(Repaired { mesh: ClosedMesh::from_checked(mesh), notices })
}

impl Work {
    /// Drops what is no part of a surface. Where that would open what is closed, only what cancels goes.
    fn clean(&mut self) {
        let (triangles, notices) = (self.triangles.clone(), self.notices.len());
        clean::drop_duplicates(self);
        clean::drop_fins(self);
        let changed = self.triangles.len() < triangles.len();
        if changed && has_odd_edge(&self.triangles) && is_balanced(&triangles) {
            self.triangles = triangles;
            self.notices.truncate(notices);
            clean::cancel_opposites(self);
        }
    }

    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }

    /// Keeps the triangles that `keep` says, and says how many went.
    fn retain(&mut self, keep: &[bool]) -> usize {
        let before = self.triangles.len();
        let mut keep = keep.iter();
        self.triangles.retain(|_| keep.next().is_some_and(|keep| *keep));
        before - self.triangles.len()
    }

    fn notice_if(&mut self, happened: bool, notice: RepairNotice) {
        if happened {
            self.notices.push(notice);
        }
    }

    /// Drops vertices that no triangle uses: nobody can see them.
    fn compact(&mut self) {
        let mut number = vec![u32::MAX; self.vertices.len()];
        self.triangles.iter().flatten().for_each(|&v| number[v as usize] = 0);
        let mut used = 0;
        for (old, number) in number.iter_mut().enumerate().filter(|(_, number)| **number == 0) {
            self.vertices[used as usize] = self.vertices[old];
            *number = used;
            used += 1;
        }
        self.vertices.truncate(used as usize);
        self.triangles.iter_mut().flatten().for_each(|v| *v = number[*v as usize]);
    }
}
