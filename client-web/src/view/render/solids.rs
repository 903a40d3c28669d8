//! The pipeline of solid quads: premultiplied alpha, where alpha 0 adds light.

use super::buffers::VertexStore;
use super::shared::{self, PipelineParts, Shared};
use crate::view::draw::SolidVertex;
use std::ops::Range;

/// Pipeline and vertices of everything but stage and particles.
pub struct SolidPass {
    pipeline: wgpu::RenderPipeline,
    vertices: VertexStore,
}

impl SolidPass {
    /// Compiles the pipeline.
    pub fn new(device: &wgpu::Device, shared: &Shared, format: wgpu::TextureFormat) -> SolidPass {
        let attributes = wgpu::vertex_attr_array![
            0 => Float32x2, 1 => Float32x2, 2 => Float32x2, 3 => Float32x2,
            4 => Unorm8x4, 5 => Unorm8x4, 6 => Uint32,
        ];
        let layout = wgpu::VertexBufferLayout {
            array_stride: size_of::<SolidVertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &attributes,
        };
        let parts = PipelineParts {
            label: "solids",
            shader: include_bytes!(concat!(env!("OUT_DIR"), "/solid.naga")),
            groups: &[Some(&shared.layout)],
            vertices: &[Some(layout)],
            format,
            blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
        };
        SolidPass {
            pipeline: shared::pipeline(device, parts),
            vertices: VertexStore::new("solids"),
        }
    }

    /// Sends a frame's vertices.
    pub fn upload(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, solids: &[SolidVertex]) {
        self.vertices.write(device, queue, bytemuck::cast_slice(solids));
    }

    /// Draws some of the quads.
    pub fn record(&self, pass: &mut wgpu::RenderPass, quads: Range<usize>) {
        if !quads.is_empty() {
            pass.set_pipeline(&self.pipeline);
            self.vertices.draw(pass, quads);
        }
    }
}
