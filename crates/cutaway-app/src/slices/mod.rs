//! Slices through the volume, beside the picture: three orthogonal ones and one as the camera looks, with a crosshair that
//! they share, grey values in a window, and the cut's outline.

mod plane;
mod probe;

use cutaway_core::clip::FlatClip;
use cutaway_core::glam::DVec3;
use cutaway_core::space::WorldFrame;
use cutaway_core::volume::Volume;
use egui::{
    Align2, Color32, ColorImage, FontId, PointerButton, Pos2, Rect, Response, Sense, Stroke, Ui, Vec2,
};

pub use crate::document::notes::SliceNotes;
pub use plane::{Orientation, Plane, outline};
pub use probe::{Measure, Probe, pick};

use crate::cutting::Cutting;
use crate::document::Document;

/// The colour of the cut's outline, and of crosshair and measure.
const OUTLINE: [u8; 3] = [255, 170, 40];
const CROSS: Color32 = Color32::from_rgb(90, 200, 255);

/// Slices, and what points at them.
#[derive(Default)]
pub struct Slices {
    /// Whether they are shown.
    pub visible: bool,
    /// Whether there is a fourth, as the camera looks.
    pub oblique: bool,
    /// The point that all slices pass through; none: the volume's middle.
    pub crosshair: Option<DVec3>,
    /// The values that are black and white; none: the volume's range.
    pub levels: Option<[f64; 2]>,
    /// Whether clicks measure.
    pub measuring: bool,
    /// What was measured.
    pub measure: Measure,
    /// What is under the pointer.
    pub hover: Option<Probe>,
    panes: [Pane; 4],
}

#[derive(Default)]
struct Pane {
    texture: Option<egui::TextureHandle>,
    made: Option<Made>,
    /// Values of the plane, and which of them are kept.
    values: Vec<f32>,
    outline: Vec<bool>,
}

/// What a pane's texture was made of.
#[derive(Clone, Debug, PartialEq)]
struct Made {
    plane: Plane,
    volume: usize,
    cutting: Cutting,
    solids: usize,
    levels: [f64; 2],
}

impl Slices {
    /// Another volume: nothing that was pointed at is there any more. Its scene file may say what is shown.
    pub fn opened(&mut self, notes: Option<&SliceNotes>) {
        let as_before = SliceNotes { visible: self.visible, oblique: self.oblique, ..SliceNotes::default() };
        let SliceNotes { visible, oblique, crosshair, levels } = notes.cloned().unwrap_or(as_before);
        let finite = |v: &[f64]| v.iter().all(|x| x.is_finite());
        let crosshair = crosshair.filter(|p| finite(p)).map(DVec3::from_array);
        let levels = levels.filter(|l| finite(l) && l[0] < l[1]);
        *self = Self { visible, oblique, crosshair, levels, ..Self::default() };
    }

    /// What a scene file keeps.
    pub fn notes(&self) -> SliceNotes {
        let Self { visible, oblique, levels, .. } = *self;
        SliceNotes { visible, oblique, crosshair: self.crosshair.map(|p| p.to_array()), levels }
    }

    /// The point that all slices pass through.
    pub fn crosshair(&self, volume: &Volume) -> DVec3 {
        self.crosshair.unwrap_or_else(|| volume.center_in_world())
    }

    /// The values that are black and white.
    pub fn levels(&self, volume: &Volume) -> [f64; 2] {
        self.levels.unwrap_or_else(|| volume.value_range())
    }

    /// Changes the values that are black and white, as a drag does: across widens the window, down lowers the level, both
    /// in heights of the pane.
    pub fn drag_levels(&mut self, volume: &Volume, [across, down]: [f64; 2]) {
        let [lo, hi] = self.levels(volume);
        let [least, most] = volume.value_range();
        let range = (most - least).max(f64::MIN_POSITIVE);
        let window = ((hi - lo) * across.clamp(-2.0, 2.0).exp()).clamp(range * 1e-4, range * 4.0);
        let level = (0.5 * (lo + hi) - down * (hi - lo)).clamp(least - range, most + range);
        self.levels = Some([level - 0.5 * window, level + 0.5 * window]);
    }

