// Globals shared by all pipelines: the camera, and the light that glowing things throw on matte ones.
// Put in front of every other shader file.

struct Globals {
    // World point in the middle of the target, and half of what it shows, in world units.
    center: vec2f,
    half: vec2f,
    // The world spans (0, 0) to this.
    world: vec2f,
    // Target size in pixels.
    pixels: vec2f,
    // Lower left corner and extent of the light field, world units.
    light_low: vec2f,
    light_size: vec2f,
    unit_per_pixel: f32,
    // 1 while the light field holds any light, else 0: then it is not read.
    light_on: f32,
    // How visible the grid is, 0 to 1.
    grid: f32,
    unused: f32,
    // The palette's ink: outside of the world, shaded stage, lit stage.
    ink: array<vec4f, 3>,
}

@group(0) @binding(0) var<uniform> globals: Globals;
@group(0) @binding(1) var light_texture: texture_2d<f32>;
@group(0) @binding(2) var light_sampler: sampler;

fn to_clip(world: vec2f) -> vec4f {
    return vec4f((world - globals.center) / globals.half, 0.0, 1.0);
}

// Light that reaches a world point. The texture holds square roots, which keeps eight bits fine
// enough for the dark end.
fn light_at(world: vec2f) -> vec3f {
    let uv = (world - globals.light_low) / globals.light_size;
    let root = textureSampleLevel(light_texture, light_sampler, uv, 0.0).rgb;
    return root * root;
}

fn brightness(color: vec3f) -> f32 {
    return dot(color, vec3f(0.3, 0.5, 0.2));
}

// A fixed pattern of half a display step, so that slow gradients on a dark ground show no bands
// (interleaved gradient noise, Jimenez 2014).
fn dither(pixel: vec2f) -> f32 {
    return (fract(52.9829189 * fract(dot(pixel, vec2f(0.06711056, 0.00583715)))) - 0.5) / 255.0;
}
