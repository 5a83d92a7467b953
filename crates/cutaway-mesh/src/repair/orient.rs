//! Windings that are consistent within each patch.

use super::{RepairError, RepairNotice, Work};
use crate::edges::Edges;
use crate::sets::Sets;

/// Turns triangles so that both of every edge of exactly two run along it in opposite directions, as few as possible.
///
/// Edges of more triangles are not crossed: which of them belong together is not known. Where they bound whole solids
/// each of which is consistent, they come out balanced by themselves.
pub(super) fn make_consistent(work: &mut Work) -> Result<(), RepairError> {
    let count = work.triangles.len();
    let mut patches = Sets::new(count);
    let mut one_sided = Vec::new();
    for uses in Edges::new(&work.triangles).iter() {
        if let [a, b] = uses
            && !patches.join(a.triangle(), b.triangle(), a.forward() == b.forward())
        {
            one_sided.push(a.triangle());
        }
    }
    if !one_sided.is_empty() {
        return Err(refusal(one_sided, &mut patches, count));
    }
    // Per patch, by its root: triangles, and those turned against the root.
    let mut sizes = vec![[0usize; 2]; count];
    let found: Vec<(usize, bool)> = (0..count).map(|t| patches.find(t)).collect();
    for (root, turned) in &found {
        sizes[*root][0] += 1;
        sizes[*root][1] += usize::from(*turned);
    }
    let (mut triangles, mut changed) = (0, 0);
    for (t, (root, turned)) in found.iter().enumerate() {
        let [all, against] = sizes[*root];
        // Where it is half and half, the root stays.
        if *turned != (2 * against > all) {
            work.triangles[t].swap(1, 2);
            triangles += 1;
        }
        changed += usize::from(t == *root && against > 0 && against < all);
    }
    work.notice_if(triangles > 0, RepairNotice::Rewound { triangles, patches: changed });
    Ok(())
}

fn refusal(one_sided: Vec<usize>, patches: &mut Sets, count: usize) -> RepairError {
    let mut roots: Vec<usize> = one_sided.into_iter().map(|t| patches.root(t)).collect();
    roots.sort_unstable();
    roots.dedup();
    let triangles = (0..count).filter(|t| roots.binary_search(&patches.root(*t)).is_ok()).count();
    RepairError::OneSided { patches: roots.len(), triangles }
}
