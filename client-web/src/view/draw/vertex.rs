//! The data sent to the GPU: plain vertices and the uniform block. A quad is four equal vertices; the
//! shader tells its corners apart by the vertex index, so nothing is instanced (software GL draws
//! instanced quads eight times slower).

use crate::view::palette::Rgb;
use bytemuck::{Pod, Zeroable};
use jostle_sim::Vec2;

/// Kinds of [`SolidVertex`]; the numbers are those of `shaders/solid.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum SolidKind {
    Box = 0,
    Oval = 1,
    ShadowBox = 2,
    ShadowOval = 3,
    /// Additive light, strongest in the middle.
    Glow = 4,
    /// Outline of a box; edge alpha is the share of the width that is full.
    RingBox = 5,
    /// Outline of an ellipse.
    RingOval = 6,
    /// Wedge that fades towards -x; edge alpha 0 makes it additive.
    Trail = 7,
    /// Line that hangs from (-half.x, 0) and (half.x, 0) down to (0, -half.y); the width is the soft edge's.
    Smile = 8,
    /// Box lit from above.
    MatteBox = 9,
    /// Ellipse lit from above.
    MatteOval = 10,
    Crate = 11,
    /// Disc with a tip behind it at -x; `half` is (tip, radius).
    Drop = 12,
    /// Slab of the world, with one lighter top edge if edge alpha is 1; a wall if its corners are sharp.
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
    /// Cosine and sine of the turn.
    pub axis: [f32; 2],
    /// Corner radius, and width of a soft or drawn edge; world units.
    pub rounding: [f32; 2],
    /// Colour, not premultiplied.
    pub fill: [u8; 4],
    /// Colour of the lit edge.
    pub edge: [u8; 4],
    /// A [`SolidKind`].
    pub kind: u32,
}

impl SolidVertex {
    /// An upright shape without rounding whose edge has its own colour.
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

    /// With a corner radius.
    pub fn rounded(self, radius: f32) -> SolidVertex {
        SolidVertex { rounding: [radius, self.rounding[1]], ..self }
    }

    /// With a soft edge of this width.
    pub fn soft(self, width: f32) -> SolidVertex {
        SolidVertex { rounding: [self.rounding[0], width], ..self }
    }

    /// With another colour where light catches it.
    pub fn edged(self, edge: [u8; 4]) -> SolidVertex {
        SolidVertex { edge, ..self }
    }

    /// Turned so that +x points along `direction`, a unit vector.
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

/// The uniform block of all pipelines, as in `shaders/globals.wgsl`; a multiple of 16 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Globals {
    /// World point in the middle of the target.
    pub center: [f32; 2],
    /// Half of what the target shows, world units.
    pub half: [f32; 2],
    /// The world spans (0, 0) to this.
    pub world: [f32; 2],
    pub pixels: [f32; 2],
    /// Lower left corner of the light field, world units.
    pub light_low: [f32; 2],
    /// Extent of the light field, world units.
    pub light_size: [f32; 2],
    /// World units a pixel.
    pub unit_per_pixel: f32,
    /// 1 while the light field holds light, else 0.
    pub light_on: f32,
    /// Visibility of the grid, 0..=1.
    pub grid: f32,
    pub unused: f32,
    /// The palette's ink, 0..=1, alpha 1.
    pub ink: [[f32; 4]; 3],
}

const _: () = assert!(size_of::<Globals>().is_multiple_of(16));
const _: () = assert!(size_of::<SolidVertex>() <= 255, "the largest stride of WebGL2");

/// A palette colour with an alpha of 0..=1.
pub fn rgba([r, g, b]: Rgb, alpha: f32) -> [u8; 4] {
    [r, g, b, (alpha.clamp(0.0, 1.0) * 255.0).round() as u8]
}
