//! Rendering without a window, for pictures and tests: a software or hardware adapter, an offscreen target, and access
//! to its pixels. It requests the limits of WebGL 2, so whatever works here works in the page.
//!
//! ```no_run
//! # use jostle_client_web::{replay::player::ReplayPlayer, view::draw::DrawList};
//! # use jostle_picture::Headless;
//! # fn picture(bytes: Vec<u8>) -> Result<(), Box<dyn std::error::Error>> {
//! let mut player = ReplayPlayer::open(bytes)?;
//! player.seek(738);
//! let mut list = DrawList::new();
//! list.fill(&player.frame(player.still_view([1280, 720], 0)));
//! let picture = Headless::open()?.picture([1280, 720], &list)?;
//! # Ok(())
//! # }
//! ```

pub mod flashes;

use jostle_client_web::view::draw::DrawList;
use jostle_client_web::view::render::Renderer;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

/// The target format, the same as in the page.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Why a picture could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum HeadlessError {
    /// Neither Vulkan nor GL offers an adapter.
    #[error("found no Vulkan or GL adapter (Mesa's software drivers will do): {0}")]
    NoAdapter(wgpu::RequestAdapterError),
    /// The adapter provides no device with WebGL 2's limits.
    #[error("the adapter gives no device: {0}")]
    NoDevice(wgpu::RequestDeviceError),
    /// The adapter does not support targets as large as the picture.
    #[error("the adapter draws pictures of at most {side_max} x {side_max} pixels")]
    TooLarge {
        /// Largest width and height, pixels.
        side_max: u32,
    },
    /// The pixels could not be read back.
    #[error("reading the picture back failed: {0}")]
    ReadBack(String),
}

/// A picture in RGBA, four bytes per pixel, top row first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// `size[0] * size[1] * 4` bytes.
    pub rgba: Vec<u8>,
}

impl Picture {
    /// The pixel at a column and a row, from the top left.
    pub fn pixel(&self, x: u32, y: u32) -> [u8; 4] {
        let at = (y * self.size[0] + x) as usize * 4;
        [self.rgba[at], self.rgba[at + 1], self.rgba[at + 2], self.rgba[at + 3]]
    }

    /// Encodes the picture as a PNG file without alpha.
    pub fn png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.size[0], self.size[1]);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_compression(png::Compression::High);
        let rgb: Vec<u8> = self.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&rgb)?;
        writer.finish()?;
        Ok(bytes)
    }
}

/// A device without a window, and its renderer.
pub struct Headless {
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// The renderer; its pipelines show which resources were created.
    pub renderer: Renderer,
    /// Name of the adapter and its backend.
    pub adapter: String,
}

impl Headless {
    /// Opens the first adapter offered by Vulkan or GL.
    pub fn open() -> Result<Headless, HeadlessError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::GL;
        let instance = wgpu::Instance::new(descriptor);
        let adapter = wait(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
            .map_err(HeadlessError::NoAdapter)?;
        let limits = wgpu::Limits::downlevel_webgl2_defaults().using_resolution(adapter.limits());
        let (device, queue) = wait(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("headless"),
            required_limits: limits,
            ..Default::default()
        }))
        .map_err(HeadlessError::NoDevice)?;
        let renderer = Renderer::new(&device, &queue, FORMAT);
        let info = adapter.get_info();
        let adapter = format!("{} ({})", info.name, info.backend);
        Ok(Headless { device, queue, renderer, adapter })
    }

    /// Draws a list into a new target and reads back the pixels.
    pub fn picture(&mut self, size: [u32; 2], list: &DrawList) -> Result<Picture, HeadlessError> {
        let side_max = self.device.limits().max_texture_dimension_2d;
        if size[0] > side_max || size[1] > side_max {
            return Err(HeadlessError::TooLarge { side_max });
        }
        let target = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = target.create_view(&wgpu::TextureViewDescriptor::default());
        self.renderer.draw(&self.device, &self.queue, &view, size, list);
        self.read_back(&target)
    }

    fn read_back(&self, target: &wgpu::Texture) -> Result<Picture, HeadlessError> {
        let (width, height) = (target.width(), target.height());
        // Copied rows are padded to multiples of 256 bytes.
        let row = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row),
            rows_per_image: None,
        };
        encoder.copy_texture_to_buffer(
            target.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            target.size(),
        );
        self.queue.submit([encoder.finish()]);
        buffer.slice(..).map_async(wgpu::MapMode::Read, |_| {});
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|error| HeadlessError::ReadBack(error.to_string()))?;
        let bytes = buffer
            .slice(..)
            .get_mapped_range()
            .map_err(|error| HeadlessError::ReadBack(error.to_string()))?;
        let mut rgba = Vec::with_capacity((width * height * 4) as usize);
        for line in bytes.chunks_exact(row as usize) {
            rgba.extend_from_slice(&line[..width as usize * 4]);
        }
        Ok(Picture { size: [width, height], rgba })
    }
}

/// Waits for a wgpu future. Native ones are ready immediately.
fn wait<F: Future>(future: F) -> F::Output {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    loop {
        if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
            return output;
        }
        std::thread::yield_now();
    }
}

#[cfg(test)]
mod tests;
