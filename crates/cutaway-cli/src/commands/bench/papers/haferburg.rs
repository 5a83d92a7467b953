//! A. Haferburg, *Object-order empty-space skipping*: texture fetches a pixel, from the volume's box against from geometry
//! around what is visible.
//!
//! His volumes are the Stanford bunny and the stag beetle as isosurfaces; here the bundled scans stand for them, with vessels, a ball
//! in a mostly empty box, and a signal that fills its box, on which skipping can gain nothing and should cost little.

use serde_json::json;

use super::{Effort, Section, gpu_engine};
use crate::commands::bench::frames::{Orbit, measure, scene_of_line};
use crate::commands::statistics::StatisticsFile;
use crate::scene::Prepared;

/// What is looked at, and how.
const SCENES: [(&str, &str); 6] = [
    ("bonsai, isosurface", "sample:bonsai --iso 40"),
    ("bonsai, leaves", "sample:bonsai --colormap viridis --range 30,200 --opacity 34,0,60,0.8"),
    ("head, skin", "sample:mr-head --iso 60"),
    (
        "angiography, vessels",
        "sample:angiography:512 --colormap viridis --range 0,4095 --opacity 1800,0,2600,0.6",
    ),
    ("ball in a box", "sample:sphere --colormap viridis --range 0,1 --opacity 0.7,0,0.8,0.2"),
    ("dense", "sample:marschner-lobb --colormap viridis --range 0,1 --opacity 0,0.002,1,0.01"),
];

/// From the box first: the others are compared with it.
const SKIPPING: [&str; 6] = ["off", "cells", "fitted", "boundary", "contour", "fitted-contour"];

/// Texture fetches of a frame, per kind of proxy geometry.
pub(super) fn fetches(name: String, effort: Effort) -> anyhow::Result<Section> {
    let mut cases = Vec::new();
    // Only a GPU fetches texels.
    let scenes: &[_] = if gpu_engine().is_some() { &SCENES } else { &[] };
    for (what, options) in scenes {
        let mut prepared: Option<Prepared> = None;
        for skipping in SKIPPING {
            let side = effort.size(512);
            let line = format!(
                "{options} --engine raycast --step 1 --resolution {side},{side} --space-skipping {skipping}"
            );
            let args = scene_of_line(&line)?;
            let scene = match prepared.take() {
                Some(before) => before.again(&args)?,
                None => Prepared::new(&args)?,
            };
            let orbit = Orbit { frames: effort.frames, degrees: 0.0 };
            let statistics = measure(&scene, &args, orbit, |_| Ok(()))?;
            let of_box = cases.iter().rev().find(|c: &&Case| c.what == *what && c.skipping == "off");
            let of_box = of_box.map_or(statistics.samples, |c| c.statistics.samples);
            cases.push(Case { what, skipping, line, statistics, of_box });
            prepared = Some(scene);
        }
    }
    Ok(Section {
        name,
        paper: "Haferburg, Object-order empty space skipping",
        paper_says: "pictures of the fetches a fragment, without numbers: far fewer where what is visible is localised, and \
                     possibly slower where it is scattered all over the volume",
        measured: "bundled samples, a step of one voxel; a lit sample takes seven fetches, a cell of an isosurface counts \
                   as one"
            .to_owned(),
        rows: cases.iter().map(Case::json).collect(),
        text: Case::table(&cases),
    })
}

/// A volume with one kind of skipping, and what it took.
struct Case {
    what: &'static str,
    skipping: &'static str,
    line: String,
    statistics: StatisticsFile,
    /// Fetches from the volume's box.
    of_box: Option<u64>,
}

impl Case {
    /// How many times fewer fetches than from the box.
    fn gain(&self) -> Option<f64> {
        Some(self.of_box? as f64 / self.statistics.samples?.max(1) as f64)
    }

    fn json(&self) -> serde_json::Value {
        json!({
            "volume": self.what,
            "space_skipping": self.skipping,
            "adapter": self.statistics.adapter,
            "resolution": self.statistics.resolution,
            "fetches": self.statistics.samples,
            "times_fewer_than_from_the_box": self.gain(),
            "frame_ms": self.statistics.frame_ms,
            "scene": self.line,
        })
    }

    fn table(cases: &[Self]) -> (Vec<&'static str>, Vec<Vec<String>>) {
        let heads = vec!["volume", "space skipping", "million fetches", "times fewer", "ms a frame", "on"];
        let row = |case: &Self| {
            let fetches = case.statistics.samples.unwrap_or(0) as f64;
            vec![
                case.what.to_owned(),
                case.skipping.to_owned(),
                format!("{:.2}", fetches / 1e6),
                case.gain().map_or("-".to_owned(), |gain| format!("{gain:.2}")),
                format!("{:.1}", case.statistics.frame_ms.median),
                case.statistics.adapter.clone().unwrap_or_default(),
            ]
        };
        (heads, cases.iter().map(row).collect())
    }
}
