// Everything that is not a particle: one quad each, shaped by a signed distance. Colours come out
// premultiplied; additive light is a colour with alpha 0.

struct Vertex {
    @builtin(vertex_index) index: u32,
    // Centre and half extent of the shape, world units.
    @location(0) center: vec2f,
    @location(1) half: vec2f,
    // Cosine and sine of its turn.
    @location(2) axis: vec2f,
    // Corner radius; width of a soft or drawn edge; world units.
    @location(3) rounding: vec2f,
    @location(4) fill: vec4f,
    @location(5) edge: vec4f,
    @location(6) kind: u32,
}

struct Varying {
    @builtin(position) position: vec4f,
    @location(0) local: vec2f,
    @location(1) @interpolate(flat, either) half: vec2f,
    @location(2) @interpolate(flat, either) axis: vec2f,
    @location(3) @interpolate(flat, either) rounding: vec2f,
    @location(4) @interpolate(flat, either) fill: vec4f,
    @location(5) @interpolate(flat, either) edge: vec4f,
    @location(6) @interpolate(flat, either) kind: u32,
    @location(7) world: vec2f,
}

// The same numbers as `draw::vertex::SolidKind`.
const BOX = 0u;
const OVAL = 1u;
const SHADOW_BOX = 2u;
const SHADOW_OVAL = 3u;
const GLOW = 4u;
const MATTE_BOX = 5u;
const MATTE_OVAL = 6u;
const CRATE = 7u;
const DROP = 8u;
const RING_BOX = 9u;
const RING_OVAL = 10u;
const TRAIL = 11u;
const SLAB = 12u;
const SMILE = 13u;

@vertex
fn vertex(in: Vertex) -> Varying {
    let quarter = in.index & 3u;
    let corner = vec2f(f32(quarter & 1u), f32(quarter >> 1u)) * 2.0 - 1.0;
    let local = corner * (in.half + in.rounding.y + 1.5 * globals.unit_per_pixel);
    let turned = vec2f(
        local.x * in.axis.x - local.y * in.axis.y,
        local.x * in.axis.y + local.y * in.axis.x,
    );
    let world = in.center + turned;
    return Varying(
        to_clip(world), local, in.half, in.axis, in.rounding, in.fill, in.edge, in.kind, world,
    );
}

fn box_distance(p: vec2f, half: vec2f, radius: f32) -> f32 {
    let q = abs(p) - half + radius;
    return length(max(q, vec2f(0.0))) + min(max(q.x, q.y), 0.0) - radius;
}

// Outward direction of the box's distance.
fn box_outward(p: vec2f, half: vec2f, radius: f32) -> vec2f {
    let q = abs(p) - half + radius;
    let side = select(vec2f(0.0, 1.0), vec2f(1.0, 0.0), q.x > q.y);
    let corner = max(q, vec2f(1e-6));
    let out = select(side, corner / length(corner), min(q.x, q.y) > 0.0);
    return out * sign(p);
}

// First-order distance to an ellipse: exact for a circle, and on the rim of any.
fn oval_distance(p: vec2f, half: vec2f) -> f32 {
    let k = length(p / half);
    return k * (k - 1.0) / max(length(p / (half * half)), 1e-6);
}

// A disc with a point behind it, at -x: the hull of the disc and the tip.
fn drop_distance(p: vec2f, radius: f32, tip: f32) -> f32 {
    let q = vec2f(p.x, abs(p.y));
    let slope = radius / tip;
    let along = sqrt(max(1.0 - slope * slope, 0.0));
    // Beyond the tangent point the disc is nearest, before it the straight side.
    if q.x * along + q.y * slope > 0.0 {
        return length(q) - radius;
    }
    return dot(q + vec2f(tip, 0.0), vec2f(-slope, along));
}

// An arc from (-half.x, 0) down to (0, -half.y) and up to (half.x, 0).
fn arc_distance(p: vec2f, half: vec2f) -> f32 {
    let radius = dot(half, half) / (2.0 * half.y);
    let rise = radius - half.y;
    let q = vec2f(abs(p.x), p.y - rise);
    if q.x * rise <= -q.y * half.x {
        return abs(length(q) - radius);
    }
    return length(vec2f(q.x - half.x, p.y));
}

fn signed_distance(in: Varying) -> f32 {
    switch in.kind {
        case OVAL, SHADOW_OVAL, MATTE_OVAL, RING_OVAL: {
            return oval_distance(in.local, in.half);
        }
        case DROP: {
            return drop_distance(in.local, in.half.y, in.half.x);
        }
        case SMILE: {
            return arc_distance(in.local, in.half) - 0.5 * in.rounding.y;
        }
        default: {
            return box_distance(in.local, in.half, in.rounding.x);
        }
    }
}

// Matte clay under a lamp: `outward` and `depth` (distance below the rim, positive) give a bevel.
fn matte(in: Varying, depth: f32, outward: vec2f, bevel: f32) -> vec3f {
    let turned = vec2f(
        outward.x * in.axis.x - outward.y * in.axis.y,
        outward.x * in.axis.y + outward.y * in.axis.x,
    );
    let rim = 1.0 - clamp(depth / bevel, 0.0, 1.0);
    let slope = turned * rim * rim;
    let height = clamp(in.local.y / in.half.y, -1.0, 1.0);
    var color = in.fill.rgb * (0.93 + 0.09 * height);
    color = mix(color, in.edge.rgb, 0.75 * max(slope.y, 0.0));
    color *= 1.0 - 0.42 * max(-slope.y, 0.0) - 0.12 * abs(slope.x);
    if globals.light_on > 0.5 {
        color += glow_on(in.world, slope) * (in.fill.rgb + 0.10);
    }
    return color;
}

