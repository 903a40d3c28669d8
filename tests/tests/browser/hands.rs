//! Input and accessibility: the settings with only the keyboard, names for screen readers, remapped keys, gamepads,
//! emotes, and the page in another language.

use anyhow::{Context, Result, ensure};
use jostle_tests::runner::{Case, Stage};
use jostle_tests::state::State;
use jostle_tests::tab::{Screen, Tab};
use std::sync::Arc;

/// A gamepad controlled by the test.
const PAD: &str = "window.pad = {connected: true, mapping: 'standard', \
    buttons: Array.from({length: 17}, () => ({pressed: false})), axes: [0, 0, 0, 0]}; \
    navigator.getGamepads = () => [null, window.pad];";
const CONNECT: &str = "window.dispatchEvent(new Event('gamepadconnected'))";

/// Finds reachable controls without an accessible name, which may be a label, text or an ARIA attribute.
const NAMELESS: &str = "[...document.querySelectorAll('button, a[href], input, select, textarea, [tabindex]')] \
    .filter(element => element.checkVisibility() && !element.closest('[inert], [aria-hidden=true]')) \
    .filter(element => ![element.ariaLabel, element.labels?.[0]?.textContent, element.innerText, element.title] \
        .some(name => name?.trim())) \
    .map(element => element.outerHTML.slice(0, 120))";
/// Returns the id or action of the focused control.
const FOCUSED: &str =
    "(e => e.id || `${e.dataset.action}=${e.dataset.value}`)(document.activeElement)";

/// Finds controls and cards that have no border on one of their sides.
const FLAT: &str = "[...document.querySelectorAll('button, select, textarea, input[type=text], .panel, .choice, \
        .presets label, .speeds label, .rooms a, .scenes > li, .track')] \
    .filter(e => !/^([1-9]\\d*px ?)+$/.test(getComputedStyle(e).borderWidth)) \
    .map(e => e.outerHTML.slice(0, 120))";

const NARROW: Screen = Screen { width: 360, height: 640, touch: true, scale: 0.5 };

pub fn cases() -> Vec<Case> {
    vec![
        Case::new("the_settings_are_changed_by_keyboard_alone", settings_by_keyboard),
        Case::new("a_gamepad_moves_the_hero", a_gamepad_moves_the_hero),
        Case::new("an_emote_is_seen_by_others", an_emote_is_seen_by_others),
        Case::new("the_page_speaks_german", the_page_speaks_german),
        Case::new("controls_have_edges_in_forced_colors", controls_have_edges_in_forced_colors),
        Case::new("new_screens_fit_phones", |stage| new_screens_fit(stage, NARROW)),
        Case::new("new_screens_fit_laptops", |stage| new_screens_fit(stage, Screen::LAPTOP)),
        Case::new("new_screens_fit_large_screens", |stage| new_screens_fit(stage, Screen::LARGE)),
    ]
}

pub async fn ensure_named(tab: &Tab) -> Result<()> {
    let nameless: Vec<String> = tab.eval(NAMELESS).await?;
    ensure!(nameless.is_empty(), "controls without a name: {nameless:#?}");
    Ok(())
}

/// Presses Tab until the wanted control has the focus.
async fn tab_to(tab: &Tab, wanted: &str) -> Result<()> {
    for _ in 0..60 {
        tab.press("Tab").await?;
        if tab.eval::<String>(FOCUSED).await? == wanted {
            return Ok(());
        }
    }
    anyhow::bail!("Tab does not lead to {wanted}")
}

