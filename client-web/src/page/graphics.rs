//! The canvas and what draws on it. The context is made before wgpu asks for one, because only so
//! can it be opaque; a lost context is answered by building everything anew.

use super::dom;
use crate::draw::DrawList;
use crate::frame::Frame;
use crate::render::{Made, Renderer};
use jostle_sim::scene::Plan;
use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};
use wasm_bindgen::{JsCast, JsValue};
use web_sys::HtmlCanvasElement;

/// Blending is specified on encoded values, so the format must not convert.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Device pixels a CSS pixel beyond which sharper drawing is not seen.
const PIXEL_RATIO_MAX: f64 = 3.0;

/// Everything that draws.
pub struct Graphics {
    canvas: HtmlCanvasElement,
    surface: wgpu::Surface<'static>,
    device: wgpu::Device,
    queue: wgpu::Queue,
    configuration: wgpu::SurfaceConfiguration,
    renderer: Renderer,
    list: DrawList,
}

impl Graphics {
    /// Sets up drawing on the page's canvas; `None` without WebGL 2.
    pub fn new(keep_pixels: bool) -> Option<Graphics> {
        let canvas: HtmlCanvasElement = dom::by_id("stage");
        claim_context(&canvas, keep_pixels)?;
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::GL,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let surface = instance.create_surface(wgpu::SurfaceTarget::Canvas(canvas.clone())).ok()?;
        let adapter = now(instance.request_adapter(&wgpu::RequestAdapterOptions {
            compatible_surface: Some(&surface),
            ..Default::default()
        }))?
        .ok()?;
        let limits = wgpu::Limits::downlevel_webgl2_defaults().using_resolution(adapter.limits());
        let (device, queue) = now(adapter.request_device(&wgpu::DeviceDescriptor {
            required_limits: limits,
            ..Default::default()
        }))?
        .ok()?;
        let mut configuration = surface.get_default_config(&adapter, 1, 1)?;
        configuration.format = FORMAT;
        configuration.view_formats.clear();
        let renderer = Renderer::new(&device, &queue, FORMAT);
        Some(Graphics {
            canvas,
            surface,
            device,
            queue,
            configuration,
            renderer,
            list: DrawList::default(),
        })
    }

    /// Fits the drawing to the canvas's place on the page, with a share of its device pixels; the
    /// size in pixels, or `None` while it has none.
    pub fn fit(&mut self, share: f64) -> Option<[u32; 2]> {
        let ratio = dom::window().device_pixel_ratio().clamp(0.5, PIXEL_RATIO_MAX) * share;
        let side_max = f64::from(self.device.limits().max_texture_dimension_2d);
        let pixels = |css: i32| (f64::from(css) * ratio).round().min(side_max) as u32;
        let size = [pixels(self.canvas.client_width()), pixels(self.canvas.client_height())];
        if size.contains(&0) {
            return None;
        }
        if size != [self.configuration.width, self.configuration.height] {
            [self.configuration.width, self.configuration.height] = size;
            self.surface.configure(&self.device, &self.configuration);
        }
        Some(size)
    }

    /// Makes what a scene needs and is not there yet; what an earlier scene needed stays.
    pub fn prepare(&mut self, plan: &Plan) {
        self.renderer.prepare(&self.device, &self.queue, plan.into());
    }

    /// What has been made so far.
    pub fn made(&self) -> Made {
        self.renderer.made()
    }

    /// Draws one frame of the size that `fit` gave; `false` if there was nothing to draw on.
    pub fn draw(&mut self, frame: &Frame) -> bool {
        use wgpu::CurrentSurfaceTexture::{Suboptimal, Success};
        let (Success(texture) | Suboptimal(texture)) = self.surface.get_current_texture() else {
            return false;
        };
        let view = texture.texture.create_view(&wgpu::TextureViewDescriptor::default());
        self.list.fill(frame);
        let size = [self.configuration.width, self.configuration.height];
        self.renderer.draw(&self.device, &self.queue, &view, size, &self.list);
        self.queue.present(texture);
        true
    }
}

/// Makes the canvas's context with the attributes that wgpu does not ask for: it gets this one.
fn claim_context(canvas: &HtmlCanvasElement, keep_pixels: bool) -> Option<()> {
    let attributes = js_sys::Object::new();
    let wanted = [
        ("alpha", false),
        ("antialias", false),
        ("depth", false),
        ("preserveDrawingBuffer", keep_pixels),
    ];
    for (name, value) in wanted {
        js_sys::Reflect::set(&attributes, &name.into(), &JsValue::from_bool(value)).ok()?;
    }
    let context = canvas.get_context_with_context_options("webgl2", &attributes).ok()??;
    context.is_object().then_some(())
}

/// The result of a future that is ready at once, as wgpu's are on WebGL.
fn now<F: Future>(future: F) -> Option<F::Output> {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(output) => Some(output),
        Poll::Pending => None,
    }
}

/// Calls `lost` and `restored` when the canvas's context goes and comes back.
pub fn watch_context(lost: impl Fn() + 'static, restored: impl Fn() + 'static) {
    let canvas: HtmlCanvasElement = dom::by_id("stage");
    dom::listen_active(canvas.unchecked_ref(), "webglcontextlost", move |event: web_sys::Event| {
        // Without this the browser would not give it back.
        event.prevent_default();
        lost();
    });
    dom::listen(canvas.unchecked_ref(), "webglcontextrestored", move |_: web_sys::Event| {
        restored();
    });
}
