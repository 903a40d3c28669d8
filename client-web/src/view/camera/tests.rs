use super::*;

const WORLD: Vec2 = Vec2::new(200.0, 112.5);

fn target(pixels: [u32; 2], hero: Option<(Vec2, Vec2)>) -> Target {
    Target { pixels, hero, top: 0, bottom: 0, elapsed_s: 1.0 / 60.0 }
}

#[test]
fn fit_shows_the_whole_world_on_any_screen() {
    for pixels in [[1280, 720], [720, 1480], [3840, 2160], [300, 300]] {
        let view = Camera::new(CameraRule::Fit, WORLD).view(target(pixels, None));
        for corner in [Vec2::ZERO, WORLD] {
            let pixel = view.to_pixel(corner);
            assert!((0.0..=pixels[0] as f32).contains(&pixel.x), "{pixels:?} {pixel}");
            assert!((0.0..=pixels[1] as f32).contains(&pixel.y), "{pixels:?} {pixel}");
        }
    }
}

#[test]
fn fit_keeps_the_floor_above_the_key_caps() {
    let hud = Target { bottom: 60, ..target([1280, 720], None) };
    let view = Camera::new(CameraRule::Fit, WORLD).view(hud);
    assert!(view.to_pixel(Vec2::ZERO).y <= 660.0);
    assert!(view.to_pixel(WORLD).y >= 0.0);
}

#[test]
fn a_hero_at_the_ceiling_is_below_the_bar() {
    let ceiling = Vec2::new(100.0, WORLD.y);
    for (rule, pixels) in [
        (CameraRule::Fit, [1280, 657]),
        (CameraRule::Follow { height: 60.0 }, [1280, 657]),
        (CameraRule::Fit, [390, 844]),
        (CameraRule::Follow { height: 60.0 }, [390, 844]),
    ] {
        let hud = Target { top: 96, ..target(pixels, Some((ceiling, Vec2::ZERO))) };
        let top = Camera::new(rule, WORLD).view(hud).to_pixel(ceiling).y;
        assert!(top >= 95.9, "{rule:?} on {pixels:?}: at {top}");
    }
    let low = Target { top: 96, ..target([1280, 657], Some((Vec2::new(100.0, 30.0), Vec2::ZERO))) };
    let view = Camera::new(CameraRule::Follow { height: 60.0 }, WORLD).view(low);
    assert_eq!(view.center.y, 30.0, "elsewhere the hero stays in the middle");
}

#[test]
fn a_hero_on_the_floor_is_above_the_thumbs() {
    let floor = Some((Vec2::new(100.0, 0.0), Vec2::ZERO));
    let mut camera = Camera::new(CameraRule::Follow { height: 60.0 }, WORLD);
    let bottom = camera.view(target([390, 844], floor)).to_pixel(Vec2::new(100.0, 0.0)).y;
    assert!(bottom < 680.0, "at {bottom}");
    let below_a_bar = Target { top: 96, ..target([390, 844], floor) };
    let bottom = camera.view(below_a_bar).to_pixel(Vec2::new(100.0, 0.0)).y;
    assert!(bottom < 680.0, "at {bottom}");
}

#[test]
fn fit_leaves_the_lower_part_of_an_upright_phone_to_the_thumbs() {
    let view = Camera::new(CameraRule::Fit, WORLD).view(target([720, 1480], None));
    let middle = view.to_pixel(WORLD * 0.5).y;
    assert!(middle < 0.45 * 1480.0, "middle at {middle}");
}

#[test]
fn an_upright_phone_follows_the_hero_with_the_full_height_in_view() {
    let mut camera = Camera::new(CameraRule::Fit, WORLD);
    let hero = Vec2::new(150.0, 20.0);
    let view = camera.view(target([720, 1480], Some((hero, Vec2::ZERO))));
    assert_eq!(view.center.x, 150.0);
    for y in [0.0, WORLD.y] {
        let pixel = view.to_pixel(Vec2::new(150.0, y)).y;
        assert!((0.0..0.82 * 1480.0).contains(&pixel), "{y} at {pixel}");
    }
    let wide = Camera::new(CameraRule::Fit, WORLD).view(target([720, 1480], None));
    assert!(view.height < wide.height * 0.6, "{} of {}", view.height, wide.height);
}

#[test]
fn whole_shows_all_on_an_upright_phone_too() {
    let hero = Some((Vec2::new(150.0, 20.0), Vec2::ZERO));
    let view = Camera::new(CameraRule::Whole, WORLD).view(target([720, 1480], hero));
    for corner in [Vec2::ZERO, WORLD] {
        let pixel = view.to_pixel(corner);
        assert!((0.0..=720.0).contains(&pixel.x) && (0.0..=1480.0).contains(&pixel.y), "{pixel}");
    }
}