async fn settings_by_keyboard(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit("/", Screen::LAPTOP).await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    ensure_named(&tab).await?;
    tab_to(&tab, "lobby-settings").await?;
    tab.press("Enter").await?;
    tab.until_true("!document.querySelector('#settings').hidden").await?;
    ensure_named(&tab).await?;
    tab.until_true("document.activeElement.id === 'language'").await?;
    for control in ["calm-on", "full-on", "choose-key=up", "choose-key=edit"] {
        tab_to(&tab, control).await?;
    }
    tab_to(&tab, "calm-on").await?;
    let calm = "document.documentElement.dataset.calm === 'yes'";
    ensure!(!tab.eval::<bool>(calm).await?, "not calm at first");
    tab.press(" ").await?;
    tab.until_true(calm).await?;
    tab_to(&tab, "choose-key=hold").await?;
    tab.press("Enter").await?;
    tab.until_true("document.activeElement.ariaPressed === 'true'").await?;
    tab.press("c").await?;
    let note = "document.querySelector('#settings-note').textContent";
    tab.until_true(&format!("{note} === 'C: Grab. Shake is now on X.'")).await?;
    tab_to(&tab, "reset-hands").await?;
    tab.press("Escape").await?;
    tab.until_true("document.querySelector('#settings').hidden").await?;
    tab.until_true("document.activeElement.id === 'lobby-settings'").await?;
    tab.go(&stage.server.link("/")).await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    tab.until_true(calm).await.context("calm is remembered")
}

async fn own_x(tab: &Tab) -> Result<f32> {
    Ok(tab.state().await?.own_hero().context("a hero")?.pos[0])
}

async fn a_gamepad_moves_the_hero(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit_changed(PAD, "/arena").await?;
    tab.until("a hero of one's own", State::plays).await?;
    tab.eval::<bool>(CONNECT).await?;
    let before = own_x(&tab).await?;
    tab.eval::<f64>("window.pad.axes[0] = 1").await?;
    tab.until("a hero further right", |s| s.own_hero().is_some_and(|h| h.pos[0] > before + 5.0))
        .await?;
    tab.eval::<f64>("window.pad.axes[0] = 0").await?;
    // A remapped button replaces the default one.
    tab.click_on("#settings-button").await?;
    tab.click_on("[data-action='choose-button'][data-value='emote']").await?;
    tab.eval::<bool>("window.pad.buttons[5].pressed = true").await?;
    tab.until_true("document.querySelector('[data-action=choose-button][data-value=emote] kbd').textContent === 'RB'")
        .await?;
    tab.eval::<bool>("(window.pad.buttons[5].pressed = false, true)").await?;
    tab.press("Escape").await?;
    // The page polls the gamepad once per frame so it could otherwise miss that the button was released.
    let drawn = tab.state().await?.drawn_frames;
    tab.until("two frames more", |s| s.drawn_frames > drawn + 1).await?;
    tab.eval::<bool>("window.pad.buttons[5].pressed = true").await?;
    tab.until_true("!document.querySelector('#wheel').hidden").await?;
    tab.eval::<f64>("window.pad.axes[2] = 1").await?;
    tab.until_true("document.querySelector('#wheel').children[2].ariaPressed === 'true'").await?;
    tab.eval::<bool>("(window.pad.buttons[5].pressed = false, true)").await?;
    tab.until_true("document.querySelector('#emotes use')?.getAttribute('href') === '#emote-2'")
        .await
}

async fn an_emote_is_seen_by_others(stage: Arc<Stage>) -> Result<()> {
    let ada = stage.play("arena", Screen::SMALL).await?;
    let bob = stage.play("arena", Screen::SMALL).await?;
    ada.press("g").await?;
    ada.until_true("!document.querySelector('#wheel').hidden").await?;
    ensure_named(&ada).await?;
    ada.eval::<bool>("(document.querySelector('#wheel').children[3].focus(), true)").await?;
    ada.press("Enter").await?;
    ada.until_true("document.querySelector('#wheel').hidden").await?;
    bob.until_true("document.querySelector('#emotes use')?.getAttribute('href') === '#emote-3'")
        .await?;
    bob.until_true("document.querySelector('#emote-said').textContent.endsWith(': Well done')")
        .await?;
    bob.until_true("!document.querySelector('#emotes li')").await.context("for a while")
}

