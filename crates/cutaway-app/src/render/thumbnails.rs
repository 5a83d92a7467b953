//! Small pictures of the open volume, one for each preset and colour map, made in the background.
//!
//! What enters: names that a list shows. What leaves: textures, when they are there. A worker thread renders them one after the
//! other with the CPU engine from a coarse copy of the volume, so that they cost a fraction of a second altogether and a few
//! megabytes, whatever the volume. Another volume empties the queue and ends the thread at its next picture; so does dropping.

use std::collections::{HashMap, HashSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Weak};
use std::thread;

use cutaway_core::glam::{DAffine3, UVec3};
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{Engine, Layer, Mode, RenderSettings, Scene, default_camera};
use cutaway_core::volume::{Geometry, Volume};
use cutaway_core::{histogram, presets, with_voxels};
use cutaway_engine::{Renderer, Request, Setup};
use egui::{Color32, ColorImage, Context, TextureHandle, TextureOptions};

use crate::document::OpenVolume;
use crate::function;

/// Width and height of a thumbnail in pixels.
pub const SIZE: u32 = 64;

/// Voxels along an axis of the coarse copy, at most: more than a thumbnail can show.
const COARSE: u32 = 96;

/// Something that a thumbnail shows.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Subject {
    /// A preset, by its name.
    Preset(String),
    /// The volume's default function in the colours of a map, by its name.
    Colormap(String),
}

/// Thumbnails of one volume.
#[derive(Default)]
pub struct Thumbnails {
    textures: HashMap<Subject, TextureHandle>,
    wanted: HashSet<Subject>,
    volume: Weak<OpenVolume>,
    worker: Option<Worker>,
}

impl std::fmt::Debug for Thumbnails {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Thumbnails").field("wanted", &self.wanted).finish_non_exhaustive()
    }
}

/// A thread that makes thumbnails of one volume until nobody wants any more.
struct Worker {
    wanted: Sender<Subject>,
    made: Receiver<(Subject, ColorImage)>,
    cancel: Arc<AtomicBool>,
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.cancel.store(true, Ordering::Relaxed);
    }
}

impl Thumbnails {
    /// Says which volume is open: once a frame, before the others. Forgets what shows another one, and takes what was made.
    pub fn see(&mut self, volume: &Arc<OpenVolume>, context: &Context) {
        if !std::ptr::eq(self.volume.as_ptr(), Arc::as_ptr(volume)) {
            *self = Self { volume: Arc::downgrade(volume), ..Self::default() };
        }
        let Some(worker) = &self.worker else { return };
        for (subject, image) in worker.made.try_iter() {
            let texture = context.load_texture(format!("{subject:?}"), image, TextureOptions::LINEAR);
            self.textures.insert(subject, texture);
        }
    }

    /// The thumbnail, if it was made.
    pub fn get(&self, subject: &Subject) -> Option<&TextureHandle> {
        self.textures.get(subject)
    }

    /// Asks for a thumbnail; asking again does nothing.
    pub fn want(&mut self, subject: &Subject, context: &Context) {
        if self.wanted.contains(subject) {
            return;
        }
        self.wanted.insert(subject.clone());
        let Some(volume) = self.volume.upgrade() else { return };
        let worker = self.worker.get_or_insert_with(|| Worker::new(volume, context.clone()));
        // A worker that could not begin leaves its list without pictures.
        let _ = worker.wanted.send(subject.clone());
    }
}

impl Worker {
    fn new(volume: Arc<OpenVolume>, context: Context) -> Self {
        let (wanted, subjects) = channel();
        let (images, made) = channel();
        let cancel = Arc::new(AtomicBool::new(false));
        let cancelled = cancel.clone();
        // Lists are as good without pictures: a system that gives no more threads is no error.
        let _ = thread::Builder::new().name("thumbnails".to_owned()).spawn(move || {
            let Some(mut studio) = Studio::new(volume.lattice()) else { return };
            // The copy is all that is needed: a volume that is closed meanwhile is freed.
            drop(volume);
            for subject in subjects {
                if cancelled.load(Ordering::Relaxed) {
                    return;
                }
                // What cannot be pictured stays without a picture.
                let Some(image) = studio.picture(&subject) else { continue };
                if images.send((subject, image)).is_err() {
                    return;
                }
                context.request_repaint();
            }
        });
        Self { wanted, made, cancel }
    }
}

/// A coarse copy of a volume, ready to be rendered.
struct Studio {
    renderer: Renderer,
    volume: Arc<Volume>,
}

impl Studio {
    fn new(volume: &Volume) -> Option<Self> {
        let volume = coarse(volume, COARSE)?;
        // One thread: the picture itself has the others.
        let renderer = Renderer::new(Setup { threads: 1, ..Setup::default() });
        Some(Self { renderer, volume: Arc::new(volume) })
    }

