// Particles: textured quads, blended additively. rgb = texel rgb * texel alpha * tint (A3.4),
// blended ONE, ONE (A3.5) where alpha is 0, as it is on dark ground. The tint may exceed 1, so many particles saturate.

@group(1) @binding(0) var sprite: texture_2d<f32>;
@group(1) @binding(1) var sprite_sampler: sampler;

struct Vertex {
    @builtin(vertex_index) index: u32,
    // Centre in world units.
    @location(0) center: vec2f,
    // Width and height, world units.
    @location(1) size: f32,
    @location(2) tint: vec3f,
}

struct Varying {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    @location(1) @interpolate(flat, either) tint: vec3f,
}

@vertex
fn vertex(in: Vertex) -> Varying {
    let quarter = in.index & 3u;
    let corner = vec2f(f32(quarter & 1u), f32(quarter >> 1u));
    let world = in.center + (corner - 0.5) * in.size;
    return Varying(to_clip(world), vec2f(corner.x, 1.0 - corner.y), in.tint);
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4f {
    let texel = textureSampleLevel(sprite, sprite_sampler, in.uv, 0.0);
    let light = texel.rgb * texel.a * in.tint;
    // On light ground, where added light is invisible, the brightest channel covers.
    let brightest = min(max(light.r, max(light.g, light.b)), 1.0);
    return vec4f(light, brightest * globals.cover);
}