// Light from glowing things, stronger on the flank that faces it.
fn glow_on(world: vec2f, slope: vec2f) -> vec3f {
    let light = light_at(world);
    let step = 2.5;
    let ahead = vec2f(
        brightness(light_at(world + vec2f(step, 0.0)) - light_at(world - vec2f(step, 0.0))),
        brightness(light_at(world + vec2f(0.0, step)) - light_at(world - vec2f(0.0, step))),
    );
    let toward = ahead / (length(ahead) + 0.02);
    return light * (0.6 + 1.8 * max(dot(slope, toward), 0.0));
}

// Three planks in a frame.
fn crate_shade(local: vec2f, half: vec2f) -> f32 {
    let frame = 0.17 * min(half.x, half.y) + 0.12;
    let unit = globals.unit_per_pixel;
    let inner = box_distance(local, half - frame * 1.6, frame * 0.4);
    let groove = clamp(0.5 - (abs(inner) - 0.10) / unit, 0.0, 1.0);
    let span = (half.y - frame * 1.6) * 2.0 / 3.0;
    let away = abs(abs(local.y) - span * 0.5);
    let plank = clamp(0.5 - (away - 0.08) / unit, 0.0, 1.0) * clamp(0.5 - inner / unit, 0.0, 1.0);
    let recess = clamp(0.5 - inner / unit, 0.0, 1.0);
    return (1.0 - 0.16 * recess) * (1.0 - 0.30 * max(groove, plank));
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4f {
    let unit = globals.unit_per_pixel;
    let soft = in.rounding.y;
    let d = signed_distance(in);
    let cover = in.fill.a * clamp(0.5 - d / unit, 0.0, 1.0);
    switch in.kind {
        case SHADOW_BOX, SHADOW_OVAL: {
            let alpha = in.fill.a * (1.0 - smoothstep(-soft, soft, d));
            return vec4f(in.fill.rgb * alpha, alpha);
        }
        case GLOW: {
            let k = clamp(1.0 - length(in.local / in.half), 0.0, 1.0);
            return vec4f(in.fill.rgb * (in.fill.a * k * k), 0.0);
        }
        case RING_BOX, RING_OVAL: {
            // A line with its middle on the outline; the part past half its width fades.
            let width = max(0.5 * in.edge.a * soft, 0.5 * unit);
            let away = abs(d);
            let fade = max(soft - width, unit);
            let alpha = in.fill.a * (1.0 - smoothstep(width, width + fade, away));
            return vec4f(in.fill.rgb * alpha, alpha);
        }
        case TRAIL: {
            // Wide and opaque with a round head at +x, thin and clear at -x.
            let along = clamp(in.local.x / in.half.x * 0.5 + 0.5, 0.0, 1.0);
            let head = min((1.0 - along) * 2.0 * in.half.x / in.half.y, 1.0);
            let width = in.half.y * along * sqrt(head * (2.0 - head));
            let across = abs(in.local.y) - width;
            let alpha = in.fill.a * along * along * clamp(0.5 - across / unit, 0.0, 1.0);
            return vec4f(in.fill.rgb * alpha, alpha * in.edge.a);
        }
        case MATTE_BOX: {
            let bevel = clamp(0.35 * min(in.half.x, in.half.y), 0.5, 2.6);
            let outward = box_outward(in.local, in.half, max(in.rounding.x, bevel));
            return vec4f(matte(in, -d, outward, bevel) * cover, cover);
        }
        case MATTE_OVAL: {
            let bevel = 0.6 * min(in.half.x, in.half.y);
            let outward = in.local / (length(in.local) + 1e-6);
            return vec4f(matte(in, -d, outward, bevel) * cover, cover);
        }
        case DROP: {
            let outward = normalize(vec2f(max(in.local.x, -0.5 * in.half.y), in.local.y) + 1e-6);
            return vec4f(matte(in, -d, outward, 0.7 * in.half.y) * cover, cover);
        }
        case CRATE: {
            let outward = box_outward(in.local, in.half, in.rounding.x);
            let color = matte(in, -d, outward, 0.7) * crate_shade(in.local, in.half);
            return vec4f(color * cover, cover);
        }
        case SLAB: {
            let outward = box_outward(in.local, in.half, max(in.rounding.x, 0.35));
            var color = matte(in, -d, outward, 0.55);
            // One lighter edge on top.
            let top = clamp((in.local.y - in.half.y + 0.55) / max(unit, 0.1) + 0.5, 0.0, 1.0);
            color = mix(color, in.edge.rgb * (0.55 + color), 0.85 * top);
            // Walls run on into the dark outside of the world.
            let beyond = max(max(-in.world, in.world - globals.world), vec2f(0.0));
            color *= 0.25 + 0.75 * exp(-length(beyond) / 16.0);
            return vec4f(color * cover, cover);
        }
        default: {
            return vec4f(in.fill.rgb * cover, cover);
        }
    }
}
