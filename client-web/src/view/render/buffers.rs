//! Growing buffers: a vertex buffer per pipeline, rewritten every frame, and an index buffer for quads, which changes
//! only when it grows.

use std::ops::Range;

/// A vertex buffer that holds the current frame's vertices.
pub struct VertexStore {
    label: &'static str,
    buffer: Option<wgpu::Buffer>,
}

impl VertexStore {
    /// Creates an empty store; memory is allocated on first use.
    pub fn new(label: &'static str) -> VertexStore {
        VertexStore { label, buffer: None }
    }

    /// Replaces the contents, growing by doubling.
    pub fn write(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        let wanted = bytes.len() as u64;
        if self.buffer.as_ref().is_none_or(|buffer| buffer.size() < wanted) {
            self.buffer = Some(device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(self.label),
                size: wanted.next_power_of_two().max(16 * 1024),
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }));
        }
        if let Some(buffer) = &self.buffer {
            queue.write_buffer(buffer, 0, bytes);
        }
    }

    /// Draws some of the quads with the current index buffer.
    pub fn draw(&self, pass: &mut wgpu::RenderPass, quads: Range<usize>) {
        if let Some(buffer) = &self.buffer {
            pass.set_vertex_buffer(0, buffer.slice(..));
            pass.draw_indexed(quads.start as u32 * 6..quads.end as u32 * 6, 0, 0..1);
        }
    }
}

/// Indices of two triangles per quad of four vertices.
pub struct QuadIndices {
    /// Six 32-bit indices per quad.
    pub buffer: wgpu::Buffer,
    quads: usize,
}

impl QuadIndices {
    /// Creates indices for a typical scene.
    pub fn new(device: &wgpu::Device) -> QuadIndices {
        let quads = 4096;
        QuadIndices { buffer: index_buffer(device, quads), quads }
    }

    /// Grows to cover at least this many quads.
    pub fn cover(&mut self, device: &wgpu::Device, quads: usize) {
        if quads > self.quads {
            self.quads = quads.next_power_of_two();
            self.buffer = index_buffer(device, self.quads);
        }
    }
}

fn index_buffer(device: &wgpu::Device, quads: usize) -> wgpu::Buffer {
    let indices: Vec<u32> = (0..quads as u32)
        .flat_map(|quad| [0, 1, 2, 2, 1, 3].map(|corner| quad * 4 + corner))
        .collect();
    let bytes: &[u8] = bytemuck::cast_slice(&indices);
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("quad indices"),
        size: bytes.len() as u64,
        usage: wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: true,
    });
    buffer
        .get_mapped_range_mut(..)
        .expect("a buffer mapped at creation is mapped as a whole")
        .copy_from_slice(bytes);
    buffer.unmap();
    buffer
}
