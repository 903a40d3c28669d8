//! Scripts that tests run in the page.

/// Returns the page's state as JSON text, or null before it has one.
pub const STATE: &str = "(() => { const state = window.jostle?.state?.(); \
    return !state ? null : typeof state === 'string' ? state : JSON.stringify(state); })()";

/// Records the state in every frame, so that polling misses nothing.
pub const RECORD: &str = r#"(() => {
    const recorded = window.recorded = {states: [], kinds: {}, particles: 0, emitters: 0};
    const look = () => {
        const said = window.jostle.state();
        const state = typeof said === 'string' ? JSON.parse(said) : said;
        if (!recorded.states.includes(state.state)) recorded.states.push(state.state);
        const kinds = {};
        for (const body of state.bodies ?? []) kinds[body.kind] = (kinds[body.kind] ?? 0) + 1;
        for (const kind in kinds)
            recorded.kinds[kind] = Math.max(recorded.kinds[kind] ?? 0, kinds[kind]);
        recorded.particles = Math.max(recorded.particles, state.particles ?? 0);
        recorded.emitters = Math.max(recorded.emitters, state.emitters ?? 0);
        if (window.recorded === recorded) requestAnimationFrame(look);
    };
    look();
    return true;
})()"#;

/// Returns the centre of an element, or null if it is not shown. Waits until it has not moved for a frame and nothing
/// covers it, because on a slow page the layout may still be changing, and a click would miss.
pub const MIDDLE: &str = r#"async selector => {
    const shown = () => {
        const element = document.querySelector(selector);
        const r = element?.getBoundingClientRect();
        return r?.width ? {element, at: [r.x + r.width / 2, r.y + r.height / 2]} : null;
    };
    document.querySelector(selector)?.scrollIntoView({block: 'nearest'});
    let before = shown();
    for (let frame = 0; before && frame < 200; frame += 1) {
        await new Promise(everyFrame);
        const now = shown();
        const hit = now && document.elementFromPoint(...now.at);
        if (hit && now.element.contains(hit) && now.at.every((x, axis) => x === before.at[axis])) break;
        before = now;
    }
    return before?.at ?? null;
}"#;

/// Limits pages to 10 frames per second, which is enough for all comparisons, because without a graphics card most of a
/// page's cost is drawing. Test scripts can still use every frame.
pub const FEW_FRAMES: &str = r#"(() => {
    const frame = window.everyFrame = window.requestAnimationFrame.bind(window);
    let drawn = 0;
    window.requestAnimationFrame = draw => {
        const look = now => {
            // All callbacks of one frame have the same time.
            if (now !== drawn && now - drawn < 90) return frame(look);
            drawn = now;
            draw(now);
        };
        return frame(look);
    };
})()"#;

/// A script for [`Tab::before_load`](crate::tab::Tab::before_load) that speeds up the page: frames follow each other as
/// fast as possible, and each advances the page's clock by nearly the maximum number of ticks that a local room plays
/// at once.
pub const HASTE: &str = r#"(() => {
    const FRAME_MS = 80;
    const now = performance.now.bind(performance);
    let ahead = 0, waiting = [];
    performance.now = () => now() + ahead;
    const {port1, port2} = new MessageChannel();
    port1.onmessage = () => {
        ahead += FRAME_MS;
        const due = waiting;
        waiting = [];
        for (const draw of due) draw(performance.now());
    };
    window.requestAnimationFrame = draw => {
        if (waiting.push(draw) === 1) port2.postMessage(null);
        return 0;
    };
})()"#;

/// A script for [`Tab::before_load`](crate::tab::Tab::before_load) that takes the page's storage away, as browsers do in
/// the frames of other sites.
pub const NO_STORAGE: &str = r#"for (const name of ['localStorage', 'sessionStorage'])
    Object.defineProperty(window, name, {get() {
        throw new DOMException('Access is denied for this document.', 'SecurityError');
    }});"#;

/// Waits for several frames, since a slow renderer shows a page with a delay.
pub const FRAMES: &str = "(async () => { for (let frame = 0; frame < 20; frame += 1) \
    await new Promise(requestAnimationFrame); return true; })()";
