//! The pipeline of particles: one sprite, blended additively (A3.4, A3.5, A3.6).

use super::buffers::VertexStore;
use super::shared::{self, PipelineParts, Shared};
use crate::view::draw::{ParticleVertex, sprite};

/// ONE, ONE on colour; the target's alpha is left alone.
const ADDITIVE: wgpu::BlendState = wgpu::BlendState {
    color: wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    },
    alpha: wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::Zero,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    },
};

/// Pipeline, sprite and vertices of particles.
pub struct ParticlePass {
    pipeline: wgpu::RenderPipeline,
    /// The one picture.
    pub sprite: wgpu::Texture,
    group: wgpu::BindGroup,
    vertices: VertexStore,
}

impl ParticlePass {
    /// Compiles the pipeline and loads the sprite.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        shared: &Shared,
        format: wgpu::TextureFormat,
    ) -> ParticlePass {
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("particles"),
            entries: &[shared::texture_entry(0), shared::sampler_entry(1)],
        });
        let sprite = shared::texture(device, "particle sprite", sprite::SIDE as u32);
        shared::write_texture(queue, &sprite, &sprite::particle_texels());
        ParticlePass {
            pipeline: pipeline(device, shared, &layout, format),
            group: sprite_group(device, &sprite, &layout),
            sprite,
            vertices: VertexStore::new("particles"),
        }
    }

    /// Sends a frame's vertices.
    pub fn upload(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        particles: &[ParticleVertex],
    ) {
        self.vertices.write(device, queue, bytemuck::cast_slice(particles));
    }

    /// Draws the first `quads` particles.
    pub fn record(&self, pass: &mut wgpu::RenderPass, quads: usize) {
        if quads > 0 {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(1, &self.group, &[]);
            self.vertices.draw(pass, 0..quads);
        }
    }
}

fn pipeline(
    device: &wgpu::Device,
    shared: &Shared,
    layout: &wgpu::BindGroupLayout,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let attributes = wgpu::vertex_attr_array![0 => Float32x2, 1 => Float32, 2 => Float32x3];
    let vertices = wgpu::VertexBufferLayout {
        array_stride: size_of::<ParticleVertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &attributes,
    };
    let parts = PipelineParts {
        label: "particles",
        shader: include_bytes!(concat!(env!("OUT_DIR"), "/particle.naga")),
        groups: &[Some(&shared.layout), Some(layout)],
        vertices: &[Some(vertices)],
        format,
        blend: Some(ADDITIVE),
    };
    shared::pipeline(device, parts)
}

fn sprite_group(
    device: &wgpu::Device,
    texture: &wgpu::Texture,
    layout: &wgpu::BindGroupLayout,
) -> wgpu::BindGroup {
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let sampler = shared::sampler(device);
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("particles"),
        layout,
        entries: &[
            wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&view),
            },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&sampler) },
        ],
    })
}
