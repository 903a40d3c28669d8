//! The canvas and its graphics. The WebGL context is created before wgpu asks for one, since only then can it be
//! opaque. After a lost context everything is rebuilt.

use crate::browser;
use crate::page::app::App;
use crate::page::dom;
use crate::page::event::{Canvas, Event};
use crate::page::queue::Events;
use crate::view::draw::DrawList;
use crate::view::frame::Frame;
use crate::view::quality::Quality;
use crate::view::render::Renderer;
use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{HtmlCanvasElement, WebGl2RenderingContext};

/// Blending is specified for encoded values, so the format must not convert them.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Maximum device pixels per CSS pixel; higher resolutions make no visible difference.
const PIXEL_RATIO_MAX: f64 = 3.0;

pub struct Stage {
    events: Events,
    /// Dropped when the context is lost, and recreated with the next frame.
    pub graphics: Option<Box<Graphics>>,
    quality: Quality,
    /// Whether to draw at full resolution, no matter how long that takes (`?sharp=1`).
    sharp: bool,
    /// Whether to keep the drawn pixels for screenshots.
    keep_pixels: bool,
}

impl Stage {
    /// Creates a canvas without graphics.
    pub fn new(events: Events, sharp: bool) -> Stage {
        Stage { events, graphics: None, quality: Quality::default(), sharp, keep_pixels: false }
    }

    /// Forgets the frame rate of the previous screen.
    pub fn reset(&mut self) {
        self.quality = Quality::default();
    }

    /// The canvas for the next frame; `None` while drawing is not possible. `covered_css` gives the heights that the
    /// HUD covers at the top and bottom, CSS pixels.
    pub fn canvas(&mut self, app: &App, covered_css: [f32; 2]) -> Option<Canvas> {
        if app.screen.game().is_none()
            && app.screen.replay().is_none()
            && app.screen.edit_screen().is_none()
        {
            return None;
        }
        let in_page = app.screen.game().is_some_and(|game| game.is_in_page());
        self.keep_pixels |= in_page || app.screen.edit_screen().is_some();
        let still = match (app.screen.game(), app.screen.replay()) {
            (Some(game), _) => game.is_frozen(),
            (_, Some(replay)) => !replay.player.playing,
            _ => true,
        };
        // There is enough time to draw a still picture at full resolution.
        let full = still || self.sharp;
        let share = if full { 1.0 } else { self.quality.frame(browser::now_ms()) };
        let pixels = self.with_graphics(app, |graphics| graphics.fit(share))??;
        let [top, bottom] = covered_css.map(|css| (css / css_per_pixel(pixels)) as u32);
        let css_width = dom::html("stage").client_width().max(0) as u32;
        Some(Canvas { pixels, top, bottom, css_width })
    }

    /// Draws the current frame. `None` if there is no frame or drawing is not possible, `false` if the surface had no
    /// texture to draw on.
    pub fn draw(&mut self, app: &App) -> Option<bool> {
        let frame = app.screen.frame(app.ctx.now_ms, app.settings.calm)?;
        let particles = app.screen.replica().is_some_and(|replica| replica.features.particles);
        self.with_graphics(app, |graphics| {
            let Graphics { renderer, device, queue, .. } = graphics;
            // Pipelines of earlier scenes are kept.
            renderer.prepare(device, queue, particles);
            graphics.draw(&frame)
        })
    }

    /// Runs work with the graphics, which are created first if necessary; `None` if drawing is not possible. A context
    /// can be lost at any moment, even during setup. In that case wgpu's calls return nothing usable, and wgpu panics.
    /// This and other graphics failures end only the drawing.
    fn with_graphics<R>(&mut self, app: &App, work: impl FnOnce(&mut Graphics) -> R) -> Option<R> {
        if !app.picture.graphics.is_good() {
            return None;
        }
        let graphics = self.graphics.take();
        let done = browser::attempt(|| {
            let mut graphics = match graphics {
                Some(graphics) => graphics,
                None => Box::new(Graphics::new(self.keep_pixels)?),
            };
            let result = work(&mut graphics);
            Some((graphics, result))
        });
        let Some((graphics, result)) = done.flatten() else {
            let lost = is_context_lost();
            self.events.push(if lost { Event::ContextLost } else { Event::GraphicsFailed });
            return None;
        };
        self.graphics = Some(graphics);
        Some(result)
    }

    /// Drops everything created with the lost context.
    pub fn drop_graphics(&mut self) {
        let graphics = self.graphics.take();
        browser::attempt(|| drop(graphics));
    }
}

/// CSS pixels per device pixel.
pub fn css_per_pixel(pixels: [u32; 2]) -> f32 {
    dom::html("stage").client_width() as f32 / pixels[0].max(1) as f32
}

pub struct Graphics {
    canvas: HtmlCanvasElement,
    surface: wgpu::Surface<'static>,
    device: wgpu::Device,
    queue: wgpu::Queue,
    configuration: wgpu::SurfaceConfiguration,
    pub renderer: Renderer,
    list: DrawList,
}

impl Graphics {
    /// Sets up drawing on the page's canvas. `None` without WebGL 2 or while its context is lost.
    fn new(keep_pixels: bool) -> Option<Graphics> {
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

    /// Resizes the drawing surface to the canvas, using this fraction of its device pixels. Returns the size in pixels,
    /// or `None` while the canvas has no area.
    fn fit(&mut self, share: f64) -> Option<[u32; 2]> {
        let ratio = browser::window().device_pixel_ratio().clamp(0.5, PIXEL_RATIO_MAX) * share;
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

    /// Draws one frame of the size set by `fit`; `false` if the surface had no texture to draw on.
    fn draw(&mut self, frame: &Frame) -> bool {
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

/// Creates the canvas's context with attributes that wgpu would not set; wgpu then reuses this context.
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
    let context: WebGl2RenderingContext = context.dyn_into().ok()?;
    (!context.is_context_lost()).then_some(())
}

/// Whether the canvas's context was lost.
fn is_context_lost() -> bool {
    let context = dom::by_id::<HtmlCanvasElement>("stage").get_context("webgl2").ok().flatten();
    let context = context.and_then(|context| context.dyn_into::<WebGl2RenderingContext>().ok());
    context.is_some_and(|context| context.is_context_lost())
}

/// Polls a future that is ready immediately, as wgpu's are on WebGL.
fn now<F: Future>(future: F) -> Option<F::Output> {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(output) => Some(output),
        Poll::Pending => None,
    }
}