    fn picture(&mut self, subject: &Subject) -> Option<ColorImage> {
        let volume = &self.volume;
        let engine = Engine::Cpu;
        let settings = RenderSettings { engine, resolution: [SIZE; 2], ..RenderSettings::default() };
        let (function, unit, mode, shade) = match subject {
            Subject::Preset(name) => {
                let preset = presets::by_name(name)?;
                (preset.transfer_function(volume), preset.unit_distance(), preset.mode, preset.shade)
            }
            Subject::Colormap(name) => {
                let plain = histogram::default_for_mode(volume, Mode::Composite);
                (function::with_colormap(&plain, name, volume.value_range())?, None, Mode::Composite, true)
            }
        };
        let settings = RenderSettings { mode, ..settings };
        let lighting = Lighting { shade, ..Lighting::default() };
        let mut camera = default_camera(volume, 1.0);
        // Corners of the box, which are mostly empty, may be outside.
        camera.zoom(1.35);
        let scene = Scene::new(
            Layer::new(volume, &function).with_unit_distance(unit).with_lighting(lighting),
            camera,
            settings,
        )
        .ok()?;
        let image = self.renderer.render(&scene, &Request::default()).ok()?.picture.into_image()?;
        let byte = |c: f32| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let pixel = |p: &[f32; 4]| {
            let [r, g, b, a] = p.map(byte);
            // Highlights may be brighter than their opacity.
            Color32::from_rgba_premultiplied(r.min(a), g.min(a), b.min(a), a)
        };
        let size = [SIZE as usize; 2];
        Some(ColorImage::new(size, image.pixels().iter().map(pixel).collect()))
    }
}

/// Every so many voxels of a volume, so that no axis has more than `most`; none of a volume that has no inside.
fn coarse(volume: &Volume, most: u32) -> Option<Volume> {
    let size = volume.dimensions();
    let stride = UVec3::from_array(size.to_array().map(|n| n.div_ceil(most).max(1)));
    // At least two a side, as a volume needs.
    let count = |n: u32, stride: u32| (n - 1) / stride + 1;
    let dimensions = UVec3::new(count(size.x, stride.x), count(size.y, stride.y), count(size.z, stride.z));
    if dimensions.min_element() < 2 {
        return None;
    }
    let geometry = Geometry {
        world_from_voxel: *volume.world_from_voxel() * DAffine3::from_scale(stride.as_dvec3()),
        frame: volume.geometry().frame,
    };
    let picked = |x: u32, y: u32, z: u32| {
        let [x, y, z] = [x * stride.x, y * stride.y, z * stride.z].map(|i| i as usize);
        x + size.x as usize * (y + size.y as usize * z)
    };
    let order = || {
        (0..dimensions.z)
            .flat_map(move |z| (0..dimensions.y).flat_map(move |y| (0..dimensions.x).map(move |x| (x, y, z))))
    };
    with_voxels!(volume.voxels(), voxels => {
        let picked = order().map(|(x, y, z)| voxels[picked(x, y, z)]).collect::<Vec<_>>();
        Volume::new(dimensions, picked, volume.rescale(), geometry).ok()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutaway_core::glam::DVec3;
    use cutaway_core::volume::Rescale;
    use std::time::{Duration, Instant};

    fn open(name: &str) -> Arc<OpenVolume> {
        Arc::new(OpenVolume::read(name).unwrap())
    }

    fn waited(thumbnails: &mut Thumbnails, volume: &Arc<OpenVolume>, subject: &Subject) -> bool {
        let context = Context::default();
        let until = Instant::now() + Duration::from_secs(60);
        while thumbnails.get(subject).is_none() && Instant::now() < until {
            thread::sleep(Duration::from_millis(5));
            thumbnails.see(volume, &context);
        }
        thumbnails.get(subject).is_some()
    }

    #[test]
    fn thumbnails_are_made_when_they_are_wanted_and_forgotten_with_the_volume() {
        let (first, second) = (open("sample:sphere:24"), open("sample:marschner-lobb:24"));
        let context = Context::default();
        let mut thumbnails = Thumbnails::default();
        let preset = Subject::Preset("MR-Default".to_owned());
        let map = Subject::Colormap("viridis".to_owned());
        thumbnails.see(&first, &context);
        thumbnails.want(&preset, &context);
        thumbnails.want(&Subject::Preset("none of these".to_owned()), &context);
        thumbnails.want(&map, &context);
        assert!(waited(&mut thumbnails, &first, &preset) && waited(&mut thumbnails, &first, &map));
        assert_eq!(thumbnails.get(&map).unwrap().size(), [SIZE as usize; 2]);
        thumbnails.see(&second, &context);
        assert!(thumbnails.get(&preset).is_none());
        thumbnails.want(&preset, &context);
        assert!(waited(&mut thumbnails, &second, &preset));
    }

    #[test]
    fn pictures_show_something() {
        let volume = open("sample:sphere:40");
        let mut studio = Studio::new(volume.lattice()).unwrap();
        for subject in [Subject::Preset("MR-MIP".into()), Subject::Colormap("hot".into())] {
            let image = studio.picture(&subject).unwrap();
            let shown = image.pixels.iter().filter(|p| p.a() > 20).count();
            assert!(shown > 200 && shown < 64 * 64, "{subject:?}: {shown}");
        }
    }

    #[test]
    fn a_coarse_copy_lies_where_the_volume_does() {
        let size = UVec3::new(5, 2, 3);
        let voxels: Vec<i16> = (0..30).map(|i| i - 10).collect();
        let geometry = Geometry::from_spacing(DVec3::new(1.0, 2.0, 3.0));
        let volume = Volume::new(size, voxels, Rescale::IDENTITY, geometry).unwrap();
        let copy = coarse(&volume, 3).unwrap();
        assert_eq!(copy.dimensions(), UVec3::new(3, 2, 3));
        assert_eq!(copy.spacing(), DVec3::new(2.0, 2.0, 3.0));
        for (x, y, z) in [(0, 0, 0), (2, 1, 2), (1, 0, 1)] {
            assert_eq!(copy.value_clamped(x, y, z), volume.value_clamped(2 * x, y, z));
        }
        assert_eq!(coarse(&volume, 96).unwrap().dimensions(), size);
        assert!(coarse(&volume, 1).is_none());
    }
}
