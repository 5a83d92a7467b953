//! Progress and cancelling: coarse images first, finer ones after, until one is whole or something newer is wanted.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use cutaway::engine::{DebugView, EngineError, Refinement, Renderer};
use cutaway::prelude::*;
use cutaway::scene::Engine;

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene =
        Scene::of(cutaway::read("sample:mr-head")?).engine(Engine::Cpu).resolution(400, 400).build()?;
    let newer = AtomicBool::new(false);
    let refinement = Refinement {
        first: Duration::from_millis(30),
        between: Duration::from_millis(50),
        stand: Duration::ZERO,
        overtaken: &newer,
        debug: DebugView::Off,
        on_device: false,
    };
    let mut renderer = Renderer::default();

    // To the end: the last image has a ray for every pixel.
    let mut spacings = Vec::new();
    renderer.refine(&scene, &refinement, &mut |frame| {
        println!("{:.0} ms: a ray every {} pixels", frame.frame_ms, frame.spacing);
        spacings.push(frame.spacing);
        ControlFlow::Continue(())
    })?;
    assert_eq!(spacings.last(), Some(&1));

    // Until something newer is wanted: one image is always made.
    newer.store(true, Ordering::Relaxed);
    let mut images = 0;
    let ended = renderer.refine(&scene, &refinement, &mut |_| {
        images += 1;
        ControlFlow::Continue(())
    });
    assert!(images == 1 && (ended.is_ok() || ended == Err(EngineError::Cancelled)));
    Ok(())
}