    /// Draws the slices over all that is left of `ui`.
    pub fn show(&mut self, ui: &mut Ui, document: &Document) {
        let volume = document.volume().lattice();
        ui.horizontal_wrapped(|ui| {
            ui.checkbox(&mut self.oblique, "Oblique");
            ui.checkbox(&mut self.measuring, "Measure");
            if ui.button("Reset levels").clicked() {
                self.levels = None;
            }
            if ui.button("Centre").clicked() {
                self.crosshair = None;
            }
        });
        let all = ui.available_rect_before_wrap();
        ui.allocate_rect(all, Sense::hover());
        for (index, (orientation, rect)) in self.layout(all).into_iter().enumerate() {
            self.pane(ui, document, volume, index, orientation, rect);
        }
    }

    /// Where each slice is: below each other, or two beside two.
    fn layout(&self, all: Rect) -> Vec<(Orientation, Rect)> {
        let mut orientations = Orientation::ORTHOGONAL.to_vec();
        if self.oblique {
            orientations.push(Orientation::Oblique);
        }
        let columns = if self.oblique { 2 } else { 1 };
        let rows = orientations.len() / columns;
        let size = Vec2::new(all.width() / columns as f32, all.height() / rows as f32);
        let at = |i: usize| all.min + Vec2::new((i % columns) as f32 * size.x, (i / columns) as f32 * size.y);
        let rect = |i: usize| Rect::from_min_size(at(i), size).shrink(1.0);
        orientations.into_iter().enumerate().map(|(i, o)| (o, rect(i))).collect()
    }

