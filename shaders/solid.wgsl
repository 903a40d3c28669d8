// Everything except particles: one quad each, shaped by a signed distance field. Output colours are premultiplied;
// additive light has alpha 0.

struct Vertex {
    @builtin(vertex_index) index: u32,
    // Centre and half extent of the shape, world units.
    @location(0) center: vec2f,
    @location(1) half: vec2f,
    // Cosine and sine of the rotation.
    @location(2) axis: vec2f,
    // Corner radius, and width of the soft or drawn edge; world units.
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
    // Direction towards the light from glowing objects; shorter if the light is diffuse.
    @location(8) toward: vec2f,
}

// The numbers match `draw::vertex::SolidKind`: flat shapes first, then matte ones.
const BOX = 0u;
const OVAL = 1u;
const SHADOW_BOX = 2u;
const SHADOW_OVAL = 3u;
const GLOW = 4u;
const RING_BOX = 5u;
const RING_OVAL = 6u;
const TRAIL = 7u;
const SMILE = 8u;
const MATTE_BOX = 9u;
const MATTE_OVAL = 10u;
const CRATE = 11u;
const DROP = 12u;
const SLAB = 13u;

@vertex
fn vertex(in: Vertex) -> Varying {
    let quarter = in.index & 3u;
    let corner = vec2f(f32(quarter & 1u), f32(quarter >> 1u)) * 2.0 - 1.0;
    let local = corner * (in.half + in.rounding.y + 1.5 * globals.unit_per_pixel);
    let world = in.center + turn(local, in.axis);
    var toward = vec2f(0.0);
    if globals.light_on > 0.5 && in.kind >= MATTE_BOX {
        toward = light_direction(world);
    }
    return Varying(
        to_clip(world), local, in.half, in.axis, in.rounding, in.fill, in.edge, in.kind, world,
        toward,
    );
}

fn turn(v: vec2f, axis: vec2f) -> vec2f {
    return vec2f(v.x * axis.x - v.y * axis.y, v.x * axis.y + v.y * axis.x);
}

fn light_direction(world: vec2f) -> vec2f {
    let x = vec2f(2.5, 0.0);
    let y = vec2f(0.0, 2.5);
    let ahead = vec2f(
        brightness(light_at(world + x) - light_at(world - x)),
        brightness(light_at(world + y) - light_at(world - y)),
    );
    return ahead / (length(ahead) + 0.02);
}

fn box_distance(p: vec2f, half: vec2f, radius: f32) -> f32 {
    let q = abs(p) - half + radius;
    return length(max(q, vec2f(0.0))) + min(max(q.x, q.y), 0.0) - radius;
}

// Outward direction of the box's distance function.
fn box_outward(p: vec2f, half: vec2f, radius: f32) -> vec2f {
    let q = abs(p) - half + radius;
    let side = select(vec2f(0.0, 1.0), vec2f(1.0, 0.0), q.x > q.y);
    let corner = max(q, vec2f(1e-6));
    let out = select(side, corner / length(corner), min(q.x, q.y) > 0.0);
    return out * sign(p);
}

// First-order distance to an ellipse, exact for circles and on the boundary.
fn oval_distance(p: vec2f, half: vec2f) -> f32 {
    let k = length(p / half);
    return k * (k - 1.0) / max(length(p / (half * half)), 1e-6);
}

