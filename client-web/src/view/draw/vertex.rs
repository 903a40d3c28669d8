//! The data sent to the GPU: plain vertices and the uniform block. A quad consists of four equal vertices, whose
//! corners the shader distinguishes by vertex index. Instancing is not used because software GL draws instanced quads
//! eight times slower.

use crate::view::palette::Rgb;
use bytemuck::{Pod, Zeroable};
use jostle_sim::Vec2;

/// Kinds of [`SolidVertex`]; the numbers match `shaders/solid.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum SolidKind {
    Box = 0,
    Oval = 1,
    ShadowBox = 2,
    ShadowOval = 3,
    /// Additive light, strongest in the centre.
    Glow = 4,
    /// Outline of a box; edge alpha gives the fraction of the width that is fully opaque.
    RingBox = 5,
    /// Outline of an ellipse.
    RingOval = 6,
    /// Wedge that fades towards -x; with edge alpha 0 it is additive.
    Trail = 7,
    /// Line that curves from (-half.x, 0) down to (0, -half.y) and up to (half.x, 0); its width is that of the soft
    /// edge.
    Smile = 8,
    /// Box lit from above.
    MatteBox = 9,
    /// Ellipse lit from above.
    MatteOval = 10,
    Crate = 11,
    /// Disc with a tip behind it at -x; `half` is (tip, radius).
    Drop = 12,
    /// Slab of the world, with one lighter top edge if edge alpha is 1. Sharp corners make it a wall.
    Slab = 13,
}

/// One corner of one solid quad.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SolidVertex {
    /// Centre, world units.
    pub center: [f32; 2],
    /// Half extent, world units.
    pub half: [f32; 2],
    /// Cosine and sine of the rotation.
    pub axis: [f32; 2],
    /// Corner radius, and width of the soft or drawn edge; world units.
    pub rounding: [f32; 2],
    /// Colour, not premultiplied.
    pub fill: [u8; 4],
    /// The colour of the lit edge.
    pub edge: [u8; 4],
    /// A [`SolidKind`].
    pub kind: u32,
}

impl SolidVertex {
    /// An unrotated shape without rounding; the edge has the same colour as the fill.
    pub fn new(kind: SolidKind, center: Vec2, half: Vec2, fill: [u8; 4]) -> SolidVertex {
        SolidVertex {
            center: center.into(),
            half: half.into(),
            axis: [1.0, 0.0],
            rounding: [0.0, 0.0],
            fill,
            edge: fill,
            kind: kind as u32,
        }
    }

    /// Sets the corner radius.
    pub fn rounded(self, radius: f32) -> SolidVertex {
        SolidVertex { rounding: [radius, self.rounding[1]], ..self }
    }

    /// Sets the width of the soft edge.
    pub fn soft(self, width: f32) -> SolidVertex {
        SolidVertex { rounding: [self.rounding[0], width], ..self }
    }

    /// Sets a different colour for the lit edge.
    pub fn edged(self, edge: [u8; 4]) -> SolidVertex {
        SolidVertex { edge, ..self }
    }

    /// Rotates the shape so that +x points along `direction`, a unit vector.
    pub fn turned(self, direction: Vec2) -> SolidVertex {
        SolidVertex { axis: direction.into(), ..self }
    }
}

/// One corner of one particle.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ParticleVertex {
    /// Centre, world units.
    pub center: [f32; 2],
    /// Width and height, world units.
    pub size: f32,
    /// Red, green and blue factors, which may exceed 1.
    pub tint: [f32; 3],
}

/// The uniform block of all pipelines, as in `shaders/globals.wgsl`. Its size is a multiple of 16 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Globals {
    /// The world point at the centre of the target.
    pub center: [f32; 2],
    /// Half the width and height that the target shows, world units.
    pub half: [f32; 2],
    /// The world's upper right corner; the lower left one is (0, 0).
    pub world: [f32; 2],
    pub pixels: [f32; 2],
    /// Lower left corner of the light field, world units.
    pub light_low: [f32; 2],
    /// Size of the light field, world units.
    pub light_size: [f32; 2],
    /// World units per pixel.
    pub unit_per_pixel: f32,
    /// 1 if the light field contains light, else 0.
    pub light_on: f32,
    /// The share of light that is left at the edges of the stage, 0..=1.
    pub dusk: f32,
    /// How far light covers instead of adding, 0..=1.
    pub cover: f32,
    /// The colours of `Style::ground`, 0..=1, alpha 1.
    pub ground: [[f32; 4]; 4],
    /// `Style::lines` and `Style::rim`.
    pub lines: [f32; 4],
    /// `Style::hills`.
    pub hills: [f32; 4],
    /// `Style::stripes`.
    pub stripes: [f32; 4],
}

const _: () = assert!(size_of::<Globals>().is_multiple_of(16));
const _: () = assert!(size_of::<SolidVertex>() <= 255, "the largest stride of WebGL2");

/// A palette colour with an alpha in 0..=1.
pub fn rgba([r, g, b]: Rgb, alpha: f32) -> [u8; 4] {
    [r, g, b, (alpha.clamp(0.0, 1.0) * 255.0).round() as u8]
}
