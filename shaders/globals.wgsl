// Globals shared by all pipelines: the camera, and the light that glowing objects cast on matte ones. This file is
// prepended to every other shader.

struct Globals {
    // The world point at the centre of the target, and half the width and height that it shows, world units.
    center: vec2f,
    half: vec2f,
    // The world's upper right corner; the lower left one is (0, 0).
    world: vec2f,
    // Target size in pixels.
    pixels: vec2f,
    // Lower left corner and extent of the light field, world units.
    light_low: vec2f,
    light_size: vec2f,
    unit_per_pixel: f32,
    // 1 if the light field contains light, else 0; it is then not sampled.
    light_on: f32,
    // The share of light that is left at the edges of the stage, and how far light covers instead of adding, 0 to 1.
    dusk: f32,
    cover: f32,
    // Outside the world, shaded stage, lit stage, and the hills in front of it.
    ground: array<vec4f, 4>,
    // Light that the lines of the grid add; w is the outline of toys, dark up to 1, bright down to -1.
    lines: vec4f,
    // Height of the hills and of their crests, shares of the world's height; crests per unit; opacity.
    hills: vec4f,
    // Stripes per unit along x and y, their bend in stripes, and their strength.
    stripes: vec4f,
}

@group(0) @binding(0) var<uniform> globals: Globals;
@group(0) @binding(1) var light_texture: texture_2d<f32>;
@group(0) @binding(2) var light_sampler: sampler;

fn to_clip(world: vec2f) -> vec4f {
    return vec4f((world - globals.center) / globals.half, 0.0, 1.0);
}

// The light at a world point. The texture stores square roots, so that eight bits give enough precision for dark
// values.
fn light_at(world: vec2f) -> vec3f {
    let uv = (world - globals.light_low) / globals.light_size;
    let root = textureSampleLevel(light_texture, light_sampler, uv, 0.0).rgb;
    return root * root;
}

fn brightness(color: vec3f) -> f32 {
    return dot(color, vec3f(0.3, 0.5, 0.2));
}

// A fixed pattern of half a display step, which prevents banding in slow gradients on dark backgrounds (interleaved
// gradient noise, Jimenez 2014).
fn dither(pixel: vec2f) -> f32 {
    return (fract(52.9829189 * fract(dot(pixel, vec2f(0.06711056, 0.00583715)))) - 0.5) / 255.0;
}