#[test]
fn follow_starts_on_the_hero_and_stays_in_the_world() {
    let mut camera = Camera::new(CameraRule::Follow { height: 60.0 }, WORLD);
    let hero = Vec2::new(2.0, 3.0);
    let view = camera.view(target([1280, 720], Some((hero, Vec2::ZERO))));
    let half = Vec2::new(60.0 * 1280.0 / 720.0, 60.0) * 0.5;
    assert_eq!(view.center, half);
}

#[test]
fn follow_moves_smoothly_towards_the_hero() {
    let mut camera = Camera::new(CameraRule::Follow { height: 20.0 }, WORLD);
    camera.view(target([100, 100], Some((Vec2::new(50.0, 50.0), Vec2::ZERO))));
    let near = camera.view(target([100, 100], Some((Vec2::new(55.0, 50.0), Vec2::ZERO)))).center.x;
    assert!(near > 50.0 && near < 52.0, "{near}");
    for _ in 0..120 {
        camera.view(target([100, 100], Some((Vec2::new(55.0, 50.0), Vec2::ZERO))));
    }
    let there = camera.view(target([100, 100], Some((Vec2::new(55.0, 50.0), Vec2::ZERO)))).center.x;
    assert!((there - 55.0).abs() < 0.1, "{there}");
}

#[test]
fn follow_moves_as_far_as_the_room_expects_at_any_frame_rate() {
    let way = |frames_a_tick: u32| {
        let mut camera = Camera::new(CameraRule::Follow { height: 20.0 }, WORLD);
        let hero = |x, speed| Some((Vec2::new(x, 50.0), Vec2::new(speed, 0.0)));
        camera.view(target([100, 100], hero(50.0, 0.0)));
        let elapsed_s = 1.0 / (60.0 * frames_a_tick as f32);
        let frame =
            |_| camera.view(Target { elapsed_s, ..target([100, 100], hero(50.0, 60.0)) }).center.x;
        (0..frames_a_tick).map(frame).last().expect("at least one frame") - 50.0
    };
    let expected = CAMERA_AHEAD_TICKS as f32 / CAMERA_CATCH_UP_TICKS as f32;
    for frames_a_tick in [1, 2, 4] {
        let way = way(frames_a_tick);
        assert!((way - expected).abs() < 1e-3, "{frames_a_tick} frames a tick: {way}");
    }
}

#[test]
fn follow_jumps_when_the_hero_is_teleported() {
    let mut camera = Camera::new(CameraRule::Follow { height: 20.0 }, WORLD);
    camera.view(target([100, 100], Some((Vec2::new(50.0, 50.0), Vec2::ZERO))));
    let view = camera.view(target([100, 100], Some((Vec2::new(150.0, 50.0), Vec2::ZERO))));
    assert_eq!(view.center.x, 150.0);
}

#[test]
fn follow_stays_where_it_was_while_there_is_no_hero() {
    let mut camera = Camera::new(CameraRule::Follow { height: 20.0 }, WORLD);
    let there = camera.view(target([100, 100], Some((Vec2::new(50.0, 50.0), Vec2::ZERO))));
    assert_eq!(camera.view(target([100, 100], None)).center, there.center);
}

#[test]
fn after_a_cut_the_view_waits_for_a_hero_and_jumps_to_it() {
    let mut camera = Camera::new(CameraRule::Follow { height: 20.0 }, WORLD);
    let there = camera.view(target([100, 100], Some((Vec2::new(50.0, 50.0), Vec2::ZERO))));
    camera.cut();
    assert_eq!(camera.view(target([100, 100], None)).center, there.center);
    let hero = |x| Some((Vec2::new(x, 50.0), Vec2::ZERO));
    assert_eq!(camera.view(target([100, 100], hero(55.0))).center.x, 55.0);
    assert!(camera.view(target([100, 100], hero(60.0))).center.x < 58.0, "smooth again");
}

#[test]
fn a_spectator_begins_with_a_hero_where_all_would_be_tiny() {
    let begins = |name: &str, pixels| {
        let scene = Scene::built_in().into_iter().find(|scene| scene.name == name);
        begins_with_a_hero(&scene.expect("a shipped scene"), pixels)
    };
    let (laptop, phone) = ([1280, 720], [720, 1480]);
    assert_eq!(["arena", "hall"].map(|name| begins(name, laptop)), [false, true]);
    // Among these scenes, hockey always shows everything and pile has no heroes.
    let names = ["arena", "hall", "hockey", "pile"];
    assert_eq!(names.map(|name| begins(name, phone)), [true, true, false, false]);
}
