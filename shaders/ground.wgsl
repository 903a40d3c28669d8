// The stage: dark ink lit from above, a faint grid in world units, darkness outside the world.

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    // A single triangle that covers the target.
    let corner = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4f(corner * 2.0 - 1.0, 0.0, 1.0);
}

// Coverage of lines of half-width `width` at every multiple of `step`.
fn lines(point: vec2f, step: f32, width: f32) -> f32 {
    let away = abs(point - step * round(point / step));
    let cover = clamp((vec2f(width) - away) / globals.unit_per_pixel + 0.5, vec2f(0.0), vec2f(1.0));
    return max(cover.x, cover.y);
}

@fragment
fn fragment(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let unit = globals.unit_per_pixel;
    let across = vec2f(pixel.x, globals.pixels.y - pixel.y) / globals.pixels * 2.0 - 1.0;
    let point = globals.center + across * globals.half;

    // A lamp above the centre of the stage.
    let lamp = vec2f(0.5, 0.92) * globals.world;
    let reach = 0.62 * max(globals.world.x, globals.world.y);
    let lit = exp(-dot(point - lamp, point - lamp) / (reach * reach));
    let outside_ink = globals.ink[0].rgb;
    var color = mix(0.8 * globals.ink[1].rgb, 1.12 * globals.ink[2].rgb, lit);

    // Lines are at most a pixel wide; the fine ones fade out before they become too dense.
    let fine = clamp(10.0 / unit / 24.0 - 0.4, 0.0, 1.0);
    let hair = 0.5 * min(unit, 0.16);
    let grid = 0.40 * fine * lines(point, 10.0, hair) + 0.60 * lines(point, 50.0, hair * 1.6);
    color += vec3f(0.075, 0.095, 0.160) * min(grid, 1.0) * (0.35 + 0.65 * lit) * globals.grid;

    if globals.light_on > 0.5 {
        let light = light_at(point);
        color += light * (0.10 + 1.2 * color + 0.16 * min(grid, 1.0));
    }

    // The world has a soft edge where the stage fades into the dark.
    let beyond = max(-point, point - globals.world);
    let outside = length(max(beyond, vec2f(0.0)));
    let inside = min(max(beyond.x, beyond.y), 0.0);
    color *= mix(0.72, 1.0, clamp(-inside / 14.0, 0.0, 1.0));
    let dark = outside_ink * (0.45 + 0.55 * exp(-outside / 30.0));
    color = mix(color, dark, clamp(outside / unit, 0.0, 1.0));

    return vec4f(color + dither(pixel.xy), 1.0);
}
