//! What a mesh of tetrahedra looks like, slowly and exactly: each ray is cut by every tetrahedron that it meets, the stretches
//! are put in order, and each is integrated in small steps in double precision. What the cell renderer is held against.

use cutaway_core::camera::Ray;
use cutaway_core::field::vanishing_gradient;
use cutaway_core::glam::{DMat3, DVec3, DVec4};
use cutaway_core::image::Image;
use cutaway_core::scene::Scene;
use cutaway_core::tetrahedra::TetrahedralMesh;
use cutaway_core::transfer_function::extinction;

/// Steps of a stretch, and of one unit of optical depth at its densest end.
const STEPS: f64 = 16.0;

/// A tetrahedron, ready for rays.
struct Tetrahedron {
    /// From the world to the weights of corners 1 to 3.
    weights_from_world: DMat3,
    corner: DVec3,
    values: DVec4,
    gradients: [DVec3; 4],
}

struct Stretch<'a> {
    t_near: f64,
    t_far: f64,
    cell: &'a Tetrahedron,
}

/// The image of a mesh; the scene is one of its stand-in, unclipped.
pub fn render(mesh: &TetrahedralMesh, scene: &Scene) -> Image {
    let gradients = mesh.point_gradients();
    let cells: Vec<Tetrahedron> = mesh
        .cells()
        .iter()
        .filter_map(|four| {
            let [p, a, b, c] = four.map(|i| mesh.points()[i as usize]);
            let edges = DMat3::from_cols(a - p, b - p, c - p);
            (edges.determinant().abs() > 0.0).then(|| Tetrahedron {
                weights_from_world: edges.inverse(),
                corner: p,
                values: DVec4::from_array(four.map(|i| f64::from(mesh.values()[i as usize]))),
                gradients: four.map(|i| gradients[i as usize]),
            })
        })
        .collect();
    let (width, height) = scene.resolution();
    let rays = scene.camera().rays(width, height);
    let pixels = (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| pixel(&cells, rays.pixel(x, y), scene))
        .collect();
    Image::new(width, height, pixels).expect("a pixel a ray")
}

fn pixel(cells: &[Tetrahedron], ray: Ray, scene: &Scene) -> [f32; 4] {
    let mut stretches: Vec<Stretch> = cells.iter().filter_map(|cell| cell.stretch(&ray)).collect();
    stretches.sort_by(|a, b| (a.t_near + a.t_far).total_cmp(&(b.t_near + b.t_far)));
    let (mut color, mut through) = (DVec3::ZERO, 1.0);
    for stretch in stretches {
        let steps = stretch.steps(&ray, scene);
        let length = (stretch.t_far - stretch.t_near) / steps;
        for step in 0..steps as u32 {
            let t = stretch.t_near + (f64::from(step) + 0.5) * length;
            let weights = stretch.cell.weights(ray.origin + ray.direction * t);
            let (straight, opacity) = scene.transfer_function().evaluate(weights.dot(stretch.cell.values));
            let alpha = -f64::exp_m1(-extinction(opacity, scene.unit_distance()) * length);
            let lit = lit(DVec3::from_array(straight), stretch.cell, weights, &ray, scene);
            color += through * alpha * lit;
            through *= 1.0 - alpha;
        }
    }
    [color.x as f32, color.y as f32, color.z as f32, (1.0 - through) as f32]
}

impl Tetrahedron {
    /// Of the four corners, at a point of the world.
    fn weights(&self, p: DVec3) -> DVec4 {
        let w = self.weights_from_world * (p - self.corner);
        DVec4::new(1.0 - w.element_sum(), w.x, w.y, w.z)
    }

    /// Where a ray is inside: where none of the weights is negative.
    fn stretch(&self, ray: &Ray) -> Option<Stretch<'_>> {
        let at = self.weights(ray.origin);
        let slope = self.weights(ray.origin + ray.direction) - at;
        let (mut t_near, mut t_far) = (0.0f64, f64::INFINITY);
        for k in 0..4 {
            let t = -at[k] / slope[k];
            if slope[k] > 0.0 {
                t_near = t_near.max(t);
            } else if slope[k] < 0.0 {
                t_far = t_far.min(t);
            } else if at[k] < 0.0 {
                return None;
            }
        }
        (t_near < t_far && t_far.is_finite()).then_some(Stretch { t_near, t_far, cell: self })
    }
}

impl Stretch<'_> {
    /// So many that the midpoint rule is off by less than anything that is compared with it.
    fn steps(&self, ray: &Ray, scene: &Scene) -> f64 {
        let value = |t: f64| self.cell.weights(ray.origin + ray.direction * t).dot(self.cell.values);
        let (a, b) = (value(self.t_near), value(self.t_far));
        let opacity = scene.transfer_function().max_opacity(a.min(b), a.max(b));
        let depth = extinction(opacity, scene.unit_distance()) * (self.t_far - self.t_near);
        if depth == 0.0 { 0.0 } else { (STEPS * (1.0 + depth)).ceil() }
    }
}

fn lit(color: DVec3, cell: &Tetrahedron, weights: DVec4, ray: &Ray, scene: &Scene) -> DVec3 {
    if !scene.is_shaded() {
        return color;
    }
    let gradient: DVec3 = (0..4).map(|k| cell.gradients[k] * weights[k]).sum();
    let (l, h) = scene.lighting().directions(ray.direction);
    let (factor, white) = scene.lighting().terms(gradient, vanishing_gradient(scene.volume()), l, h);
    color * factor + white
}
