//! The scene editor: placing pieces by mouse, touch and keyboard, editing the text, and playing, saving and sharing the
//! result.

use anyhow::{Context, Result, ensure};
use jostle_game::Scene;
use jostle_tests::runner::Stage;
use jostle_tests::tab::{Screen, Tab};
use serde_json::json;
use std::sync::Arc;

/// Maximum number of frames from pressing E until the game moves, which is half a second.
const FRAMES_MAX: usize = 30;

/// Records the page's state and the displayed tick in each frame until `window.noted` is removed.
const NOTE: &str = "(() => { const noted = window.noted = []; const look = () => { \
    const root = document.documentElement; \
    noted.push([root.dataset.state, root.dataset.tick, performance.now()]); \
    if (window.noted === noted) requestAnimationFrame(look); }; look(); return true; })()";

pub async fn open(stage: &Stage, hash: &str, screen: Screen) -> Result<Tab> {
    let tab = stage.visit(&format!("/{hash}"), screen).await?;
    tab.until("the editor", |s| s.state == "editing").await?;
    tab.until("a picture", |s| s.drawn_frames > 1).await?;
    Ok(tab)
}

pub async fn text(tab: &Tab) -> Result<String> {
    tab.eval("document.querySelector('#text').value").await
}

async fn until_text(tab: &Tab, part: &str) -> Result<()> {
    let quoted = serde_json::to_string(part)?;
    tab.until_true(&format!("document.querySelector('#text').value.includes({quoted})")).await
}

/// Waits until the cursor in the text is at most two lines below `part`, and its line is in view.
async fn until_cursor(tab: &Tab, part: &str) -> Result<()> {
    let quoted = serde_json::to_string(part)?;
    tab.until_true(&format!(
        "(area => {{ const lines = area.value.split('\\n'); \
         const line = area.value.slice(0, area.selectionStart).split('\\n').length - 1; \
         const down = line * area.scrollHeight / lines.length - area.scrollTop; \
         return lines.slice(line - 2, line + 1).join().includes({quoted}) && down >= 0 && down < area.clientHeight - 20; \
         }})(document.querySelector('#text'))"
    ))
    .await
    .with_context(|| format!("the cursor at {part}"))
}

/// Drags a piece from the palette to a world point.
async fn pull(tab: &Tab, piece: &str, to: [f32; 2]) -> Result<()> {
    let from = tab.middle_of(&format!("[data-piece={piece}]")).await?;
    let to = tab.to_page(to).await?;
    match tab.screen().touch {
        true => tab.swipe(from, to).await,
        false => tab.drag(from, to).await,
    }
}

async fn drag(tab: &Tab, from: [f32; 2], to: [f32; 2]) -> Result<()> {
    let [from, to] = [tab.to_page(from).await?, tab.to_page(to).await?];
    match tab.screen().touch {
        true => tab.swipe(from, to).await,
        false => tab.drag(from, to).await,
    }
}

/// Returns the displayed error message.
async fn error(tab: &Tab) -> Result<String> {
    tab.eval(
        "(() => { const error = document.querySelector('#edit-error'); \
         return error.hidden ? '' : error.textContent; })()",
    )
    .await
}

async fn underlined(tab: &Tab) -> Result<String> {
    tab.eval("[...document.querySelectorAll('#underlay mark')].map(m => m.textContent).join('')")
        .await
}

/// Returns the displayed error message and the underlined text.
pub async fn errors_of(tab: &Tab) -> Result<[String; 2]> {
    Ok([error(tab).await?, underlined(tab).await?])
}

