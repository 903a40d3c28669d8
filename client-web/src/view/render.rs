//! Draws a [`DrawList`] with wgpu: WebGL 2 in the page, Vulkan or GL natively. Each pipeline has a struct with its
//! buffers and is created only once a scene needs it.
//!
//! The target should be `Rgba8Unorm`: blending then adds displayed values, so particles saturate (A3.5) both in the
//! page and in rendered pictures. Destination alpha stays 1.

mod buffers;
#[expect(dead_code, reason = "only build.rs packs shaders")]
mod packed_shader;
mod quads;
mod shared;

use crate::view::draw::DrawList;
use buffers::QuadIndices;
use quads::QuadPass;
use shared::SharedBindings;

/// The resources that a renderer has created on its device, as a measure of a scene's cost.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Made {
    /// Names of the pipelines.
    pub pipelines: Vec<&'static str>,
    /// Names and sizes in bytes of the textures.
    pub textures: Vec<(&'static str, u64)>,
}

/// Pipelines, buffers and textures for one device.
pub struct Renderer {
    format: wgpu::TextureFormat,
    shared: SharedBindings,
    indices: QuadIndices,
    ground: wgpu::RenderPipeline,
    solids: QuadPass,
    particles: Option<QuadPass>,
}

impl Renderer {
    /// Creates a renderer for targets of `format`. Particle resources are created when needed.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        format: wgpu::TextureFormat,
    ) -> Renderer {
        let shared = SharedBindings::new(device, queue);
        Renderer {
            format,
            ground: ground_pipeline(device, &shared, format),
            solids: QuadPass::solids(device, &shared, format),
            indices: QuadIndices::new(device),
            particles: None,
            shared,
        }
    }

    /// Creates the particle resources ahead of time, so that the first explosion does not cause a stutter.
    pub fn prepare(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, particles: bool) {
        if particles && self.particles.is_none() {
            self.particles = Some(QuadPass::particles(device, queue, &self.shared, self.format));
        }
    }

    /// All pipelines and textures created so far.
    pub fn made(&self) -> Made {
        let mut made = Made {
            pipelines: vec!["ground", "solids"],
            textures: vec![("light", texel_bytes(&self.shared.light))],
        };
        if let Some((sprite, _)) = self.particles.as_ref().and_then(|pass| pass.sprite.as_ref()) {
            made.pipelines.push("particles");
            made.textures.push(("particle sprite", texel_bytes(sprite)));
        }
        made
    }

    /// Draws and submits one frame into `target`, which has `size` pixels.
    pub fn draw(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        target: &wgpu::TextureView,
        size: [u32; 2],
        list: &DrawList,
    ) {
        self.prepare(device, queue, !list.particles.is_empty());
        self.upload(device, queue, size, list);
        let mut encoder =
            device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("frame"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        self.record(&mut pass, list);
        drop(pass);
        queue.submit([encoder.finish()]);
    }

    fn upload(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        size: [u32; 2],
        list: &DrawList,
    ) {
        self.shared.upload(queue, size, list);
        self.solids.upload(device, queue, list.solids());
        if let Some(particles) = &mut self.particles {
            particles.upload(device, queue, &list.particles);
        }
        let vertices = list.solids().len().max(list.particles.len());
        self.indices.cover(device, vertices / 4);
    }

    fn record(&self, pass: &mut wgpu::RenderPass, list: &DrawList) {
        pass.set_bind_group(0, &self.shared.group, &[]);
        pass.set_pipeline(&self.ground);
        pass.draw(0..3, 0..1);

        pass.set_index_buffer(self.indices.buffer.slice(..), wgpu::IndexFormat::Uint32);
        let (overlay, end) = (list.overlay_start / 4, list.solids().len() / 4);
        self.solids.record(pass, 0..overlay);
        if let Some(particles) = &self.particles {
            particles.record(pass, 0..list.particles.len() / 4);
        }
        self.solids.record(pass, overlay..end);
    }
}

/// The size of a texture with four bytes per texel.
fn texel_bytes(texture: &wgpu::Texture) -> u64 {
    u64::from(texture.width()) * u64::from(texture.height()) * 4
}

fn ground_pipeline(
    device: &wgpu::Device,
    shared: &SharedBindings,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    shared::pipeline(
        device,
        shared::PipelineParts {
            label: "ground",
            shader: include_bytes!(concat!(env!("OUT_DIR"), "/ground.naga")),
            groups: &[Some(&shared.layout)],
            vertices: &[],
            format,
            blend: None,
        },
    )
}
