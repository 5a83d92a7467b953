//! Masks: which pixels of a frame are wanted.

/// The wanted pixels of a frame, in square cells of pixels.
#[derive(Clone, Debug)]
pub(crate) struct Mask {
    columns: u32,
    rows: u32,
    /// Binary logarithm of the edge of a cell in pixels.
    shift: u32,
    cells: Vec<bool>,
}

impl Mask {
    /// Cells with an edge of `1 << shift` pixels, rows from the top left.
    pub(crate) fn new((columns, rows): (u32, u32), shift: u32, cells: Vec<bool>) -> Self {
        assert_eq!(cells.len(), columns as usize * rows as usize, "a flag a cell");
        Self { columns, rows, shift, cells }
    }

    #[inline]
    pub(crate) fn cell(&self, i: u32, j: u32) -> bool {
        self.cells[j as usize * self.columns as usize + i as usize]
    }

    /// Whether any pixel of a rectangle is wanted; what is beyond the cells is not.
    #[inline]
    pub(crate) fn any(&self, (x, y): (u32, u32), (width, height): (u32, u32)) -> bool {
        let end = |from: u32, size: u32, count: u32| (((from + size - 1) >> self.shift) + 1).min(count);
        let columns = (x >> self.shift) as usize..end(x, width, self.columns) as usize;
        (y >> self.shift..end(y, height, self.rows)).any(|j| {
            let row = j as usize * self.columns as usize;
            self.cells[row..row + self.columns as usize]
                .get(columns.clone())
                .is_some_and(|r| r.contains(&true))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_knows_which_rectangles_are_wanted() {
        let mut cells = vec![false; 15];
        cells[7] = true;
        let mask = Mask::new((5, 3), 2, cells);
        assert!(mask.any((8, 4), (1, 1)) && mask.any((11, 7), (4, 4)) && mask.any((0, 0), (99, 99)));
        assert!(!mask.any((0, 0), (8, 12)) && !mask.any((12, 4), (99, 1)) && !mask.any((40, 40), (4, 4)));
    }
}
