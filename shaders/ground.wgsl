// The stage: lit from above, hills, stripes and a grid in world units, darkness outside the world. All themes share
// one formula, in which what a theme lacks has the factor 0.

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

// A wave from -1 to 1 with period 1, made of parabolas.
fn wave(x: f32) -> f32 {
    let t = 2.0 * fract(x) - 1.0;
    return 4.0 * t * (1.0 - abs(t));
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
    let outside_ink = globals.ground[0].rgb;
    var color = mix(0.8 * globals.ground[1].rgb, 1.12 * globals.ground[2].rgb, lit);

    // Two ranges of hills: the front one has the full colour, and the one behind it half of that.
    let x = point.x * globals.hills.z;
    let crests = vec2f(wave(x) + 0.4 * wave(2.7 * x + 0.3), wave(0.7 * x + 0.45) + 1.7);
    let top = globals.world.y * (globals.hills.x + globals.hills.y * crests);
    let covered = clamp((top - point.y) / unit + 0.5, vec2f(0.0), vec2f(1.0)) * globals.hills.w;
    color = mix(color, globals.ground[3].rgb, max(covered.x, 0.5 * covered.y));

    let stripe = wave(dot(point, globals.stripes.xy) + globals.stripes.z * wave(0.013 * point.x));
    // With hills, only these have stripes.
    let striped = globals.stripes.w * mix(1.0, covered.x, globals.hills.w);
    color *= 1.0 + striped * clamp(4.0 * stripe, -1.0, 1.0);

    // Lines are at most a pixel wide; the fine ones fade out before they become too dense.
    let fine = clamp(10.0 / unit / 24.0 - 0.4, 0.0, 1.0);
    let hair = 0.5 * min(unit, 0.16);
    let grid = 0.40 * fine * lines(point, 10.0, hair) + 0.60 * lines(point, 50.0, hair * 1.6);
    color += globals.lines.rgb * min(grid, 1.0) * (0.35 + 0.65 * lit);

    if globals.light_on > 0.5 {
        let light = light_at(point);
        color += light * (0.10 + 1.2 * color + 0.16 * min(grid, 1.0)) * (1.0 - 0.8 * globals.cover);
    }

    // The world has a soft edge where the stage fades into the dark.
    let beyond = max(-point, point - globals.world);
    let outside = length(max(beyond, vec2f(0.0)));
    let inside = min(max(beyond.x, beyond.y), 0.0);
    color *= mix(globals.dusk, 1.0, clamp(-inside / 14.0, 0.0, 1.0));
    let dark = outside_ink * (0.45 + 0.55 * exp(-outside / 30.0));
    color = mix(color, dark, clamp(outside / unit, 0.0, 1.0));

    return vec4f(color + dither(pixel.xy), 1.0);
}
