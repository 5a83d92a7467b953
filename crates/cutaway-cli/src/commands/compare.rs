//! `cutaway compare`: how far two images are apart.

use std::process::ExitCode;

use cutaway_core::image::compare::{compare, difference_image};
use cutaway_io::image::{BitDepth, read_image, write_image};

use crate::args::CompareArgs;
use crate::report::wrong_use;

pub(crate) fn run(args: &CompareArgs) -> anyhow::Result<ExitCode> {
    if let Some(limit) = args.fail_above.filter(|l| !(*l >= 0.0 && l.is_finite())) {
        return Err(wrong_use(format!("--fail-above is {limit}; expected a number of 0 or more")));
    }
    let (a, b) = (read_image(&args.a)?, read_image(&args.b)?);
    let comparison =
        compare(&a, &b).map_err(|e| anyhow::anyhow!("{} and {}: {e}", args.a.display(), args.b.display()))?;
    if args.json {
        println!("{}", serde_json::to_string_pretty(&comparison)?);
    } else {
        println!("{comparison}");
    }
    if let Some(path) = &args.difference {
        write_image(path, &difference_image(&a, &b, args.gain)?, BitDepth::Eight)?;
    }
    let failed = args.fail_above.filter(|limit| comparison.exceeds(*limit));
    if let Some(limit) = failed {
        eprintln!("error: the images differ by an RMSE of {}, more than {limit}", comparison.rmse);
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}