    fn pane(
        &mut self,
        ui: &mut Ui,
        document: &Document,
        volume: &Volume,
        index: usize,
        orientation: Orientation,
        rect: Rect,
    ) {
        let frame = volume.geometry().frame;
        let name = orientation.name(frame);
        let response = ui.interact(rect, ui.scope_id().with(("slice", index)), Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, format!("{name} slice")));
        let plane = self.plane(document, orientation, rect);
        self.point(ui, volume, &response, &plane);
        // It may have moved.
        let plane = self.plane(document, orientation, rect);
        self.draw(ui, document, index, &plane);
        let painter = ui.painter_at(rect);
        let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
        painter.rect_filled(rect, 0.0, Color32::BLACK);
        if let Some(texture) = &self.panes[index].texture {
            painter.image(texture.id(), rect, whole, Color32::WHITE);
        }
        let on_screen = |p: DVec3| {
            let [x, y] = plane.pixel_of(p);
            rect.min + Vec2::new(x as f32 + 0.5, y as f32 + 0.5)
        };
        let cross = on_screen(self.crosshair(volume));
        let stroke = Stroke::new(1.0, CROSS.gamma_multiply(0.6));
        painter.hline(rect.x_range(), cross.y, stroke);
        painter.vline(cross.x, rect.y_range(), stroke);
        self.draw_measure(&painter, &|p| Some(on_screen(p)), unit(frame));
        painter.text(rect.min + Vec2::splat(6.0), Align2::LEFT_TOP, name, FontId::proportional(12.0), CROSS);
    }

    /// The plane of a slice that fits the whole volume into a rectangle.
    fn plane(&self, document: &Document, orientation: Orientation, rect: Rect) -> Plane {
        let volume = document.volume().lattice();
        let [right, up] = orientation.axes(volume.geometry().frame, &document.state().camera);
        let middle = volume.center_in_world();
        let extent = |axis: DVec3| {
            let along = |p: &DVec3| (*p - middle).dot(axis).abs();
            2.0 * volume.corners_in_world().iter().map(along).fold(0.0, f64::max)
        };
        let size = [rect.width(), rect.height()].map(|side| (side.round() as u32).clamp(1, 4096));
        let fit = (extent(right) / f64::from(size[0])).max(extent(up) / f64::from(size[1]));
        let normal = right.cross(up);
        let center = middle + normal * (self.crosshair(volume) - middle).dot(normal);
        Plane { center, right, up, pixel: (fit * 1.04).max(f64::MIN_POSITIVE), size }
    }

    /// What the pointer does in a slice.
    fn point(&mut self, ui: &Ui, volume: &Volume, response: &Response, plane: &Plane) {
        let rect = response.rect;
        let under = |at: Pos2| {
            let offset = at - rect.min;
            plane.point([f64::from(offset.x) - 0.5, f64::from(offset.y) - 0.5])
        };
        if let Some(at) = response.hover_pos() {
            self.hover = Probe::at(volume, under(at));
            let scroll = ui.input(|i| i.smooth_scroll_delta().y);
            if scroll != 0.0 {
                // A notch of the wheel is about a voxel.
                let by = plane.normal() * f64::from(scroll / 40.0) * volume.spacing().min_element();
                self.move_crosshair(volume, self.crosshair(volume) + by);
            }
        }
        let Some(at) = response.interact_pointer_pos() else { return };
        let height = f64::from(rect.height().max(1.0));
        if response.dragged_by(PointerButton::Secondary) {
            let delta = response.drag_delta();
            self.drag_levels(volume, [f64::from(delta.x) / height, f64::from(delta.y) / height]);
        } else if self.measuring {
            if response.clicked() {
                self.measure.take(under(at));
            }
        } else if response.clicked() || response.dragged_by(PointerButton::Primary) {
            self.move_crosshair(volume, under(at));
        }
    }

    /// Moves the crosshair, within the volume.
    fn move_crosshair(&mut self, volume: &Volume, to: DVec3) {
        let p = volume.voxel_from_world().transform_point3(to).clamp(DVec3::ZERO, volume.extent());
        self.crosshair = Some(volume.world_from_voxel().transform_point3(p));
    }

    /// Makes a pane's texture, as far as it is not there.
    fn draw(&mut self, ui: &Ui, document: &Document, index: usize, plane: &Plane) {
        let open = document.volume();
        let wanted = Made {
            plane: *plane,
            volume: std::sync::Arc::as_ptr(open) as usize,
            cutting: document.state().cutting.clone(),
            solids: document.solids.len(),
            levels: self.levels(open.lattice()),
        };
        let pane = &mut self.panes[index];
        if pane.made.as_ref() == Some(&wanted) {
            return;
        }
        let before = pane.made.as_ref();
        let same_plane = before.is_some_and(|b| b.plane == wanted.plane && b.volume == wanted.volume);
        if !same_plane {
            pane.values = plane.values(open.lattice());
        }
        let same_cut = before.is_some_and(|b| b.cutting == wanted.cutting && b.solids == wanted.solids);
        if !same_plane || !same_cut {
            let clip = document.clip().and_then(|clip| FlatClip::new(&clip).ok());
            let kept = clip.map(|clip| plane.kept(&clip)).unwrap_or_default();
            pane.outline = outline(&kept, plane.size[0] as usize);
        }
        let image = gray(&pane.values, &pane.outline, plane.size, wanted.levels);
        match &mut pane.texture {
            Some(texture) => texture.set(image, egui::TextureOptions::LINEAR),
            None => {
                let name = format!("slice {index}");
                pane.texture = Some(ui.ctx().load_texture(name, image, egui::TextureOptions::LINEAR));
            }
        }
        pane.made = Some(wanted);
    }

    /// Draws what was measured; `place` is where a point of the world is in the window.
    pub fn draw_measure(&self, painter: &egui::Painter, place: &dyn Fn(DVec3) -> Option<Pos2>, unit: &str) {
        let points: Vec<Pos2> = self.measure.points().filter_map(place).collect();
        for point in &points {
            painter.circle_filled(*point, 3.0, CROSS);
        }
        if let ([a, b], Some(length)) = (points.as_slice(), self.measure.length()) {
            painter.line_segment([*a, *b], Stroke::new(1.5, CROSS));
            let middle = *a + (*b - *a) * 0.5 + Vec2::new(0.0, -6.0);
            let text = format!("{length:.2} {unit}");
            painter.text(middle, Align2::CENTER_BOTTOM, text, FontId::proportional(13.0), CROSS);
        }
    }

    /// Marks the crosshair in the picture, which does not hide it.
    pub fn draw_crosshair(
        &self,
        painter: &egui::Painter,
        place: &dyn Fn(DVec3) -> Option<Pos2>,
        volume: &Volume,
    ) {
        if let Some(at) = place(self.crosshair(volume)) {
            let stroke = Stroke::new(1.0, CROSS);
            painter.line_segment([at - Vec2::new(7.0, 0.0), at + Vec2::new(7.0, 0.0)], stroke);
            painter.line_segment([at - Vec2::new(0.0, 7.0), at + Vec2::new(0.0, 7.0)], stroke);
        }
    }
}

