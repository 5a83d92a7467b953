//! Algorithms of the papers, kept to be measured beside what cutaway does.

pub mod ray_triangle;
