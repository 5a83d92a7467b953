//! What a repair says of itself.

use std::fmt;

/// Something that a repair changed, or left although it is unusual.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum RepairNotice {
    /// Vertices were replaced by others at the same place, or within the tolerance.
    Welded {
        /// Vertices that went.
        vertices: usize,
        /// The distance up to which vertices were welded, in object units; 0 is the same place.
        within: f64,
    },
    /// Triangles with a repeated corner, or without area and of no use to their neighbours, were dropped.
    DegenerateDropped {
        /// How many.
        triangles: usize,
    },
    /// Of triangles with the same three corners all but one were dropped.
    DuplicatesDropped {
        /// How many.
        triangles: usize,
    },
    /// Walls between touching solids were dropped: faces that are there twice, once in each direction.
    WallsDropped {
        /// Triangles that went.
        triangles: usize,
    },
    /// Triangles were turned to be wound like their neighbours.
    Rewound {
        /// Triangles that were turned.
        triangles: usize,
        /// Patches they are in.
        patches: usize,
    },
    /// Boundary loops were capped.
    Capped {
        /// Loops.
        loops: usize,
        /// Edges of all loops together.
        edges: usize,
        /// Edges of the longest loop.
        longest: usize,
        /// New triangles.
        triangles: usize,
        /// Loops that were, at least in part, capped with a fan around a new vertex in their middle.
        fans: usize,
    },
    /// Shells that enclose nothing were dropped.
    EmptyShellsDropped {
        /// Shells.
        shells: usize,
        /// Their triangles.
        triangles: usize,
    },
    /// Shells that were wound inward were turned outward, with what is inside of them.
    TurnedOutward {
        /// Shells, those inside of others included.
        shells: usize,
        /// Their triangles.
        triangles: usize,
    },
    /// Shells inside others and wound against them are kept so.
    Cavities {
        /// Shells.
        shells: usize,
    },
    /// There are too many shells in one another to tell which lies inside which.
    NestingUnknown {
        /// Shells that were taken to lie inside no other.
        shells: usize,
    },
    /// Edges of four triangles or more are kept, since they are used as often in one direction as in the other.
    NonManifoldKept {
        /// Edges.
        edges: usize,
    },
}

impl fmt::Display for RepairNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Welded { vertices, within: 0.0 } => {
                write!(f, "{} at the place of others welded to them", many(vertices, "vertex"))
            }
            Self::Welded { vertices, within } => {
                write!(f, "{} within {within:.3e} of others welded to them", many(vertices, "vertex"))
            }
            Self::DegenerateDropped { triangles } => {
                write!(f, "{} dropped", many(triangles, "degenerate triangle"))
            }
            Self::DuplicatesDropped { triangles } => {
                write!(f, "{} dropped", many(triangles, "duplicate triangle"))
            }
            Self::WallsDropped { triangles } => {
                write!(f, "{} of walls, there once in each direction, dropped", many(triangles, "triangle"))
            }
            Self::Rewound { triangles, patches } => {
                let (triangles, patches) = (many(triangles, "triangle"), many(patches, "patch"));
                write!(f, "{triangles} in {patches} turned to be wound like the others")
            }
            Self::Capped { loops, edges, longest, triangles, fans } => {
                let (holes, edges) = (many(loops, "hole"), many(edges, "edge"));
                write!(f, "{holes} of {edges} capped with {}", many(triangles, "triangle"))?;
                if loops > 1 {
                    write!(f, "; the longest has {}", many(longest, "edge"))?;
                }
                if fans > 0 { write!(f, "; {fans} with a fan around the middle") } else { Ok(()) }
            }
            Self::EmptyShellsDropped { shells, triangles } => {
                let (shells, triangles) = (many(shells, "shell"), many(triangles, "triangle"));
                write!(f, "{shells} of {triangles} that enclosed nothing dropped")
            }
            Self::TurnedOutward { shells, triangles } => {
                let (shells, triangles) = (many(shells, "shell"), many(triangles, "triangle"));
                write!(f, "{shells} of {triangles} wound inward, turned outward")
            }
            Self::Cavities { shells } => {
                write!(f, "{} inside others and wound against them kept as cavities", many(shells, "shell"))
            }
            Self::NestingUnknown { shells } => write!(
                f,
                "too many shells in one another to tell which lies inside which: {} taken to lie inside none",
                many(shells, "shell")
            ),
            Self::NonManifoldKept { edges } => {
                write!(f, "{} of four triangles or more kept, where solids touch", many(edges, "edge"))
            }
        }
    }
}

/// A number and what it counts.
fn many(n: usize, what: &str) -> String {
    match (n, what) {
        (1, _) => format!("1 {what}"),
        (_, "vertex") => format!("{n} vertices"),
        (_, "patch") => format!("{n} patches"),
        _ => format!("{n} {what}s"),
    }
}

/// Why a mesh could not be closed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RepairError {
    /// The tolerance makes no sense.
    #[error("the weld tolerance is {found}, expected 0 or a share of the diagonal within 1e-9 to 0.1")]
    Tolerance {
        /// What was asked for.
        found: f64,
    },
    /// Nothing to repair.
    #[error("the mesh has no triangles; give one that encloses a volume")]
    Empty,
    /// Everything was degenerate.
    #[error("none of the {found} triangles is left: all are degenerate; give a mesh that encloses a volume")]
    NothingLeft {
        /// Triangles of the mesh as it was.
        found: usize,
    },
    /// No consistent winding exists.
    #[error(
        "the surface is one-sided: {patches} of its patches, with {triangles} triangles, cannot be wound consistently \
         (as in a Moebius strip); mend the mesh in an editor"
    )]
    OneSided {
        /// Patches.
        patches: usize,
        /// Their triangles.
        triangles: usize,
    },
    /// Edges of three triangles or more that no cap can balance.
    #[error(
        "the surface cannot be closed: {odd} edges have an odd number of triangles (three or more), {even} an even one \
         (four or more) that run along it in directions that do not match; {boundary} edges have one triangle; mend \
         the mesh in an editor: where its surface branches, remove the inner sheet"
    )]
    NonManifold {
        /// Edges with three, five, ... triangles.
        odd: usize,
        /// Edges with four, six, ... triangles of which more run one way.
        even: usize,
        /// Edges with one triangle, which could be capped if the others were not there.
        boundary: usize,
    },
    /// Closed, but flat.
    #[error(
        "the surface encloses no volume: {triangles} triangles lie flat; give a mesh that encloses a volume"
    )]
    Flat {
        /// Triangles that were left up to then.
        triangles: usize,
    },
    /// More vertices than can be numbered.
    #[error("the capped surface has more than {} vertices; simplify the mesh", u32::MAX)]
    TooManyVertices,
}