/// What lengths of a volume are called: millimetres where its file tells of a patient.
pub fn unit(frame: WorldFrame) -> &'static str {
    if frame == WorldFrame::Ras { "mm" } else { "units" }
}

/// Values as grey ones between two levels, the outline over them.
fn gray(values: &[f32], outline: &[bool], size: [u32; 2], [lo, hi]: [f64; 2]) -> ColorImage {
    let (lo, width) = (lo as f32, ((hi - lo) as f32).max(f32::MIN_POSITIVE));
    let pixel = |(i, value): (usize, &f32)| {
        if outline.get(i) == Some(&true) {
            let [r, g, b] = OUTLINE;
            return Color32::from_rgb(r, g, b);
        }
        if value.is_nan() {
            return Color32::BLACK;
        }
        Color32::from_gray((((value - lo) / width).clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
    };
    let size = size.map(|side| side as usize);
    ColorImage::new(size, values.iter().enumerate().map(pixel).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutaway_core::glam::UVec3;
    use cutaway_core::volume::{Geometry, Rescale};

    fn volume() -> Volume {
        let voxels: Vec<u8> = (0..64).map(|i| i * 4).collect();
        Volume::new(UVec3::splat(4), voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE)).unwrap()
    }

    #[test]
    fn levels_follow_the_pointer_and_stay_sane() {
        let volume = volume();
        let mut slices = Slices::default();
        assert_eq!(slices.levels(&volume), [0.0, 252.0]);
        slices.drag_levels(&volume, [-0.5, 0.0]);
        let [lo, hi] = slices.levels(&volume);
        assert!(hi - lo < 252.0 && (lo + hi - 252.0).abs() < 1e-9);
        // Down lowers the level, as it does in the image.
        slices.drag_levels(&volume, [0.0, 0.25]);
        let [lower, upper] = slices.levels(&volume);
        assert!(lower < lo && (upper - lower - (hi - lo)).abs() < 1e-9);
        for drag in [[9.0, 9.0], [-99.0, 0.0], [0.0, -99.0]] {
            (0..50).for_each(|_| slices.drag_levels(&volume, drag));
            let [lo, hi] = slices.levels(&volume);
            assert!(lo < hi && lo.is_finite() && hi.is_finite(), "{lo} {hi}");
        }
    }

    #[test]
    fn the_crosshair_stays_within_the_volume() {
        let volume = volume();
        let mut slices = Slices::default();
        slices.move_crosshair(&volume, DVec3::new(-5.0, 1.5, 99.0));
        assert_eq!(slices.crosshair(&volume), DVec3::new(0.0, 1.5, 3.0));
    }

    #[test]
    fn outlines_lie_over_grey_values() {
        let image = gray(&[0.0, 5.0, 10.0, f32::NAN], &[false, false, false, true], [2, 2], [0.0, 10.0]);
        let [r, g, b] = OUTLINE;
        let expected = [Color32::BLACK, Color32::from_gray(128), Color32::WHITE, Color32::from_rgb(r, g, b)];
        assert_eq!(image.pixels, expected);
    }
}