pub async fn a_scene_is_built_from_nothing_played_undone_and_shared(
    stage: Arc<Stage>,
) -> Result<()> {
    let tab = open(&stage, "#edit", Screen::LAPTOP).await?;
    tab.keep("editor-empty").await?;
    pull(&tab, "wall", [160.0, 30.0]).await?;
    until_text(&tab, "position = [160, 30]").await?;
    // Dragging the handle at its upper right corner turns the piece into a step on the floor.
    let corner = tab.to_page([164.0, 50.0]).await?;
    let goal = tab.to_page([310.0, 14.0]).await?;
    tab.drag([corner[0] + 6.0, corner[1] - 6.0], [goal[0] + 6.0, goal[1] - 6.0]).await?;
    until_text(&tab, "size = [154, 6]").await?;
    for (step, x) in [200.0, 215.0, 230.0].into_iter().enumerate() {
        pull(&tab, "block", [x, 60.0 + 10.0 * step as f32]).await?;
    }
    pull(&tab, "ball", [232.0, 120.0]).await?;
    pull(&tab, "spawn", [180.0, 40.0]).await?;
    pull(&tab, "zone", [280.0, 40.0]).await?;
    until_text(&tab, "name = \"zone-1\"").await?;
    ensure!(error(&tab).await?.is_empty(), "{}", error(&tab).await?);
    tab.keep_on_all_screens("editor-built").await?;

    // Add a rule in the text.
    tab.click_on("#tab-text").await?;
    let built = text(&tab).await?;
    let ruled = format!(
        "{built}\n# A hero that comes there is told.\n[[rules]]\nenter = \"zone-1\"\nsay = \"Well done\"\n"
    );
    tab.fill("#text", &ruled).await?;
    until_text(&tab, "[[rules]]").await?;
    tab.until_true("document.querySelector('#edit-error').hidden").await?;
    Scene::parse("my-scene.toml", &ruled)?;

    // Playing starts in the same frame, and Escape returns to the edited scene.
    tab.press("Escape").await?;
    let before: Vec<f64> = tab.eval(PLACE).await?;
    tab.eval::<bool>(NOTE).await?;
    tab.press("e").await?;
    tab.until("the game", |s| s.state == "playing" && s.ticks() > 20).await?;
    tab.keep_on_all_screens("editor-played").await?;
    assert_eq!(tab.eval::<Vec<f64>>(PLACE).await?, before, "the picture stays where it was");
    stage.note(check_start(&tab).await?);
    tab.press("e").await?;
    tab.until("the editor", |s| s.state == "editing").await?;
    assert_eq!(text(&tab).await?, ruled);

    // Share the scene.
    tab.eval::<bool>(
        "(navigator.clipboard.writeText = text => { window.copied = text; return Promise.resolve(); \
         }, true)",
    )
    .await?;
    tab.click_on("#edit-copy").await?;
    tab.until_true("window.copied").await?;
    let link: String = tab.eval("window.copied").await?;
    let other = stage.visit_link(&link, Screen::SMALL).await?;
    other.until("the scene, played", |s| s.state == "playing" && s.ticks() > 5).await?;
    other.press("e").await?;
    other.until("the scene, edited", |s| s.state == "editing").await?;
    assert_eq!(text(&other).await?, ruled, "to the last byte");

    // Undo all changes, then redo them.
    tab.press("Escape").await?;
    while tab.eval::<bool>(CAN_UNDO).await? {
        let before = text(&tab).await?;
        tab.press("Ctrl+z").await?;
        let quoted = serde_json::to_string(&before)?;
        tab.until_true(&format!("document.querySelector('#text').value !== {quoted}")).await?;
    }
    while !tab.eval::<bool>("document.querySelector('#edit-redo').disabled").await? {
        tab.press("Ctrl+Shift+z").await?;
    }
    assert_eq!(text(&tab).await?, ruled);
    Ok(())
}

