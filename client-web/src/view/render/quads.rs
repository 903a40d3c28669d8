//! The quad pipelines: solid quads use premultiplied alpha, where alpha 0 adds light; particles use one sprite
//! and the same blending, with alpha 0 on dark ground (A3.4, A3.5, A3.6).

use super::buffers::VertexStore;
use super::shared::{self, PipelineParts, SharedBindings};
use crate::view::draw::{ParticleVertex, SolidVertex, sprite};
use bytemuck::Pod;
use std::ops::Range;

/// Pipeline and vertices for one kind of quad.
pub struct QuadPass {
    pipeline: wgpu::RenderPipeline,
    vertices: VertexStore,
    /// The texture of the quads and its bind group, if they use one.
    pub sprite: Option<(wgpu::Texture, wgpu::BindGroup)>,
}

impl QuadPass {
    /// Creates the pipeline for everything except ground and particles.
    pub fn solids(
        device: &wgpu::Device,
        shared: &SharedBindings,
        format: wgpu::TextureFormat,
    ) -> QuadPass {
        let attributes = wgpu::vertex_attr_array![
            0 => Float32x2, 1 => Float32x2, 2 => Float32x2, 3 => Float32x2,
            4 => Unorm8x4, 5 => Unorm8x4, 6 => Uint32,
        ];
        let parts = PipelineParts {
            label: "solids",
            shader: include_bytes!(concat!(env!("OUT_DIR"), "/solid.naga")),
            groups: &[Some(&shared.layout)],
            vertices: &[Some(vertex_layout::<SolidVertex>(&attributes))],
            format,
            blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
        };
        let vertices = VertexStore::new("solids");
        QuadPass { pipeline: shared::pipeline(device, parts), vertices, sprite: None }
    }

    /// Creates the pipeline for particles and uploads their sprite.
    pub fn particles(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        shared: &SharedBindings,
        format: wgpu::TextureFormat,
    ) -> QuadPass {
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("particles"),
            entries: &[shared::texture_entry(0), shared::sampler_entry(1)],
        });
        let texture = shared::texture(device, "particle sprite", sprite::SIDE as u32);
        shared::write_texture(queue, &texture, &sprite::particle_texels());
        let attributes = wgpu::vertex_attr_array![0 => Float32x2, 1 => Float32, 2 => Float32x3];
        let parts = PipelineParts {
            label: "particles",
            shader: include_bytes!(concat!(env!("OUT_DIR"), "/particle.naga")),
            groups: &[Some(&shared.layout), Some(&layout)],
            vertices: &[Some(vertex_layout::<ParticleVertex>(&attributes))],
            format,
            blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
        };
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let sampler = shared::sampler(device);
        let group = shared::bind_group(
            device,
            &layout,
            "particles",
            &[wgpu::BindingResource::TextureView(&view), wgpu::BindingResource::Sampler(&sampler)],
        );
        let vertices = VertexStore::new("particles");
        let sprite = Some((texture, group));
        QuadPass { pipeline: shared::pipeline(device, parts), vertices, sprite }
    }

    /// Uploads the vertices of a frame.
    pub fn upload<V: Pod>(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, vertices: &[V]) {
        self.vertices.write(device, queue, bytemuck::cast_slice(vertices));
    }

    /// Draws a range of the quads.
    pub fn record(&self, pass: &mut wgpu::RenderPass, quads: Range<usize>) {
        if quads.is_empty() {
            return;
        }
        pass.set_pipeline(&self.pipeline);
        if let Some((_, group)) = &self.sprite {
            pass.set_bind_group(1, group, &[]);
        }
        self.vertices.draw(pass, quads);
    }
}

fn vertex_layout<V>(attributes: &[wgpu::VertexAttribute]) -> wgpu::VertexBufferLayout<'_> {
    wgpu::VertexBufferLayout {
        array_stride: size_of::<V>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes,
    }
}