async fn the_page_speaks_german(stage: Arc<Stage>) -> Result<()> {
    let german = "Object.defineProperty(navigator, 'language', {value: 'de-AT'});";
    let tab = stage.visit_changed(german, "/").await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    tab.until_true("document.querySelector('#play').textContent === 'Spielen'").await?;
    tab.until_true("document.documentElement.lang === 'de'").await?;
    tab.until_true(
        "document.querySelector('.scenes .alone').textContent.startsWith('Allein spielen')",
    )
    .await?;
    ensure_named(&tab).await?;
    tab.keep("lobby-german-640").await?;
    tab.click_on("#lobby-settings").await?;
    tab.eval::<bool>(
        "(() => { const list = document.querySelector('#language'); list.value = 'en'; \
         return list.dispatchEvent(new Event('change')); })()",
    )
    .await?;
    tab.until_true("document.querySelector('#play').textContent === 'Play'").await?;
    tab.go(&stage.server.link("/")).await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    tab.until_true("document.querySelector('#play').textContent === 'Play'").await
}

/// Where the visitor chose the colours, shadows and backgrounds are not drawn. Hidden controls have a style too.
async fn controls_have_edges_in_forced_colors(stage: Arc<Stage>) -> Result<()> {
    let _ada = stage.play("arena", Screen::TINY).await?;
    let tab = stage.visit("/", Screen::SMALL.sharp()).await?;
    tab.until_true("document.querySelector('#room-list a')").await?;
    tab.force_colors().await?;
    let flat: Vec<String> = tab.eval(FLAT).await?;
    ensure!(flat.is_empty(), "controls without an edge: {flat:#?}");
    tab.keep("forced-colors-lobby").await?;
    tab.click_on("#lobby-settings").await?;
    tab.click_on("[data-action=choose-key]").await?;
    let wide = |which: &str| {
        format!("parseInt(getComputedStyle(document.querySelector('{which}')).borderTopWidth) > 1")
    };
    tab.until_true(&wide("[data-action=choose-key][aria-pressed=true]")).await?;
    tab.keep("forced-colors-settings").await?;
    let [chosen, other] = ["#speeds label:has(:checked)", "#speeds label"];
    ensure!(tab.eval::<bool>(&wide(chosen)).await?, "the chosen speed looks like the others");
    ensure!(!tab.eval::<bool>(&wide(other)).await?, "another speed looks chosen");
    Ok(())
}

async fn new_screens_fit(stage: Arc<Stage>, screen: Screen) -> Result<()> {
    let width = screen.width;
    let lobby = stage.visit("/", screen).await?;
    lobby.until("the lobby", |s| s.state == "lobby").await?;
    let wide = "document.documentElement.scrollWidth > innerWidth";
    ensure!(!lobby.eval::<bool>(wide).await?, "the lobby is too wide for {width} pixels");
    if !screen.touch {
        // The first game shows what there is further down.
        let first = "document.querySelector('#game-list li img')";
        lobby.until_true(first).await?;
        let seen = format!("innerHeight - {first}.getBoundingClientRect().top");
        let seen: f64 = lobby.eval(&seen).await?;
        ensure!(seen > 60.0, "{seen} pixels of the first game are on a screen of {width}");
    }
    lobby.keep(&format!("lobby-{width}")).await?;
    let tab = stage.play("arena", screen).await?;
    tab.click_on("#settings-button").await?;
    tab.until_true("!document.querySelector('#settings').hidden").await?;
    let wide = "document.querySelector('.settings').scrollWidth > document.querySelector('.settings').clientWidth";
    ensure!(!tab.eval::<bool>(wide).await?, "the settings are too wide for {width} pixels");
    tab.keep(&format!("settings-{width}")).await?;
    tab.click_on("#settings-close").await?;
    tab.click_on("#emote-button").await?;
    tab.until_true("!document.querySelector('#wheel').hidden").await?;
    let inside = "[...document.querySelectorAll('#wheel button')].map(b => b.getBoundingClientRect()) \
            .every(r => r.left >= 0 && r.top >= 0 && r.right <= innerWidth && r.bottom <= innerHeight)";
    ensure!(tab.eval::<bool>(inside).await?, "the wheel is cut at {width} pixels");
    tab.keep(&format!("wheel-{width}")).await?;
    tab.press("Escape").await?;
    Ok(())
}
