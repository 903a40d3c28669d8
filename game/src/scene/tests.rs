//! Tests scene files: parsed values, errors with their lines, and that no text makes the reader panic.

use super::*;
use glam::Vec2;
use jostle_sim::Conjugate;
use jostle_sim::Relaxation;
use jostle_sim::{Motion, Shape, Solver};
use proptest::prelude::*;

pub(super) mod reference;

const SMALL: &str = r#"title = "Small"
size = [100, 50]
gravity = [0, -10]
groups = ["platform", "block", "hero", "pack"]
pairs = [["block", "platform"], ["hero", "platform"]]
tools = ["launch"]

[relaxation]
iterations = 15
correction = 0.8

[hero]
spawns = [[20, 30]]
size = [6, 8]

[[bodies]]
kind = "wall"
position = [50, 0]
size = [100, 4]

[[bodies]]
kind = "block"
name = "ball"
position = [50, 20]
radius = 3

[[bodies]]
kind = "platform"
path = [[10, 40], [90, 40]]
period = 4

[[layouts]]
kind = "block"
count = 2
area = [[5, 25], [95, 35]]
size = [2, 2]

[[emitters]]
recipe = "fire"
follow = "ball"
count = 20
every = 30
"#;

/// Checks that the small scene with one piece replaced is refused, with an error at this line and field.
#[track_caller]
fn refused(from: &str, to: &str, line: usize, field: &str, found: &str, allowed: &str) {
    assert_eq!(SMALL.matches(from).count(), 1, "{from} must be in the scene once");
    let error = Scene::parse("dir/small.toml", &SMALL.replace(from, to)).expect_err(to);
    assert_eq!(error.file, "dir/small.toml");
    let seen = (error.line, error.field.as_str(), error.found.as_str(), error.allowed.as_str());
    assert_eq!(seen, (line, field, found, allowed), "for {to}");
}

#[test]
fn only_scenes_of_the_conjugate_solver_sleep() {
    let parse = |lines: &str| Scene::parse("a.toml", &SMALL.replace("gravity = [0, -10]", lines));
    let sleeps = |lines: &str| parse(lines).expect("a scene").world_settings().sleeping;
    assert!(!sleeps("gravity = [0, -10]") && !sleeps("sleeping = false"));
    assert_eq!(parse("sleeping = true").expect_err("relaxation").field, "sleeping");
}

#[test]
fn every_shipped_scene_parses() {
    for (file, source) in BUILT_IN {
        if let Err(error) = Scene::parse(file, source) {
            panic!("{error}");
        }
    }
    assert_eq!(Scene::built_in()[0].name, "arena");
}

#[test]
fn a_small_scene_is_compiled_as_written() {
    let scene = Scene::parse("dir/small.toml", SMALL).expect("a good scene");
    assert_eq!((scene.name.as_str(), scene.title.as_str()), ("small", "Small"));
    assert_eq!(scene.source, SMALL);
    assert_eq!(scene.world.gravity, Vec2::new(0.0, -10.0));
    assert!(scene.groups_meet(0, 1) && scene.groups_meet(1, 0) && !scene.groups_meet(1, 1));
    assert_eq!(scene.bodies[0].def.motion, Motion::Static);
    assert_eq!(scene.bodies[0].def.group, 0, "a wall is in the platforms' group");
    assert_eq!(scene.bodies[1].def.shape, Shape::circle(3.0));
    assert_eq!(scene.bodies[2].def.motion, Motion::Kinematic);
    assert_eq!(scene.emitters[0].location, Location::Body(1));
    assert_eq!(scene.pack.as_ref().map(|pack| (pack.burst, pack.life_ticks)), Some((200, 300)));
    let names: Vec<&str> = scene.world.recipes.iter().map(|recipe| recipe.name.as_str()).collect();
    assert_eq!(names, ["explosion", "fire"], "presets join when they are used");
    assert_eq!(scene.world.kill_zone.low, Vec2::new(-50.0, -25.0));
    assert_eq!(scene.world.bodies_max, 3 + 2 + 16 + 16 * 8);
}

