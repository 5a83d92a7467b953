//! The examples, run as they stand. The one that needs a graphics adapter shows as ignored where there is none.

use libtest_mimic::{Arguments, Failed, Trial};

#[path = "../examples/first_picture.rs"]
mod first_picture;
#[path = "../examples/moving_cut.rs"]
mod moving_cut;
#[path = "../examples/own_array.rs"]
mod own_array;
#[path = "../examples/progress.rs"]
mod progress;
#[path = "../examples/shared_gpu.rs"]
mod shared_gpu;

type Example = fn() -> Result<(), Box<dyn std::error::Error>>;

fn trial(name: &str, example: Example) -> Trial {
    Trial::test(name, move || example().map_err(|error| Failed::from(error.to_string())))
}

fn main() {
    let without_gpu = cutaway::gpu::context::adapters().is_empty();
    let trials = vec![
        trial("first_picture", first_picture::main),
        trial("moving_cut", moving_cut::main),
        trial("own_array", own_array::main),
        trial("progress", progress::main),
        trial("shared_gpu", shared_gpu::main).with_ignored_flag(without_gpu),
    ];
    libtest_mimic::run(&Arguments::from_args(), trials).exit();
}