/// Builds a game with two goals, two teams and a round by dragging and clicking only, and plays it.
pub async fn a_game_is_built_by_clicks(stage: Arc<Stage>) -> Result<()> {
    let tab = open(&stage, "#edit", Screen::LAPTOP).await?;
    for (piece, at) in [("goal", [20.0, 30.0]), ("goal", [300.0, 30.0]), ("ball", [300.0, 120.0])] {
        pull(&tab, piece, at).await?;
        let said = if piece == "ball" { "ball 4 at" } else { "goal" };
        tab.until_true(&format!(
            "document.querySelector('#edit-said').textContent.startsWith('{said}')"
        ))
        .await?;
    }
    tab.keep("editor-goals").await?;
    let built = text(&tab).await?;
    let scene = Scene::parse("my-scene.toml", &built)?;
    let rules = &scene.rules;
    assert_eq!((rules.teams.len(), rules.zones.len(), rules.rules.len()), (2, 2, 2));
    ensure!(rules.round.is_some(), "{built}");
    tab.click_on("#edit-toggle").await?;
    tab.until_true("document.querySelectorAll('#sides li').length === 2").await?;
    // The ball falls into the goal of the second team.
    tab.until_true("parseInt(document.querySelector('#sides .score').textContent) > 0").await?;
    tab.keep("editor-goals-played").await?;
    tab.click_on("#edit-toggle").await?;
    tab.until("the editor", |s| s.state == "editing").await?;
    // A template replaces the text, and undo brings it back, with the cursor where the change was.
    tab.click_on("#tab-text").await?;
    tab.click_on("#edit-new").await?;
    tab.keep("editor-new").await?;
    tab.click_on("[data-action=edit-new][data-value=race]").await?;
    until_text(&tab, "title = \"My race\"").await?;
    tab.keep("editor-race").await?;
    tab.click_on("#edit-undo").await?;
    until_text(&tab, "goal-2").await?;
    assert_eq!(text(&tab).await?, built);
    tab.click_on("#edit-undo").await?;
    tab.until_true("!document.querySelector('#text').value.includes('radius')").await?;
    let cursor: usize = tab.eval("document.querySelector('#text').selectionStart").await?;
    let now = text(&tab).await?;
    ensure!(built.starts_with(&now[..cursor]) && cursor < now.len(), "{cursor} of {}", now.len());
    tab.click_on("#edit-redo").await?;
    assert_eq!(text(&tab).await?, built);
    until_cursor(&tab, "radius").await
}

const CAN_UNDO: &str = "!document.querySelector('#edit-undo').disabled";

/// The position and size of the canvas on the page.
const PLACE: &str = "(() => { const r = document.querySelector('#stage').getBoundingClientRect(); \
    return [r.x, r.y, r.width, r.height]; })()";

/// Checks that the page switches directly from editing to playing, and that the game soon starts moving.
async fn check_start(tab: &Tab) -> Result<String> {
    let noted: Vec<(String, Option<String>, f64)> = tab
        .eval("(() => { const noted = window.noted; window.noted = null; return noted; })()")
        .await?;
    let edits =
        noted.iter().rposition(|(state, ..)| state == "editing").context("it was edited")?;
    let moves = |(state, tick, _): &(String, Option<String>, f64)| {
        state == "playing" && tick.as_deref().is_some_and(|tick| !matches!(tick, "0" | "NaN"))
    };
    let played = noted.iter().position(moves).context("it is played")?;
    let between: Vec<&str> =
        noted[edits..played].iter().map(|(state, ..)| state.as_str()).collect();
    ensure!(between.iter().all(|state| matches!(*state, "editing" | "playing")), "{between:?}");
    ensure!(between.len() <= FRAMES_MAX, "{} frames", between.len());
    let took_ms = noted[played].2 - noted[edits].2;
    Ok(format!("from E to a moving game: {} frames, {took_ms:.0} ms", between.len()))
}

