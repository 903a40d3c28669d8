//! Parts shared by all pipelines: bind group 0 (camera and light field), and helpers to create pipelines.

use super::packed_shader::unpack;
use crate::view::draw::{DrawList, Globals, LIGHT_CELLS};
use std::borrow::Cow;

/// Bind group 0 and its resources.
pub struct SharedBindings {
    globals: wgpu::Buffer,
    /// The light emitted by glowing objects.
    pub light: wgpu::Texture,
    pub layout: wgpu::BindGroupLayout,
    /// The uniform block, the light texture and its sampler.
    pub group: wgpu::BindGroup,
}

impl SharedBindings {
    /// Creates the buffers, which have a fixed size; the light field starts dark.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> SharedBindings {
        let globals = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("globals"),
            size: size_of::<Globals>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let light = texture(device, "light", LIGHT_CELLS as u32);
        write_texture(queue, &light, &vec![0; LIGHT_CELLS * LIGHT_CELLS * 4]);
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("globals"),
            entries: &[
                wgpu::BindGroupLayoutEntry {
                    binding: 0,
                    visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                    ty: wgpu::BindingType::Buffer {
                        ty: wgpu::BufferBindingType::Uniform,
                        has_dynamic_offset: false,
                        min_binding_size: None,
                    },
                    count: None,
                },
                texture_entry(1),
                sampler_entry(2),
            ],
        });
        let view = light.create_view(&wgpu::TextureViewDescriptor::default());
        let sampler = sampler(device);
        let group = bind_group(
            device,
            &layout,
            "globals",
            &[
                globals.as_entire_binding(),
                wgpu::BindingResource::TextureView(&view),
                wgpu::BindingResource::Sampler(&sampler),
            ],
        );
        SharedBindings { globals, light, layout, group }
    }

    /// Uploads the camera and light of a frame for a target of `size` pixels.
    pub fn upload(&self, queue: &wgpu::Queue, size: [u32; 2], list: &DrawList) {
        let globals = Globals { pixels: size.map(|p| p as f32), ..list.globals };
        queue.write_buffer(&self.globals, 0, bytemuck::bytes_of(&globals));
        if list.light.lit {
            write_texture(queue, &self.light, &list.light.texels);
        }
    }
}

/// Creates a bind group with these resources, numbered from 0.
pub fn bind_group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    label: &str,
    resources: &[wgpu::BindingResource],
) -> wgpu::BindGroup {
    let numbered = (0..).zip(resources.iter().cloned());
    let entries: Vec<_> =
        numbered.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    let label = Some(label);
    device.create_bind_group(&wgpu::BindGroupDescriptor { label, layout, entries: &entries })
}

/// Creates a square RGBA texture for sampling.
pub fn texture(device: &wgpu::Device, label: &str, side: u32) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

/// Replaces all texels of an RGBA texture.
pub fn write_texture(queue: &wgpu::Queue, texture: &wgpu::Texture, texels: &[u8]) {
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(texture.width() * 4),
        rows_per_image: None,
    };
    queue.write_texture(texture.as_image_copy(), texels, layout, texture.size());
}

/// Creates a sampler with linear filtering, clamped at the border.
pub fn sampler(device: &wgpu::Device) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    })
}

pub fn texture_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty: wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    }
}

pub fn sampler_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty: wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
        count: None,
    }
}

/// The parameters that differ between pipelines.
pub struct PipelineParts<'a> {
    /// The name used in error messages.
    pub label: &'a str,
    /// A shader module from `build.rs` with entry points `vertex` and `fragment`.
    pub shader: &'a [u8],
    pub groups: &'a [Option<&'a wgpu::BindGroupLayout>],
    pub vertices: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    pub format: wgpu::TextureFormat,
    pub blend: Option<wgpu::BlendState>,
}

/// Creates a triangle pipeline without depth testing or multisampling.
pub fn pipeline(device: &wgpu::Device, parts: PipelineParts) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(parts.label),
        source: wgpu::ShaderSource::Naga(Cow::Owned(unpack(parts.shader))),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(parts.label),
        bind_group_layouts: parts.groups,
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(parts.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: parts.vertices,
        },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: parts.format,
                blend: parts.blend,
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        multiview_mask: None,
        cache: None,
    })
}