#[test]
fn the_fire_preset_is_the_chapters_recipe() {
    let fire = &presets()[0];
    assert_eq!(fire.life_ticks, [30, 230]);
    assert_eq!(fire.color_start, [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(fire.color_end, [[3.5, 0.4, 0.3, 0.6], [4.5, 0.5, 0.4, 0.6]]);
    assert_eq!((fire.size, fire.size_factor, fire.drag), ([5.5, 6.0], 0.98, 0.95));
    assert_eq!(fire.velocity, [Vec2::new(-10.0, 0.0), Vec2::new(10.0, 10.0)]);
    assert_eq!(fire.acceleration, Vec2::new(0.0, -50.0));
}

#[test]
fn unknown_names_are_refused_where_they_stand() {
    let fields = "the fields radius, size, mass, restitution, friction, gravity_scale, drag, group, \
                  thrust, speed_max, spawns, walk, lane";
    refused("spawns =", "places =", 13, "hero.places", "an unknown field", fields);
    let guess = "did you mean spawns?";
    refused("spawns =", "sapwns =", 13, "hero.sapwns", "an unknown field", guess);
    let error = Scene::parse("a.toml", &SMALL.replace("radius = 3", "raduis = 3"));
    let told = error.expect_err("a misspelled field").to_string();
    assert!(told.ends_with("found an unknown field; did you mean radius?"), "{told}");
    let groups = "one of platform, block, hero, pack";
    refused(
        r#"["block", "platform"]"#,
        r#"["blok", "platform"]"#,
        5,
        "pairs[0][0]",
        "\"blok\"",
        groups,
    );
    refused(
        "radius = 3",
        "radius = 3\ngroup = \"bloc\"",
        26,
        "bodies[1].group",
        "\"bloc\"",
        groups,
    );
    let recipes = "one of ember, explosion, fire, fountain, spark, torch";
    refused("recipe = \"fire\"", "recipe = \"fir\"", 39, "emitters[0].recipe", "\"fir\"", recipes);
    refused(
        "follow = \"ball\"",
        "follow = \"bal\"",
        40,
        "emitters[0].follow",
        "\"bal\"",
        "one of ball",
    );
    let tools = "one of steer, launch, dumb, spray, hold, agitate, clear, select, sling";
    refused("[\"launch\"]", "[\"lunch\"]", 6, "tools[0]", "\"lunch\"", tools);
    let kinds = "one of hero, minion, dumb, platform, wall, block";
    refused("kind = \"wall\"", "kind = \"pack\"", 17, "bodies[0].kind", "\"pack\"", kinds);
}

#[test]
fn a_body_whose_default_group_is_missing_is_refused() {
    let found = "nothing, and no group is called \"pack\"";
    refused(", \"pack\"]", "]", 1, "pack.group", found, "one of platform, block, hero");
}

#[test]
fn sizes_must_be_positive_and_finite() {
    let allowed = "a number from 0.001 to 1000000";
    for found in ["-3", "0", "0.0", "nan", "inf", "-inf", "1e39", "\"3\"", "true", "1000001"] {
        refused("radius = 3", &format!("radius = {found}"), 25, "bodies[1].radius", found, allowed);
    }
    refused("size = [2, 2]", "size = [2, -2]", 36, "layouts[0].size[1]", "-2", allowed);
    let pair = "[x, y], each a number from 0.001 to 1000000";
    refused("size = [100, 4]", "size = [100]", 19, "bodies[0].size", "[100]", pair);
    refused("size = [100, 4]", "size = 4", 19, "bodies[0].size", "4", pair);
    refused("size = [100, 50]", "size = [0, 50]", 2, "size[0]", "0", "a number from 1 to 1000000");
    refused(
        "gravity = [0, -10]",
        "gravity = [nan, 0]",
        3,
        "gravity[0]",
        "nan",
        "a number from -1000 to 1000",
    );
    refused(
        "radius = 3",
        "",
        21,
        "bodies[1].size",
        "nothing",
        "radius = r or size = [width, height]",
    );
    refused(
        "radius = 3",
        "radius = 3\nsize = [1, 1]",
        26,
        "bodies[1].size",
        "radius and size",
        "only one of the two",
    );
}

/// A wrong setting is refused, never silently corrected (C22c).
#[test]
fn a_scene_names_its_solver() {
    let text = SMALL.replace("gravity = [0, -10]", "solver = \"conjugate\"");
    let start = text.find("[relaxation]").expect("the table");
    let end = start + text[start..].find("\n\n").expect("its end");
    let text = |table: &str| text[..start].to_owned() + table + &text[end..];
    let solver = |table: &str| Scene::parse("a.toml", &text(table)).expect(table).world.solver;
    assert_eq!(solver(""), Some(Solver::Conjugate(Conjugate::default())));
    let given = Conjugate {
        tolerance: 0.25,
        sweeps_max: 7,
        work_max: 5000,
        bounce_threshold: 0.0,
        slop: 0.5,
        correction: 1.0,
        correction_max: 2.0,
        position_passes: 0,
    };
    let table = "[conjugate]\ntolerance = 0.25\nsweeps_max = 7\nwork_max = 5000\n\
        bounce_threshold = 0\nslop = 0.5\ncorrection = 1\ncorrection_max = 2\nposition_passes = 0";
    assert_eq!(solver(table), Some(Solver::Conjugate(given)));
    for (table, field) in [
        ("[conjugate]\ntolerance = 0", "conjugate.tolerance"),
        ("[conjugate]\nsweeps_max = 0", "conjugate.sweeps_max"),
        ("[conjugate]\nwork_max = 999", "conjugate.work_max"),
        ("[conjugate]\nposition_passes = 61", "conjugate.position_passes"),
        ("[relaxation]\niterations = 4", "relaxation"),
    ] {
        let error = Scene::parse("a.toml", &text(table)).expect_err(table);
        assert_eq!(error.field, field);
    }
    let both = SMALL.replace("[relaxation]", "[conjugate]\nslop = 0\n\n[relaxation]");
    assert_eq!(Scene::parse("a.toml", &both).expect_err("both").field, "conjugate");
}

#[test]
fn masses_that_the_conjugate_solver_does_not_hold_are_refused() {
    let scene = |solver: &str, mass: f32| {
        let text = format!(
            "title = \"T\"\nsize = [100, 100]\nsolver = \"{solver}\"\ngroups = [\"block\"]\n\
             [[bodies]]\nkind = \"block\"\nposition = [10, 10]\nradius = 1\nmass = 0.5\n\
             [[bodies]]\nkind = \"block\"\nposition = [20, 10]\nradius = 1\nmass = {mass}\n"
        );
        Scene::parse("test.toml", &text)
    };
    assert!(scene("conjugate", 5e5).is_ok() && scene("relaxation", 1e6).is_ok());
    let error = scene("conjugate", 6e5).expect_err("too heavy");
    let found = (error.line, error.field.as_str(), error.found.as_str());
    assert_eq!(found, (14, "bodies[1].mass", "a mass of 600000 beside one of 0.5 in bodies[0]"));
    assert!(error.allowed.contains("1000000 times"), "{}", error.allowed);
}

#[test]
fn solver_settings_out_of_range_are_refused() {
    let whole = "a whole number from 1 to 240";
    for found in ["0", "-1", "241", "2.5", "15.0", "nan"] {
        let to = format!("iterations = {found}");
        refused("iterations = 15", &to, 9, "relaxation.iterations", found, whole);
    }
    let share = "a number above 0, at most 1";
    for found in ["0", "-0.5", "1.01", "nan", "inf", "0.0"] {
        let to = format!("correction = {found}");
        refused("correction = 0.8", &to, 10, "relaxation.correction", found, share);
    }
    let scene = Scene::parse("a.toml", &SMALL.replace("correction = 0.8", "correction = 1"))
        .expect("1 is full");
    let expected = Relaxation { correction: 1.0, ..Relaxation::default() };
    assert_eq!(scene.world.solver, Some(Solver::Relaxation(expected)));
    refused(
        "gravity = [0, -10]",
        "response = \"none\"",
        8,
        "relaxation",
        "a table beside response = \"none\"",
        "only one of the two",
    );
}

#[test]
fn a_start_inside_something_solid_is_refused() {
    refused(
        "[50, 20]",
        "[50, 4]",
        24,
        "bodies[1].position",
        "a start inside bodies[0]",
        "a place clear of it",
    );
    refused(
        "[[20, 30]]",
        "[[20, 30], [20, 5]]",
        13,
        "hero.spawns[1]",
        "a hero inside bodies[0]",
        "a place clear of it",
    );
    let touching = SMALL.replace("[50, 20]", "[50, 5]");
    assert!(Scene::parse("a.toml", &touching).is_ok(), "touching is no overlap");
    let unpaired = SMALL.replace("[50, 20]", "[50, 4]").replace("[\"block\", \"platform\"], ", "");
    assert!(Scene::parse("a.toml", &unpaired).is_ok(), "groups that do not meet may overlap");
}

#[test]
fn positions_outside_the_kill_zone_are_refused() {
    let inside = "a place inside the kill zone";
    refused("[50, 20]", "[50, 80]", 24, "bodies[1].position", "[50, 80]", inside);
    refused("[90, 40]]", "[900, 40]]", 29, "bodies[2].path", "[[10, 40], [900, 40]]", inside);
    refused(
        "[[5, 25], [95, 35]]",
        "[[5, 25], [195, 35]]",
        35,
        "layouts[0].area",
        "[[5, 25], [195, 35]]",
        inside,
    );
    refused(
        "gravity = [0, -10]",
        "kill_zone = [[0, 0], [99, 50]]",
        3,
        "kill_zone",
        "[[0, 0], [99, 50]]",
        "corners around the whole world",
    );
}

#[test]
fn an_exact_layout_has_a_body_at_the_centre_of_each_cell() {
    let exact = SMALL.replace("count = 2\n", "count = 5\nexact = true\ngrid = [3, 2]\n");
    let scene = Scene::parse("small.toml", &exact).expect("a good scene");
    let game = crate::Game::new(std::sync::Arc::new(scene), 9);
    let places: Vec<Vec2> =
        game.bodies().skip(3).map(|body| game.world().position(body.id)).collect();
    let at = |x, y| Vec2::new(x, y);
    let row = |y: f32| [at(20.0, y), at(50.0, y), at(80.0, y)];
    assert_eq!(places, [&row(27.5)[..], &row(32.5)[..2]].concat(), "row by row from below");
}

#[test]
fn exact_layouts_are_checked() {
    let to = "exact = true\ngrid = [3, 2]\ncount = 7\n";
    refused("count = 2\n", to, 36, "layouts[0].count", "7", "a whole number from 1 to 6");
    let to = "exact = true\ngrid = [3, 2]\ncount = 2\ngap = 1\n";
    let allowed = "nothing: the grid decides it where exact = true";
    refused("count = 2\n", to, 37, "layouts[0].gap", "1", allowed);
    let found = "a start inside bodies[0]";
    let to = "exact = true\ncount = 1\narea = [[5, 1], [95, 3]]";
    let from = "count = 2\narea = [[5, 25], [95, 35]]";
    refused(from, to, 36, "layouts[0].area", found, "a place clear of it");
    refused("count = 2\n", "count = 2\nexact = 1\n", 35, "layouts[0].exact", "1", "true or false");
}

#[test]
fn limits_are_kept() {
    let to = "[limits]\nbodies = 20\n\n[hero]";
    let found = "20 for 21 bodies with layouts and heroes of all players";
    refused("[hero]", to, 13, "limits.bodies", found, "21 or more, up to 20000");
    refused(
        "[hero]",
        "[limits]\nplayers = 513\n[hero]",
        13,
        "limits.players",
        "513",
        "a whole number from 1 to 512",
    );
    refused(
        "gravity = [0, -10]\n",
        "camera = { follow = 90 }\nlimits = { players = 65 }\n",
        4,
        "limits.players",
        "65",
        "a whole number from 1 to 64",
    );
    refused(
        "count = 2\n",
        "count = 4097\n",
        34,
        "layouts[0].count",
        "4097",
        "a whole number from 1 to 4096",
    );
    let many: String = "[[bodies]]\nkind=\"wall\"\n".repeat(3000);
    let error = Scene::parse("a.toml", &format!("{SMALL}{many}")).expect_err("too long");
    assert_eq!((error.line, error.field.as_str()), (1, "file"));
}

#[test]
fn paths_are_checked() {
    let points = "a list of 2 to 64 points [x, y], each unlike the one before";
    refused("[[10, 40], [90, 40]]", "[[10, 40]]", 29, "bodies[2].path", "[[10, 40]]", points);
    refused(
        "[[10, 40], [90, 40]]",
        "[[10, 40], [10, 40]]",
        29,
        "bodies[2].path",
        "[[10, 40], [10, 40]]",
        points,
    );
    refused(
        "period = 4",
        "",
        27,
        "bodies[2].period",
        "nothing",
        "a number from 0.1 to 3600: seconds there and back",
    );
    refused(
        "period = 4",
        "period = 0.5",
        30,
        "bodies[2].period",
        "a speed of 320 on the fastest leg",
        "a period that needs at most speed_max = 150",
    );
    refused(
        "period = 4",
        "period = 4\nposition = [1, 1]",
        31,
        "bodies[2].position",
        "[1, 1]",
        "nothing: the path decides it",
    );
    refused(
        "period = 4",
        "period = 4\nmotion = \"static\"",
        31,
        "bodies[2].motion",
        "\"static\"",
        "\"kinematic\", because the body has a path",
    );
    refused(
        "radius = 3",
        "radius = 3\nperiod = 2",
        26,
        "bodies[1].period",
        "2",
        "nothing: only a path has it",
    );
}

#[test]
fn tools_that_contradict_each_other_are_refused() {
    refused(
        "[\"launch\"]",
        "[\"launch\", \"select\"]",
        6,
        "tools",
        "launch and select, which both use the left button",
        "one of them",
    );
    let both =
        SMALL.replace("[\"launch\"]", "[\"dumb\", \"spray\"]").replace("\"pack\"", "\"dumb\"");
    let error = Scene::parse("a.toml", &both).expect_err("both on Z");
    assert_eq!((error.line, error.field.as_str()), (6, "tools"));
}

#[test]
fn invalid_toml_is_refused_at_its_line() {
    for (text, line) in [
        ("title = \"a\"\nsize = [1, 2\n\ntools = ", 4),
        ("= 3", 1),
        ("\u{0}", 1),
        ("a = 1\nb = 2\na = 3", 3),
    ] {
        let error = Scene::parse("a.toml", text).expect_err(text);
        assert_eq!((error.line, error.field.as_str()), (line, "file"), "{error}");
        assert_eq!(error.allowed, "TOML");
    }
    let error = Scene::parse("a.toml", "").expect_err("empty");
    assert_eq!(error.to_string(), "a.toml:1: title: found nothing; allowed: a name for people");
}

#[test]
fn the_file_name_must_be_a_good_name() {
    for file in ["", "Yard.toml", "a b.toml", "..", "é.toml", &format!("{}.toml", "a".repeat(33))]
    {
        let error = Scene::parse(file, SMALL).expect_err(file);
        assert_eq!(error.field, "file name", "{file}");
    }
    assert_eq!(Scene::parse("some/where/a-9", SMALL).expect("a good name").name, "a-9");
}

/// The fields that the error about an unknown field lists.
fn fields_of_the_top_level() -> Vec<String> {
    let error = Scene::parse("a.toml", "unknown = 1").expect_err("an unknown field");
    let list = error.allowed.strip_prefix("the fields ").expect("a list of fields");
    list.split(", ").map(str::to_owned).collect()
}

#[test]
fn a_path_reaches_every_point_at_a_whole_tick_and_comes_back_the_same_way() {
    let points = vec![Vec2::ZERO, Vec2::new(10.0, 0.0), Vec2::new(10.0, 3.0)];
    let path = Path::new(points.clone(), 100, 0);
    let reached: Vec<Option<u32>> =
        points.iter().map(|&point| (0..=100).find(|&tick| path.at(tick) == point)).collect();
    assert_eq!(reached, [Some(0), Some(77), Some(100)]);
    for tick in 0..100 {
        assert_eq!(path.at(100 + tick), path.at(100 - tick));
        assert_eq!(path.at(tick), path.at(tick + 200));
        let step = (path.at(tick + 1) - path.at(tick)).length();
        assert!((0.12..0.14).contains(&step), "even speed: {step}");
    }
    assert_eq!(Path::new(points, 100, 50).at(3), path.at(53));
}

#[test]
fn a_scheduled_emitter_starts_once_or_periodically() {
    let once = ScheduledEmitter {
        recipe: 0,
        count: 5,
        start: 3,
        every: None,
        location: Location::Point(Vec2::ZERO),
        condition: Condition::default(),
    };
    let often = ScheduledEmitter { every: Some(4), ..once };
    let ticks = |scheduled: ScheduledEmitter| {
        (0..12).filter(|&tick| scheduled.starts_at(tick)).collect::<Vec<u32>>()
    };
    assert_eq!(ticks(once), [3]);
    assert_eq!(ticks(often), [3, 7, 11]);
}

/// Pieces from which nearly valid files are assembled.
fn piece() -> impl Strategy<Value = String> {
    let keys = prop::sample::select(fields_of_the_top_level());
    let values = prop::sample::select(vec![
        "0",
        "-1",
        "1e300",
        "nan",
        "inf",
        "[]",
        "[[]]",
        "[[1, 2], [3, 4]]",
        "{}",
        "\"hero\"",
        "[\"hero\"]",
        "[{ kind = \"hero\", position = [1, 1] }]",
        "true",
        "9999999999999999999",
        "[{ radius = 1 }]",
        "1979-05-27",
        "{ fire = { like = \"spark\" } }",
        "[100, 100]",
    ]);
    prop_oneof![
        (keys, values).prop_map(|(key, value)| format!("{key} = {value}\n")),
        prop::sample::select(SMALL.lines().collect::<Vec<_>>())
            .prop_map(|line| format!("{line}\n")),
        ".{0,12}\n",
    ]
}

proptest! {
    #[test]
    fn no_text_makes_the_parser_panic(text in ".{0,200}") {
        let _ = Scene::parse("a.toml", &text);
    }

    #[test]
    fn no_mixture_of_known_pieces_makes_the_parser_panic(pieces in prop::collection::vec(piece(), 0..30)) {
        let text = pieces.concat();
        if let Err(error) = Scene::parse("a.toml", &text) {
            prop_assert!(error.line >= 1 && error.line <= text.lines().count().max(1) + 1);
            prop_assert!(!error.field.is_empty() && !error.allowed.is_empty());
        }
    }

    /// A valid file with a few characters overwritten is either refused or parsed, and one that parses can be played.
    #[test]
    fn a_damaged_file_is_refused_or_playable(
        at in prop::collection::vec((0..SMALL.len(), "[ -~]"), 1..4)
    ) {
        let mut text = SMALL.to_owned();
        for (place, with) in at {
            text.replace_range(place..place + 1, &with);
        }
        if let Ok(scene) = Scene::parse("a.toml", &text) {
            let mut game = crate::Game::new(std::sync::Arc::new(scene), 1);
            game.join(crate::Seat(0));
            for _ in 0..10 {
                game.tick(&[]);
            }
            prop_assert!(game.world().is_finite());
        }
    }
}