pub async fn a_shipped_scene_keeps_its_comments(stage: Arc<Stage>) -> Result<()> {
    let lobby = stage.visit("/", Screen::LAPTOP).await?;
    lobby.until("the lobby", |s| s.state == "lobby").await?;
    lobby.until_true("document.querySelectorAll('#scenes li').length >= 20").await?;
    lobby.keep("editor-lobby").await?;
    lobby.click_on("#game-list .edit[data-value=splash]").await?;
    lobby.until("the editor", |s| s.state == "editing" && s.drawn_frames > 1).await?;
    let source = text(&lobby).await?;
    let shipped = Scene::built_in().into_iter().find(|scene| scene.name == "splash");
    assert_eq!(source, shipped.context("it is shipped")?.source);
    lobby.keep("editor-splash").await?;
    lobby.click_on("#tab-text").await?;
    drag(&lobby, [160.0, 86.0], [150.0, 121.0]).await?;
    lobby
        .until_true("!document.querySelector('#text').value.includes('position = [160, 86]')")
        .await?;
    let moved = text(&lobby).await?;
    // Only two numbers have changed.
    let line = moved.lines().zip(source.lines()).find(|(new, old)| new != old);
    let (new, old) = line.context("a line changed")?;
    ensure!(old == "position = [160, 86]" && new.starts_with("position = [150, 12"), "{new}");
    assert_eq!(moved, source.replacen(old, new, 1));
    until_cursor(&lobby, new).await?;
    // Reloading the page loses nothing.
    let kept = serde_json::to_string(&moved)?;
    lobby.until_true(&format!("localStorage['jostle.draft.splash'] === {kept}")).await?;
    let link = lobby.link().await?;
    lobby.go(&link).await?;
    lobby.until("the editor", |s| s.state == "editing").await?;
    assert_eq!(text(&lobby).await?, moved);
    Ok(())
}

pub async fn errors_are_shown_at_their_place(stage: Arc<Stage>) -> Result<()> {
    let tab = open(&stage, "#edit=splash", Screen::LAPTOP).await?;
    let source = text(&tab).await?;
    tab.click_on("#tab-text").await?;
    for (from, to, marked) in [
        // Fields that are out of range, unknown, of the wrong type, missing or contradictory, and invalid TOML.
        ("restitution = 0.3", "restitution = 7", "restitution = 7"),
        ("thrust = [120", "trust = [120", "trust = [120, 160]"),
        ("packs = 3", "packs = \"three\"", "packs = \"three\""),
        ("kind = \"wall\"\n", "", "[[bodies]]"),
        ("[40, 16], [280", "[160, 2], [280", "[160, 2]"),
        ("players = 16", "players = = 16", "players = = 16"),
    ] {
        let wrong = source.replacen(from, to, 1);
        ensure!(wrong != source, "{from} is in the scene");
        let told = Scene::parse("splash.toml", &wrong).err().context("it is wrong")?.to_string();
        tab.fill("#text", &wrong).await?;
        let quoted = serde_json::to_string(&told)?;
        tab.until_true(&format!("document.querySelector('#edit-error').textContent === {quoted}"))
            .await?;
        tab.until_true("document.querySelector('#underlay mark')").await?;
        let under = underlined(&tab).await?;
        ensure!(under.contains(marked) || marked.contains(&under), "{under:?} for {told}");
        if from.starts_with("rest") {
            tab.keep_on_all_screens("editor-error").await?;
        }
        // A click on the message moves the cursor to the error.
        tab.click_on("#edit-error").await?;
        let before: String = tab
            .eval("(() => { const t = document.querySelector('#text'); \
                   return document.activeElement === t ? t.value.slice(0, t.selectionStart) : ''; })()")
            .await?;
        let line =
            before.lines().count() + usize::from(before.ends_with('\n') || before.is_empty());
        ensure!(told.contains(&format!(":{line}:")), "line {line} for {told}");
    }
    tab.fill("#text", &source).await?;
    tab.until_true("document.querySelector('#edit-error').hidden").await?;
    Ok(())
}

