//! What lies over the picture: the volume's box, an orientation cube with the letters of a patient's sides, a scale bar.

use cutaway_core::glam::DVec3;
use cutaway_core::space::WorldFrame;
use cutaway_core::volume::Volume;
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, Vec2};

use super::Projection;
use crate::document::notes::Overlays;

/// Half the cube's edge in points of the window.
const CUBE: f32 = 22.0;

/// Where the cube's middle is, from the lower left corner.
const CUBE_AT: Vec2 = Vec2::new(52.0, -56.0);

impl Overlays {
    /// Draws what is switched on. `ink` stands out against the background.
    pub fn paint(
        &self,
        painter: &Painter,
        projection: &Projection,
        volume: &Volume,
        focal: DVec3,
        ink: Color32,
    ) {
        if self.bounding_box {
            paint_box(painter, projection, volume, ink);
        }
        if self.orientation_cube {
            paint_cube(painter, projection, volume.geometry().frame, ink);
        }
        if self.scale_bar {
            paint_scale(painter, projection, volume.geometry().frame, focal, ink);
        }
    }
}

fn paint_box(painter: &Painter, projection: &Projection, volume: &Volume, ink: Color32) {
    let corners = volume.corners_in_world();
    for a in 0..8usize {
        for axis in 0..3 {
            let b = a | 1 << axis;
            if b == a {
                continue;
            }
            if let (Some(p), Some(q)) = (projection.point(corners[a]), projection.point(corners[b])) {
                painter.line_segment([p, q], Stroke::new(1.0, ink.gamma_multiply(0.5)));
            }
        }
    }
}

/// The faces of the cube: direction in the world, letter of a patient's side, letter of an axis.
const FACES: [(DVec3, &str, &str); 6] = [
    (DVec3::X, "R", "+x"),
    (DVec3::NEG_X, "L", "-x"),
    (DVec3::Y, "A", "+y"),
    (DVec3::NEG_Y, "P", "-y"),
    (DVec3::Z, "S", "+z"),
    (DVec3::NEG_Z, "I", "-z"),
];

fn paint_cube(painter: &Painter, projection: &Projection, frame: WorldFrame, ink: Color32) {
    let [right, up, forward] = projection.axes();
    let middle = projection.rect().left_bottom() + CUBE_AT;
    let flat = |p: DVec3| middle + Vec2::new(p.dot(right) as f32, -p.dot(up) as f32) * CUBE;
    let mut faces: Vec<_> = FACES.iter().map(|face| (face, -face.0.dot(forward))).collect();
    // Only what looks this way, the frontmost last.
    faces.retain(|(_, facing)| *facing > 0.02);
    faces.sort_by(|a, b| a.1.total_cmp(&b.1));
    for ((normal, letter, axis), facing) in faces {
        let (u, v) = (normal.yzx(), normal.zxy());
        let corners = [u + v, u - v, -u - v, v - u].map(|offset| flat(*normal + offset));
        let light = 0.25 + 0.5 * facing as f32;
        let fill = Color32::from_rgba_unmultiplied(120, 140, 170, (light * 255.0) as u8);
        let stroke = Stroke::new(1.0, ink.gamma_multiply(0.7));
        painter.add(Shape::convex_polygon(corners.to_vec(), fill, stroke));
        if facing > 0.25 {
            let text = if frame == WorldFrame::Ras { letter } else { axis };
            painter.text(flat(*normal), Align2::CENTER_CENTER, text, FontId::proportional(13.0), ink);
        }
    }
}

trait Cycled {
    fn yzx(self) -> Self;
    fn zxy(self) -> Self;
}

impl Cycled for DVec3 {
    fn yzx(self) -> Self {
        Self::new(self.y, self.z, self.x)
    }

    fn zxy(self) -> Self {
        Self::new(self.z, self.x, self.y)
    }
}

/// The longest of 1, 2 and 5 times powers of ten that is at most `length`.
fn round_length(length: f64) -> f64 {
    let power = 10f64.powf(length.log10().floor());
    let factors = [5.0, 2.0, 1.0];
    factors.into_iter().map(|f| f * power).find(|l| *l <= length).unwrap_or(power)
}

fn paint_scale(painter: &Painter, projection: &Projection, frame: WorldFrame, focal: DVec3, ink: Color32) {
    let rect = projection.rect();
    let unit = projection.pixel_size_at(focal);
    let longest = f64::from(rect.width() * 0.25).min(160.0) * unit;
    if !(longest > 0.0 && longest.is_finite()) {
        return;
    }
    let length = round_length(longest);
    let wide = (length / unit) as f32;
    let right = rect.right_bottom() + Vec2::new(-16.0, -18.0);
    let left = right - Vec2::new(wide, 0.0);
    let tick = Vec2::new(0.0, 5.0);
    let stroke = Stroke::new(1.5, ink);
    painter.line_segment([left, right], stroke);
    painter.line_segment([left - tick, left + tick], stroke);
    painter.line_segment([right - tick, right + tick], stroke);
    // Only where the file tells of a patient are its units known to be millimetres.
    let name = if frame == WorldFrame::Ras { "mm" } else { "units" };
    let middle = Pos2::new(0.5 * (left.x + right.x), left.y - 5.0);
    painter.text(middle, Align2::CENTER_BOTTOM, format!("{length} {name}"), FontId::proportional(12.0), ink);
}

/// Which face of the orientation cube a point of the window is on, as a direction in the world.
pub fn cube_face(projection: &Projection, at: Pos2) -> Option<DVec3> {
    let [right, up, forward] = projection.axes();
    let middle = projection.rect().left_bottom() + CUBE_AT;
    let offset = (at - middle) / CUBE;
    if !Rect::from_center_size(Pos2::ZERO, Vec2::splat(3.6)).contains(offset.to_pos2()) {
        return None;
    }
    let in_cube = right * f64::from(offset.x) - up * f64::from(offset.y);
    let hit = |normal: DVec3| {
        // Where the line of sight through the point meets the plane of the face.
        let along = (1.0 - in_cube.dot(normal)) / forward.dot(normal);
        let p = in_cube + forward * along;
        (forward.dot(normal) < -0.02 && p.abs().max_element() <= 1.0 + 1e-6).then_some(normal)
    };
    FACES.iter().find_map(|(normal, ..)| hit(*normal))
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutaway_core::camera::Camera;

    #[test]
    fn lengths_are_round() {
        let lengths = [1.0, 1.9, 2.0, 4.9, 5.0, 9.9, 37.0, 0.03].map(round_length);
        for (found, expected) in lengths.into_iter().zip([1.0, 1.0, 2.0, 2.0, 5.0, 5.0, 20.0, 0.02]) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn the_cube_is_clicked_where_its_faces_are() {
        let camera = Camera {
            position: [0.0, 10.0, 0.0],
            focal_point: [0.0; 3],
            view_up: [0.0, 0.0, 1.0],
            view_angle: 30.0,
            orthographic: None,
        };
        let rect = Rect::from_min_size(Pos2::ZERO, Vec2::splat(400.0));
        let projection = Projection::new(&camera, rect);
        let middle = rect.left_bottom() + CUBE_AT;
        assert_eq!(cube_face(&projection, middle), Some(DVec3::Y));
        assert_eq!(cube_face(&projection, middle + Vec2::splat(CUBE * 1.2)), None);
        assert_eq!(cube_face(&projection, Pos2::new(300.0, 20.0)), None);
    }
}
