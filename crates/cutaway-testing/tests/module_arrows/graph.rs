//! Cycles of imports.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use crate::scan::Import;

/// A shortest cycle of every knot of files that import each other, as a line.
pub(crate) fn cycles(imports: &BTreeSet<Import>) -> Vec<String> {
    let mut targets: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for import in imports {
        targets.entry(&import.from).or_default().push(&import.to);
    }
    let mut told = BTreeSet::new();
    let mut found = Vec::new();
    for start in targets.keys().copied() {
        if told.contains(start) {
            continue;
        }
        let Some(cycle) = shortest(&targets, start) else { continue };
        told.extend(knot(&targets, start));
        found.push(cycle.join(" -> "));
    }
    found
}

/// The shortest way from a file back to itself.
fn shortest<'a>(targets: &BTreeMap<&'a str, Vec<&'a str>>, start: &'a str) -> Option<Vec<&'a str>> {
    let mut came_from: BTreeMap<&str, &str> = BTreeMap::new();
    let mut waiting = VecDeque::from([start]);
    while let Some(file) = waiting.pop_front() {
        for next in targets.get(file).into_iter().flatten().copied() {
            if next == start {
                let mut way = vec![start, file];
                while let Some(before) =
                    came_from.get(way[way.len() - 1]).filter(|_| way[way.len() - 1] != start)
                {
                    way.push(before);
                }
                // A file that imports itself is not among imports: the way ends at the start.
                way.reverse();
                return Some(way);
            }
            if !came_from.contains_key(next) {
                came_from.insert(next, file);
                waiting.push_back(next);
            }
        }
    }
    None
}

/// All files that a file reaches and that reach it.
fn knot<'a>(targets: &BTreeMap<&'a str, Vec<&'a str>>, start: &'a str) -> Vec<&'a str> {
    let reached = |from: &'a str| {
        let mut seen = BTreeSet::new();
        let mut waiting = vec![from];
        while let Some(file) = waiting.pop() {
            let new = targets.get(file).into_iter().flatten().copied().filter(|next| seen.insert(*next));
            waiting.extend(new.collect::<Vec<_>>());
        }
        seen
    };
    reached(start).into_iter().filter(|file| reached(file).contains(start)).collect()
}