pub async fn the_form_is_that_of_the_scene(stage: Arc<Stage>) -> Result<()> {
    let tab = open(&stage, "#edit=splash", Screen::LAPTOP).await?;
    for (name, title) in [("splash", "Splash"), ("hill", "Hill"), ("splash", "Splash")] {
        tab.eval::<()>(&format!("void (location.hash = '#edit={name}')")).await?;
        let shown = "document.querySelector('[data-path=\"title\"] input')?.value";
        tab.until_true(&format!("{shown} === '{title}'")).await?;
        ensure!(text(&tab).await?.contains(&format!("title = \"{title}\"")), "{name}");
    }
    Ok(())
}

pub async fn a_scene_is_built_by_touch(stage: Arc<Stage>) -> Result<()> {
    let tab = open(&stage, "#edit", Screen::PHONE).await?;
    tab.keep("editor-phone-empty").await?;
    pull(&tab, "platform", [160.0, 60.0]).await?;
    until_text(&tab, "kind = \"platform\"").await?;
    drag(&tab, [160.0, 60.0], [120.0, 40.0]).await?;
    // A pixel on a phone is almost one unit.
    tab.until_true(
        "/position = \\[1(19|20|21), (39|40|41)\\]/.test(document.querySelector('#text').value)",
    )
    .await?;
    pull(&tab, "spawn", [120.0, 90.0]).await?;
    until_text(&tab, "spawns = [[40, 16], [1").await?;
    tab.keep("editor-phone").await?;
    tab.click_on("#tab-form").await?;
    tab.until_true("document.querySelector('#form-fields label')").await?;
    tab.keep("editor-phone-form").await?;
    tab.click_on("#tab-text").await?;
    tab.keep("editor-phone-text").await?;
    tab.click_on("#edit-toggle").await?;
    tab.until("the game", |s| s.state == "playing" && s.ticks() > 5).await?;
    tab.keep("editor-phone-played").await?;
    tab.click_on("#edit-toggle").await?;
    tab.until("the editor", |s| s.state == "editing").await?;
    tab.click_on("#edit-undo").await?;
    tab.until_true("!document.querySelector('#text').value.includes('16], [')").await?;
    Ok(())
}

/// Checks that the picture and the panels share the screen, and that every piece in the palette is reachable.
pub async fn the_editor_fits_a_phone_on_its_side(stage: Arc<Stage>) -> Result<()> {
    let tab = open(&stage, "#edit=splash", Screen::PHONE_ON_SIDE).await?;
    tab.keep("editor-side").await?;
    let [x, y, width, height]: [f64; 4] = tab.eval(PLACE).await?;
    ensure!(x == 0.0 && y <= 56.0 && width >= 300.0 && height >= 280.0, "{width} x {height}");
    tab.until_true(
        "(() => { const panel = document.querySelector('#palette').getBoundingClientRect(); \
         return panel.bottom <= innerHeight && panel.width >= 240 && panel.height >= 200; })()",
    )
    .await?;
    // Only one of its directions has a scroll bar.
    ensure!(
        tab.eval::<String>("getComputedStyle(document.querySelector('.palette')).overflowX")
            .await?
            == "hidden"
    );
    pull(&tab, "path", [160.0, 150.0]).await?;
    until_text(&tab, "path = [[").await?;
    tab.click_on("#tab-text").await?;
    tab.keep("editor-side-text").await?;
    tab.click_on("#edit-leave").await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    Ok(())
}

