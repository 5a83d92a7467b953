//! `cutaway bench papers`: what papers tell of their renderers, measured here.
//!
//! A paper's table or figure is a [`Section`]: where it is from, what was measured there and here, and rows. Its file in
//! `papers/` makes the volumes and scenes. Times of other machines in other decades are no comparison of renderers: they
//! say what was possible, and whether costs grow the same way.

mod haferburg;
mod maximo;
mod ray_triangle;
mod rezk_salama;
mod termeer;

use clap::ValueEnum;
use cutaway_gpu::context::adapters;
use serde::Serialize;
use serde_json::Value;

use super::table;
use crate::args::{BenchPapersArgs, PaperSection};
use crate::report;

/// What is measured how thoroughly.
#[derive(Clone, Copy, Debug)]
struct Effort {
    frames: u32,
    /// Volumes and images so small that everything takes an instant.
    quick: bool,
}

impl Effort {
    /// A number of voxels or pixels, or a small one.
    fn size(self, full: u32) -> u32 {
        if self.quick { (full / 16).max(8) } else { full }
    }
}

/// A paper's table or figure, measured here.
#[derive(Debug, Serialize)]
struct Section {
    /// As it is named at the command line.
    name: String,
    /// The paper, and the place in it.
    paper: &'static str,
    /// What the paper says, in a few words, with its figures and its machine.
    paper_says: &'static str,
    /// What was measured here.
    measured: String,
    /// Objects with the same names each.
    rows: Vec<Value>,
    /// The rows as text: heads, then cells.
    #[serde(skip)]
    text: (Vec<&'static str>, Vec<Vec<String>>),
}

#[derive(Debug, Serialize)]
struct Report {
    threads: usize,
    frames: u32,
    sections: Vec<Section>,
}

pub(super) fn run(args: &BenchPapersArgs) -> anyhow::Result<()> {
    let effort = Effort { frames: if args.quick { 1 } else { args.frames }, quick: args.quick };
    let wanted = |s: &&PaperSection| args.sections.is_empty() || args.sections.contains(s);
    let sections = PaperSection::value_variants().iter().filter(wanted);
    let sections = sections.map(|s| section(*s, effort)).collect::<anyhow::Result<_>>()?;
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let report = Report { threads, frames: effort.frames, sections };
    let text = if args.json { serde_json::to_string_pretty(&report)? + "\n" } else { text(&report) };
    report::print(&text)
}

fn section(section: PaperSection, effort: Effort) -> anyhow::Result<Section> {
    let name = section.to_possible_value().map_or(String::new(), |v| v.get_name().to_owned());
    match section {
        PaperSection::TermeerSoftware => termeer::software(name, effort),
        PaperSection::TermeerImageSize => termeer::image_size(name, effort),
        PaperSection::HaferburgFetches => haferburg::fetches(name, effort),
        PaperSection::MaximoRegular => maximo::regular(name, effort),
        PaperSection::MaximoUnstructured => maximo::unstructured(name, effort),
        PaperSection::Bricks => rezk_salama::bricks(name, effort),
        PaperSection::RayTriangle => Ok(ray_triangle::ray_triangle(name, effort)),
    }
}

/// The engine that renders on a GPU, if there is any, be it software.
fn gpu_engine() -> Option<&'static str> {
    (!adapters().is_empty()).then_some("raycast")
}

fn text(report: &Report) -> String {
    let mut text = format!("Median of {} frames of an orbit, {} threads.\n", report.frames, report.threads);
    for section in &report.sections {
        let Section { name, paper, paper_says, measured, text: (heads, rows), .. } = section;
        text += &format!("\n{name}: {paper}\n  there: {paper_says}\n  here: {measured}\n\n");
        text += &table::text(heads, rows);
    }
    text
}