// A disc with a tip behind it at -x: the convex hull of the disc and the tip.
fn drop_distance(p: vec2f, radius: f32, tip: f32) -> f32 {
    let q = vec2f(p.x, abs(p.y));
    let slope = radius / tip;
    let along = sqrt(max(1.0 - slope * slope, 0.0));
    // Beyond the tangent point, the disc is nearest; before it, the straight side.
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

// Three planks in a frame.
fn crate_shade(local: vec2f, half: vec2f) -> f32 {
    let frame = 0.17 * min(half.x, half.y) + 0.12;
    let unit = globals.unit_per_pixel;
    let inner = box_distance(local, half - frame * 1.6, frame * 0.4);
    let groove = clamp(0.5 - (abs(inner) - 0.10) / unit, 0.0, 1.0);
    let span = (half.y - frame * 1.6) * 2.0 / 3.0;
    let away = abs(abs(local.y) - span * 0.5);
    let recess = clamp(0.5 - inner / unit, 0.0, 1.0);
    let plank = clamp(0.5 - (away - 0.08) / unit, 0.0, 1.0) * recess;
    return (1.0 - 0.16 * recess) * (1.0 - 0.30 * max(groove, plank));
}

// Matte clay under a lamp. Software GL runs every branch for every fragment, so shared code appears only once.
fn matte(in: Varying, d: f32) -> vec3f {
    let unit = globals.unit_per_pixel;
    let least = min(in.half.x, in.half.y);
    var bevel = clamp(0.35 * least, 0.5, 2.6);
    var radius = max(in.rounding.x, bevel);
    switch in.kind {
        case MATTE_OVAL: { bevel = 0.6 * least; }
        case DROP: { bevel = 0.7 * in.half.y; }
        case CRATE: { bevel = 0.7; radius = in.rounding.x; }
        case SLAB: { bevel = 0.55; radius = in.rounding.x; }
        default: {}
    }
    let round = in.kind == MATTE_OVAL || in.kind == DROP;
    let from_middle = in.local + 1e-6;
    let outward = select(
        box_outward(in.local, in.half, radius), from_middle / length(from_middle), round,
    );
    // Walls have sharp corners and no bevel, so that they join without a seam.
    let wall = in.kind == SLAB && in.rounding.x == 0.0;
    let rim = select(1.0 - clamp(-d / bevel, 0.0, 1.0), 0.0, wall);
    let slope = turn(outward, in.axis) * rim * rim;

    let height = select(clamp(in.local.y / in.half.y, -1.0, 1.0), 0.0, wall);
    var color = in.fill.rgb * (0.93 + 0.09 * height);
    color = mix(color, in.edge.rgb, 0.75 * max(slope.y, 0.0));
    color *= 1.0 - 0.42 * max(-slope.y, 0.0) - 0.12 * abs(slope.x);
    if globals.light_on > 0.5 {
        let facing = 0.6 + 1.8 * max(dot(slope, in.toward), 0.0);
        color += light_at(in.world) * facing * (in.fill.rgb + 0.10);
    }
    if in.kind == CRATE {
        color *= crate_shade(in.local, in.half);
    }
    if !wall {
        let line = clamp((d + max(0.45, unit)) / unit + 0.5, 0.0, 1.0) * globals.lines.w;
        color = mix(color, 0.15 * in.fill.rgb, max(line, 0.0));
        color = mix(color, in.edge.rgb, max(-line, 0.0));
    }
    if in.kind == SLAB {
        // One lighter edge on top. Walls continue into the dark outside the world.
        let top = clamp((in.local.y - in.half.y + 0.55) / max(unit, 0.1) + 0.5, 0.0, 1.0);
        color = mix(color, in.edge.rgb * (0.55 + color), 0.85 * top * in.edge.a);
        let beyond = max(max(-in.world, in.world - globals.world), vec2f(0.0));
        color *= 0.25 + 0.75 * exp(-length(beyond) / 16.0);
    }
    return color;
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4f {
    let unit = globals.unit_per_pixel;
    let soft = in.rounding.y;
    var d = signed_distance(in);
    // Fully covered below `low`, fully clear above `high`.
    var low = -0.5 * unit;
    var high = 0.5 * unit;
    var alpha = in.fill.a;
    // The share of light that is added instead of covering the background.
    var additive = 0.0;
    switch in.kind {
        case SHADOW_BOX, SHADOW_OVAL: {
            low = -soft;
            high = soft;
        }
        case RING_BOX, RING_OVAL: {
            // A line centred on the outline; the part beyond its width fades out.
            d = abs(d);
            low = max(0.5 * in.edge.a * soft, 0.5 * unit);
            high = low + max(soft - low, unit);
        }
        case GLOW: {
            let k = clamp(1.0 - length(in.local / in.half), 0.0, 1.0);
            alpha *= k * k;
            additive = 1.0;
        }
        case TRAIL: {
            // Wide and opaque with a round head at +x, thin and transparent at -x.
            let along = clamp(in.local.x / in.half.x * 0.5 + 0.5, 0.0, 1.0);
            let head = min((1.0 - along) * 2.0 * in.half.x / in.half.y, 1.0);
            d = abs(in.local.y) - in.half.y * along * sqrt(head * (2.0 - head));
            alpha *= along * along;
            additive = 1.0 - in.edge.a;
        }
        default: {}
    }
    additive *= 1.0 - globals.cover;
    let cover = alpha * (1.0 - smoothstep(low, high, d));
    var color = in.fill.rgb;
    if in.kind >= MATTE_BOX {
        color = matte(in, d);
    }
    return vec4f(color * cover, cover * (1.0 - additive));
}