pub async fn a_scene_is_built_by_keys(stage: Arc<Stage>) -> Result<()> {
    let tab = open(&stage, "#edit", Screen::LAPTOP).await?;
    tab.eval::<bool>("(document.querySelector('[data-piece=block]').focus(), true)").await?;
    tab.press("Enter").await?;
    until_text(&tab, "position = [160, 90]").await?;
    tab.press("ArrowRight").await?;
    tab.press("Shift+ArrowUp").await?;
    until_text(&tab, "position = [161, 100]").await?;
    tab.press("Ctrl+d").await?;
    until_text(&tab, "position = [165, 104]").await?;
    tab.press("Delete").await?;
    tab.until_true("!document.querySelector('#text').value.includes('[165, 104]')").await?;
    tab.press("Ctrl+z").await?;
    until_text(&tab, "position = [165, 104]").await?;
    tab.press("Ctrl+y").await?;
    tab.until_true("!document.querySelector('#text').value.includes('[165, 104]')").await?;
    tab.press("Escape").await?;
    tab.eval::<bool>("(document.querySelector('#stage').focus(), true)").await?;
    for said in ["wall 1 at 160, 2", "wall 2", "wall 3", "block 4 at 161, 100", "spawn 1"] {
        tab.press("Tab").await?;
        tab.until_true(&format!(
            "document.querySelector('#edit-said').textContent.startsWith('{said}')"
        ))
        .await?;
    }
    // After the last piece, the focus leaves the stage.
    tab.press("Tab").await?;
    tab.until_true("document.activeElement.id !== 'stage'").await?;
    Ok(())
}

pub async fn a_form_writes_into_the_text(stage: Arc<Stage>) -> Result<()> {
    let tab = open(&stage, "#edit=splash", Screen::LAPTOP).await?;
    let at = tab.to_page([160.0, 86.0]).await?;
    tab.move_to(at, false).await?;
    tab.mouse_down(at).await?;
    tab.mouse_up(at).await?;
    let field = "[data-path='bodies[6].restitution'] input";
    tab.until_true(&format!("document.querySelector(\"{field}\")")).await?;
    tab.keep_on_all_screens("editor-form").await?;
    tab.fill(field, "0.5").await?;
    tab.press("Enter").await?;
    until_text(&tab, "size = [56, 4]\nrestitution = 0.5\n").await?;
    tab.click_on("#tab-text").await?;
    until_cursor(&tab, "restitution = 0.5").await?;
    tab.click_on("#tab-form").await?;
    tab.click_on(field).await?;
    tab.eval::<bool>("(document.activeElement.select(), true)").await?;
    tab.press("Delete").await?;
    tab.press("Tab").await?;
    tab.until_true("!document.querySelector('#text').value.includes('[56, 4]\\nrestitution')")
        .await?;
    Ok(())
}

/// Chooses an entry of a list in the form, or an amount in a number field.
async fn choose(tab: &Tab, path: &str, value: &str) -> Result<()> {
    let field = format!("[data-path='{path}'] :is(select, input)");
    tab.until_true(&format!("document.querySelector(\"{field}\")")).await?;
    tab.eval::<bool>(&format!(
        "(() => {{ const field = document.querySelector(\"{field}\"); field.value = '{value}'; \
         field.dispatchEvent(new Event('change', {{ bubbles: true }})); return true; }})()"
    ))
    .await
    .map(drop)
}

