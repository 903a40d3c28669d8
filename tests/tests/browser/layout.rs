//! The controls of a game on every screen, in every language: nothing covers anything else, the hero or the page's edge.

use anyhow::{Context, Result, ensure};
use jostle_tests::runner::{Case, Stage};
use jostle_tests::state::State;
use jostle_tests::tab::{Screen, Tab};
use std::sync::Arc;

const fn screen(width: u32, height: u32, touch: bool) -> Screen {
    Screen { width, height, touch, scale: if width > 2000 { 0.25 } else { 0.5 } }
}

const PHONES: [Screen; 3] =
    [screen(360, 640, true), screen(390, 844, true), screen(844, 390, true)];
const DESKS: [Screen; 3] =
    [screen(1280, 657, false), screen(1920, 1080, false), screen(3840, 2160, false)];

/// Half the side of a square around the hero, world units.
const HERO: f32 = 5.0;

/// Returns pairs of controls that overlap, and those that reach beyond the page. Of texts, only the lines count.
const CLASHES: &str = r##"hero => {
    const parts = [["hero", [hero]]];
    const add = (selector, lines) => {
        const rects = [];
        for (const element of document.querySelectorAll(selector)) {
            if (!element.checkVisibility({visibilityProperty: true})) continue;
            const range = document.createRange();
            range.selectNodeContents(element);
            rects.push(...(lines ? range.getClientRects() : [element.getBoundingClientRect()]));
        }
        parts.push([selector, rects.filter(r => r.width > 1 && r.height > 1)]);
    };
    const bar = ["#menu", "#bar-left > button", "#bar-right > button", "#board"];
    for (const box of [...bar, "#players", "#feed li", ".caps .cap", "#stick", "#tools button", "#lag-badge"])
        add(box, false);
    for (const text of ["#room-title", "#room-code", "#hint", "#turn", "#round-task", "#race"]) add(text, true);
    add("#network", false);
    const clashes = [];
    parts.forEach(([name, rects], index) => {
        for (const r of rects) {
            if (name !== "hero" && (r.left < -1 || r.top < -1 || r.right > innerWidth + 1 || r.bottom > innerHeight + 1))
                clashes.push(`${name} leaves the page`);
            // News pass by, and a panel that was opened may cover all but the score and the bar.
            const mayCover = other => name === "hero" && ["#feed li", "#network"].includes(other)
                || other === "#network" && !bar.includes(name);
            for (const [other, others] of parts.slice(index + 1)) for (const o of mayCover(other) ? [] : others) {
                const [x, y] = [Math.min(r.right, o.right) - Math.max(r.left, o.left),
                    Math.min(r.bottom, o.bottom) - Math.max(r.top, o.top)];
                if (x > 1 && y > 1) clashes.push(`${name} and ${other} by ${Math.round(x)} x ${Math.round(y)}`);
            }
        }
    });
    const title = document.querySelector("#room-title");
    if (title.checkVisibility() && title.scrollWidth > title.clientWidth + 1) clashes.push("the title is cut");
    return clashes;
}"##;

/// Opens a private room with a scene, remembers its key and returns its code.
const OPEN: &str = "async scene => {
    const body = JSON.stringify({scene, private: true});
    const headers = {'content-type': 'application/json'};
    const room = await (await fetch('/api/rooms', {method: 'POST', headers, body})).json();
    sessionStorage.setItem(`jostle.host.${room.code}`, room.host_key);
    return room.code;
}";

pub fn cases() -> Vec<Case> {
    vec![
        Case::new("on_phones_no_control_covers_another", |stage| no_control_covers(stage, &PHONES)),
        Case::new("on_desks_no_control_covers_another", |stage| no_control_covers(stage, &DESKS)),
    ]
}

async fn no_control_covers(stage: Arc<Stage>, screens: &'static [Screen]) -> Result<()> {
    let mut clashes = Vec::new();
    for (language, scene) in [("en", "race"), ("de", "hockey"), ("de", "tower")] {
        let script =
            format!("Object.defineProperty(navigator, 'language', {{value: '{language}'}});");
        let lobby = stage.server.link("/");
        let tab = stage.visit_link_changed(&script, &lobby, screens[0]).await?;
        let code: String = tab.eval(&format!("({OPEN})('{scene}')")).await?;
        tab.go(&stage.server.link(&format!("/{code}"))).await?;
        tab.until("a hero of one's own", State::plays).await?;
        tab.until_true(&format!("document.documentElement.lang === '{language}'")).await?;
        tab.until_true("!document.querySelector('#close-room').hidden").await?;
        for panel in ["", "network-"] {
            if !panel.is_empty() {
                tab.click_on("#signal").await?;
            }
            for &screen in screens {
                let found = found(&tab, screen).await?;
                let size = format!("{} x {}", screen.width, screen.height);
                clashes.extend(
                    found
                        .iter()
                        .map(|clash| format!("{scene} in {language} {panel}at {size}: {clash}")),
                );
                tab.keep(&format!("layout-{panel}{scene}-{language}-{}", screen.width)).await?;
            }
        }
        stage.close(tab).await?;
    }
    ensure!(clashes.is_empty(), "{clashes:#?}");
    Ok(())
}

/// The clashes on a screen, once the camera has adapted to it.
async fn found(tab: &Tab, screen: Screen) -> Result<Vec<String>> {
    tab.resize(screen).await?;
    tab.until_true(&format!("innerWidth === {}", screen.width)).await?;
    // The camera looks at the bar several times a second.
    let ticks = tab.ticks(30).await?;
    let state = tab.until("two frames more", |s| s.drawn_frames > ticks.drawn_frames + 1).await?;
    let [x, y] = state.own_hero().context("a hero")?.pos;
    let [left, bottom] = tab.to_page([x - HERO, y - HERO]).await?;
    let [right, top] = tab.to_page([x + HERO, y + HERO]).await?;
    let hero = format!(
        "{{left: {left}, right: {right}, top: {top}, bottom: {bottom}, width: {}, height: {}}}",
        right - left,
        bottom - top
    );
    tab.eval(&format!("({CLASHES})({hero})")).await
}
