//! NaN means nothing: reference and CPU engine show no cell that touches a NaN voxel, and make up nothing at its rim.

use cutaway_core::image::Image;
use cutaway_core::reference;
use cutaway_core::scene::{Mode, Scene};
use cutaway_core::volume::NanMeaning;
use cutaway_cpu::SimdChoice;
use cutaway_testing::engines::cpu;
use cutaway_testing::missing::{Holes, border, covered, middle, scene};
use cutaway_testing::tolerances::{STEPPED, assert_close};

/// An engine: its name, and how it renders.
type Engine = (&'static str, fn(&Scene) -> Image);

fn engines() -> [Engine; 2] {
    [("reference", reference::render), ("cpu", |scene| cpu(scene, SimdChoice::Auto, 0).0)]
}

const HOLES: [(Holes, f64); 2] = [(middle, 60.0), (border, 36.0)];

#[test]
fn report_34_cells_that_touch_nan_show_nothing() {
    for (holes, area) in HOLES {
        for mode in [Mode::Composite, Mode::Mip, Mode::Minip, Mode::Mean] {
            for (name, engine) in engines() {
                let image = engine(&scene(holes, NanMeaning::Transparent, mode, true));
                assert_eq!(covered(&image), area, "{name}, {}", mode.name());
            }
        }
    }
}

#[test]
fn nan_can_have_the_lowest_or_the_highest_value() {
    for meaning in [NanMeaning::Lowest, NanMeaning::Highest] {
        for (name, engine) in engines() {
            let image = engine(&scene(border, meaning, Mode::Composite, false));
            assert_eq!(covered(&image), 64.0, "{name}");
            // The corner has the colour of the least or the greatest value.
            let bright = image.pixels()[0][0];
            assert!((bright > 0.9) == (meaning == NanMeaning::Highest), "{name}: {bright}");
        }
    }
}

#[test]
fn nothing_is_made_up_at_the_rim() {
    for (holes, _) in HOLES {
        let images =
            engines().map(|(_, engine)| engine(&scene(holes, NanMeaning::Transparent, Mode::Iso, true)));
        assert_close("isosurfaces", &images[0], &images[1], STEPPED);
        let lit = engines()
            .map(|(_, engine)| engine(&scene(holes, NanMeaning::Transparent, Mode::Composite, true)));
        assert_close("lit", &lit[0], &lit[1], STEPPED);
        // The field is linear, so its light is the same everywhere: what differs is the colour of the value alone.
        let unlit = reference::render(&scene(holes, NanMeaning::Transparent, Mode::Composite, false));
        let ratios = lit[0].pixels().iter().zip(unlit.pixels()).filter(|(_, unlit)| unlit[3] > 0.5);
        let ratios: Vec<f32> = ratios.map(|(lit, unlit)| lit[0] / unlit[0]).collect();
        let [least, most] = ratios.iter().fold([f32::MAX, f32::MIN], |[a, b], r| [a.min(*r), b.max(*r)]);
        assert!(most - least < 0.2 * most, "light of {least} to {most}");
    }
}
