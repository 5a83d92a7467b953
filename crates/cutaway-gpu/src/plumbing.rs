//! wgpu's long descriptors, each written once: layouts, bind groups, pipelines, constants of shaders.

pub(crate) const COMPUTE: wgpu::ShaderStages = wgpu::ShaderStages::COMPUTE;
pub(crate) const VERTEX: wgpu::ShaderStages = wgpu::ShaderStages::VERTEX;
pub(crate) const FRAGMENT: wgpu::ShaderStages = wgpu::ShaderStages::FRAGMENT;

/// A uniform buffer.
pub(crate) const UNIFORM: wgpu::BindingType = buffer(wgpu::BufferBindingType::Uniform);

/// A storage buffer.
pub(crate) const fn storage(read_only: bool) -> wgpu::BindingType {
    buffer(wgpu::BufferBindingType::Storage { read_only })
}

const fn buffer(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

/// A texture that is not multisampled.
pub(crate) const fn texture(
    sample_type: wgpu::TextureSampleType,
    view_dimension: wgpu::TextureViewDimension,
) -> wgpu::BindingType {
    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false }
}

/// A texture of floats that is not multisampled.
pub(crate) const fn floats(
    filterable: bool,
    view_dimension: wgpu::TextureViewDimension,
) -> wgpu::BindingType {
    texture(wgpu::TextureSampleType::Float { filterable }, view_dimension)
}

/// A sampler, of what can be filtered or of what cannot.
pub(crate) const fn sampler(filterable: bool) -> wgpu::BindingType {
    wgpu::BindingType::Sampler(if filterable {
        wgpu::SamplerBindingType::Filtering
    } else {
        wgpu::SamplerBindingType::NonFiltering
    })
}

/// A truth as a shader's constant.
pub(crate) fn flag(on: bool) -> f64 {
    f64::from(u8::from(on))
}

/// The layout of a bind group.
pub(crate) fn group_layout(
    device: &wgpu::Device,
    label: &str,
    bindings: &[(u32, wgpu::ShaderStages, wgpu::BindingType)],
) -> wgpu::BindGroupLayout {
    let entries: Vec<wgpu::BindGroupLayoutEntry> = bindings
        .iter()
        .map(|&(binding, visibility, ty)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None })
        .collect();
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// The same for bindings from 0 on that one stage sees.
pub(crate) fn group_layout_of(
    device: &wgpu::Device,
    label: &str,
    stage: wgpu::ShaderStages,
    types: &[wgpu::BindingType],
) -> wgpu::BindGroupLayout {
    let bindings: Vec<_> = (0u32..).zip(types).map(|(binding, ty)| (binding, stage, *ty)).collect();
    group_layout(device, label, &bindings)
}

/// Binds resources, each at its binding.
pub(crate) fn bind(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: &[(u32, wgpu::BindingResource)],
) -> wgpu::BindGroup {
    let entries: Vec<wgpu::BindGroupEntry> = resources
        .iter()
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding: *binding, resource: resource.clone() })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// Binds resources at the bindings from 0 on.
pub(crate) fn bind_in_order(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource],
) -> wgpu::BindGroup {
    let resources: Vec<_> = (0u32..).zip(resources.iter().cloned()).collect();
    bind(device, layout, &resources)
}

/// Binds buffers at the bindings from 0 on.
pub(crate) fn bind_buffers(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    buffers: &[&wgpu::Buffer],
) -> wgpu::BindGroup {
    let resources: Vec<_> = buffers.iter().map(|buffer| buffer.as_entire_binding()).collect();
    bind_in_order(device, layout, &resources)
}

/// The layout of a pipeline.
pub(crate) fn pipeline_layout(
    device: &wgpu::Device,
    label: &str,
    groups: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::PipelineLayout {
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: groups,
        immediate_size: 0,
    })
}

/// A pipeline of a compute shader's entry point.
pub(crate) fn compute_pipeline(
    device: &wgpu::Device,
    shader: &wgpu::ShaderModule,
    entry: &str,
    groups: &[Option<&wgpu::BindGroupLayout>],
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: Some(&pipeline_layout(device, entry, groups)),
        module: shader,
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
        cache: None,
    })
}

/// A pipeline that draws without vertex buffers, depth or multisampling.
pub(crate) fn render_pipeline(
    device: &wgpu::Device,
    shader: &wgpu::ShaderModule,
    [vertex, fragment]: [&str; 2],
    drawn: &RenderSetup,
) -> wgpu::RenderPipeline {
    let layout = pipeline_layout(device, drawn.label, drawn.groups);
    let compilation = wgpu::PipelineCompilationOptions { constants: drawn.constants, ..Default::default() };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(drawn.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some(vertex),
            compilation_options: compilation.clone(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: shader,
            entry_point: Some(fragment),
            compilation_options: compilation,
            targets: drawn.targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// What a [`render_pipeline`] is bound to, and draws into.
pub(crate) struct RenderSetup<'a> {
    pub(crate) label: &'a str,
    pub(crate) groups: &'a [Option<&'a wgpu::BindGroupLayout>],
    pub(crate) constants: &'a [(&'a str, f64)],
    pub(crate) targets: &'a [Option<wgpu::ColorTargetState>],
}
