//! A device that a program draws with itself: cutaway renders on it, and the image stays there as a texture.

use cutaway::engine::{Picture, Renderer, Request, Setup};
use cutaway::gpu::{Gpu, GpuOptions};
use cutaway::prelude::*;
use cutaway::scene::Engine;

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The program's own adapter, device and queue. A window would ask for an adapter that can draw to it.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Gpu::descriptor(&adapter)))?;

    let gpu = Gpu::sharing(&adapter, device.clone(), queue.clone(), &GpuOptions::default())?;
    let mut renderer = Renderer::sharing(Setup::default(), gpu);
    let scene = Scene::of(cutaway::read("sample:sphere:32")?).engine(Engine::Raycast).resolution(160, 120);
    let request = Request { on_device: true, ..Request::default() };
    let frame = renderer.render(&scene.build()?, &request)?;

    // The texture belongs to the program's device: bind it, draw it, copy it.
    let Picture::OnDevice(texture) = frame.picture else {
        return Err("the image is not on the device".into());
    };
    assert_eq!((texture.width(), texture.height()), (160, 120));
    println!("{:?} on {:?}", texture.format(), frame.about.machine.adapter);
    Ok(())
}
