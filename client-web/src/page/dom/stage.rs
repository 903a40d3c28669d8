//! The canvas and what draws on it. The context is made before wgpu asks for one, because only then
//! can it be opaque; after a lost context everything is built again.

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

/// Blending is specified on encoded values, so the format must not convert.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Device pixels a CSS pixel beyond which sharper drawing is not seen.
const PIXEL_RATIO_MAX: f64 = 3.0;

/// The canvas of the page.
pub struct Stage {
    events: Events,
    /// Dropped with a lost context; the next frame makes them again.
    pub graphics: Option<Box<Graphics>>,
    quality: Quality,
    /// All pixels are drawn, however long they take (`?sharp=1`).
    sharp: bool,
    /// Pictures are taken of what was drawn.
    keep_pixels: bool,
}

impl Stage {
    /// A canvas that nothing was drawn on.
    pub fn new(events: Events, sharp: bool) -> Stage {
        Stage { events, graphics: None, quality: Quality::default(), sharp, keep_pixels: false }
    }

    /// Forgets how fast the last screen was drawn.
    pub fn reset(&mut self) {
        self.quality = Quality::default();
    }

    /// The canvas of the next frame; `None` while nothing can be drawn. `covered_css` are the CSS pixels that the
    /// hud covers at the top and at the bottom.
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
        // A still picture has the time to be sharp.
        let full = still || self.sharp;
        let share = if full { 1.0 } else { self.quality.frame(browser::now_ms()) };
        let pixels = self.with_graphics(app, |graphics| graphics.fit(share))??;
        let [top, bottom] = covered_css.map(|css| (css / css_per_pixel(pixels)) as u32);
        let css_width = dom::html("stage").client_width().max(0) as u32;
        Some(Canvas { pixels, top, bottom, css_width })
    }

    /// Draws what has changed: `None` if nothing has, `false` if there was nothing to draw on.
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

    /// Does something with what draws, which is set up for it if need be; `None` if nothing can be drawn. A context can be lost
    /// at any moment, also while it is set up, and then answers nothing that wgpu asks for, which panics. Neither that nor
    /// anything else that a graphics card does ends more than the drawing.
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

    /// The context is lost: everything that was made with it is worthless.
    pub fn drop_graphics(&mut self) {
        let graphics = self.graphics.take();
        browser::attempt(|| drop(graphics));
    }
}

/// CSS pixels a device pixel.
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
    /// Sets up drawing on the page's canvas; `None` without WebGL 2, or while its context is lost.
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

    /// Fits the drawing to the canvas's place on the page, with a share of its device pixels; the
    /// size in pixels, or `None` while it has none.
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

    /// Draws one frame of the size that `fit` gave; `false` if there was nothing to draw on.
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
    let context: WebGl2RenderingContext = context.dyn_into().ok()?;
    (!context.is_context_lost()).then_some(())
}

/// Whether the canvas has a context that was lost.
fn is_context_lost() -> bool {
    let context = dom::by_id::<HtmlCanvasElement>("stage").get_context("webgl2").ok().flatten();
    let context = context.and_then(|context| context.dyn_into::<WebGl2RenderingContext>().ok());
    context.is_some_and(|context| context.is_context_lost())
}

/// The result of a future that is ready at once, as wgpu's are on WebGL.
fn now<F: Future>(future: F) -> Option<F::Output> {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(output) => Some(output),
        Poll::Pending => None,
    }
}