pub async fn a_game_is_made_by_choosing(stage: Arc<Stage>) -> Result<()> {
    let tab = open(&stage, "#edit", Screen::LAPTOP).await?;
    for (piece, at) in [("wall", [120.0, 100.0]), ("ball", [90.0, 60.0]), ("zone", [200.0, 40.0])] {
        pull(&tab, piece, at).await?;
    }
    until_text(&tab, "name = \"zone-1\"").await?;
    // The words come from a file of the page, and so does the guide that they link to.
    tab.until_true("document.querySelector('#form-fields').textContent.includes('Text on it')")
        .await?;
    let guide = "fetch(document.querySelector('#form-fields a').href).then(r => r.text())\
                 .then(t => window.guide = t)";
    tab.eval::<bool>(&format!("({guide}, true)")).await?;
    tab.until_true("window.guide?.includes('id=\"zones\"')").await?;
    tab.click_on("[data-path='zones[0].label'] input").await?;
    tab.keep_on_all_screens("form-zone").await?;
    tab.click_on("#edit-rule").await?;
    until_text(&tab, "enter = \"zone-1\"\nscore = 1\n").await?;
    choose(&tab, "zones[0].who", "block").await?;
    choose(&tab, "rules[0]#", "back").await?;
    until_text(&tab, "back = true").await?;
    tab.press("Escape").await?;
    tab.press("Escape").await?;
    tab.until_true("document.querySelector('#form-title').textContent === 'The scene'").await?;
    tab.click_on("[data-path='round'] input").await?;
    until_text(&tab, "[round]\ntime = 120\n").await?;
    choose(&tab, "round.goal", "5").await?;
    choose(&tab, "teams", "2").await?;
    until_text(&tab, "name = \"sky\"").await?;
    tab.keep_on_all_screens("form-scene").await?;
    tab.eval::<bool>("(document.querySelector('#form-rules').scrollIntoView(), true)").await?;
    tab.keep_on_all_screens("form-rules").await?;
    Scene::parse("my-scene.toml", &text(&tab).await?)?;
    ensure!(error(&tab).await?.is_empty(), "{}", error(&tab).await?);
    Ok(())
}

pub async fn a_scene_is_a_file_too(stage: Arc<Stage>) -> Result<()> {
    let tab = open(&stage, "#edit", Screen::LAPTOP).await?;
    let source = stage_scene("bounce")?;
    let quoted = json!(source).to_string();
    tab.eval::<bool>(&format!(
        "(() => {{ const data = new DataTransfer(); \
         data.items.add(new File([{quoted}], 'my-bounce.toml')); \
         window.dispatchEvent(new DragEvent('drop', {{dataTransfer: data, cancelable: true}})); \
         return true; }})()"
    ))
    .await?;
    until_text(&tab, "title = \"Bounce\"").await?;
    assert_eq!(text(&tab).await?, source);
    // The text would be saved under the name of the file.
    tab.eval::<bool>(
        "(HTMLAnchorElement.prototype.click = function () { \
         window.saved = [this.download, decodeURIComponent(this.href.split(',')[1])]; }, true)",
    )
    .await?;
    tab.click_on("#edit-save").await?;
    tab.until_true("window.saved").await?;
    let saved: (String, String) = tab.eval("window.saved").await?;
    assert_eq!(saved, ("my-bounce.toml".to_owned(), source));
    Ok(())
}

fn stage_scene(name: &str) -> Result<String> {
    let found = Scene::built_in().into_iter().find(|scene| scene.name == name);
    Ok(found.with_context(|| format!("{name} is shipped"))?.source)
}

/// Edits the same scene in two tabs of one visitor: a lot of work in one, then a single key press in the other.
pub async fn two_tabs_keep_a_draft_each(stage: Arc<Stage>) -> Result<()> {
    let a = open(&stage, "#edit", Screen::LAPTOP).await?;
    let visitor = stage.last_visitor().context("a visitor")?;
    let b = stage.visit_as(&visitor, "/#edit", Screen::SMALL).await?;
    b.until("the editor", |s| s.state == "editing").await?;
    for tab in [&a, &b] {
        tab.click_on("#tab-text").await?;
    }
    let work = r#"title = "Work""#;
    b.fill("#text", work).await?;
    a.until_true(&format!("localStorage['jostle.draft'] === '{work}'")).await?;
    a.until_true("document.querySelector('#notice-button').textContent === 'Open it here'").await?;
    a.keep("other-draft").await?;
    a.fill("#text", "size").await?;
    a.until_true("localStorage['jostle.draft.my-scene-2'] === 'size'").await?;
    assert_eq!(a.link().await?, stage.server.link("/#edit=my-scene-2"));
    a.keep("second-draft").await?;
    let kept: String = a.eval("localStorage['jostle.draft']").await?;
    assert_eq!((kept.as_str(), text(&b).await?.as_str()), (work, work));
    Ok(())
}
