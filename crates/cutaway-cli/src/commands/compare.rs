//! `cutaway compare`: how far two images are apart.

use std::process::ExitCode;

use anyhow::{anyhow, bail};
use cutaway_core::image::compare::{compare, difference_image};
use cutaway_io::image::{BitDepth, ImageFormat, read_image, write_image};

use crate::args::CompareArgs;
use crate::outputs::Outputs;
use crate::report::{self, wrong_use};
use crate::values::shown;

pub(crate) fn run(args: &CompareArgs) -> anyhow::Result<ExitCode> {
    if let Some(limit) = args.fail_above.filter(|limit| *limit < 0.0) {
        return Err(wrong_use(format!("--fail-above is {}; expected a number of 0 or more", shown(limit))));
    }
    let mut outputs = Outputs::default();
    if let Some(path) = &args.difference {
        outputs.image("--difference", path)?;
    }
    for path in [&args.a, &args.b] {
        ImageFormat::from_path(path).map_err(|e| wrong_use(e.to_string()))?;
        outputs.input(path);
    }
    outputs.check()?;
    let (a, b) = (read_image(&args.a)?, read_image(&args.b)?);
    let comparison =
        compare(&a, &b).map_err(|e| anyhow!("{} and {}: {e}", args.a.display(), args.b.display()))?;
    if let Some(path) = &args.difference {
        write_image(path, &difference_image(&a, &b, args.gain)?, BitDepth::Eight)?;
    }
    let text = if args.json { serde_json::to_string_pretty(&comparison)? } else { comparison.to_string() };
    report::print(&(text + "\n"))?;
    match args.fail_above.filter(|limit| comparison.exceeds(*limit)) {
        None => Ok(ExitCode::SUCCESS),
        Some(_) if comparison.non_finite_pixels > 0 => {
            bail!("{} pixels are NaN or infinite in one of the images", comparison.non_finite_pixels)
        }
        Some(limit) => {
            let [rmse, limit] = [comparison.rmse, limit].map(shown);
            bail!("the images differ by an RMSE of {rmse}, more than {limit}")
        }
    }
}
