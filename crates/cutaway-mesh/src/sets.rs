//! Disjoint sets of triangles, and which of them must be turned to face the same way.

/// Disjoint sets of `0..n`; each member is turned, or not, against its set's root.
pub(crate) struct Sets {
    parent: Vec<usize>,
    /// Whether a member is turned against its parent.
    turned: Vec<bool>,
    size: Vec<u32>,
}

impl Sets {
    /// `n` sets of one member.
    pub(crate) fn new(n: usize) -> Self {
        Self { parent: (0..n).collect(), turned: vec![false; n], size: vec![1; n] }
    }

    /// The set of a member, by its root, and whether the member is turned against that.
    pub(crate) fn find(&mut self, mut member: usize) -> (usize, bool) {
        let mut turned = false;
        while self.parent[member] != member {
            // Path halving: the parent becomes the grandparent, and the turn both turns.
            let parent = self.parent[member];
            self.turned[member] ^= self.turned[parent];
            self.parent[member] = self.parent[parent];
            turned ^= self.turned[member];
            member = self.parent[member];
        }
        (member, turned)
    }

    /// The root of a member's set.
    pub(crate) fn root(&mut self, member: usize) -> usize {
        self.find(member).0
    }

    /// Joins the sets of two members that are turned against each other, or not; false where both are in one set
    /// already and it says otherwise.
    pub(crate) fn join(&mut self, a: usize, b: usize, turned: bool) -> bool {
        let ((mut a, turned_a), (mut b, turned_b)) = (self.find(a), self.find(b));
        let turned = turned ^ turned_a ^ turned_b;
        if a == b {
            return !turned;
        }
        if self.size[a] < self.size[b] {
            std::mem::swap(&mut a, &mut b);
        }
        self.parent[b] = a;
        self.turned[b] = turned;
        self.size[a] = self.size[a].saturating_add(self.size[b]);
        true
    }

    /// For every member the number of its set, counted from 0 in order of appearance, and how many sets there are.
    pub(crate) fn numbered(&mut self) -> (Vec<u32>, usize) {
        let mut number = vec![u32::MAX; self.parent.len()];
        let mut of = vec![0; self.parent.len()];
        let mut count = 0;
        for (member, of) in of.iter_mut().enumerate() {
            let root = self.root(member);
            if number[root] == u32::MAX {
                number[root] = count;
                count += 1;
            }
            *of = number[root];
        }
        (of, count as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_add_up_along_chains() {
        let mut sets = Sets::new(5);
        assert!(sets.join(0, 1, true));
        assert!(sets.join(1, 2, true));
        assert!(sets.join(3, 4, false));
        assert!(sets.join(4, 0, true));
        assert!(!sets.join(0, 2, true), "two turns are none");
        assert!(sets.join(2, 3, true));
        assert_eq!(sets.numbered(), (vec![0; 5], 1));
    }
}
