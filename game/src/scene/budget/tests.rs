use super::*;

/// A budget that [`scene`] exactly exhausts in every respect.
const BUDGET: Budget = Budget {
    players: 4,
    bodies: 100,
    particles: 500,
    size: 200.0,
    tick_ms: 8.0,
    solver: SolverBudget { iterations: 15, sweeps: 400, work: 2_000_000, position_passes: 4 },
    springs: 1,
    zone_looks: 100,
    rules: 1,
    starts_per_s: 6,
    emitted_per_s: 60,
    launched_per_s: 1,
};

fn scene(top: &str, rest: &str) -> Scene {
    let limits = if top.contains("limits") {
        String::new()
    } else {
        "limits = { players = 4, bodies = 100, particles = 500 }\n".to_owned()
    };
    let source = format!(
        "title = \"Guest\"\nsize = [200, 100]\ngroups = [\"ball\", \"wall\"]\npairs = [[\"ball\", \"ball\"]]\n\
         {limits}{top}\n[dumb]\ngroup = \"ball\"\nradius = 1\n\
         [[bodies]]\nkind = \"block\"\ngroup = \"ball\"\nname = \"b\"\nposition = [50, 50]\nradius = 1\n\
         [[springs]]\nbody = \"b\"\nto = [60, 60]\nstiffness = 1\n\
         [[zones]]\nname = \"z\"\narea = [[0, 0], [10, 10]]\nwho = [\"ball\"]\n\
         [[rules]]\nevery = 1\nscore = 1\n\
         [[emitters]]\nrecipe = \"fire\"\ncount = 10\nevery = 10\nposition = [5, 5]\n\
         [[launchers]]\nwhat = \"dumb\"\nevery = 1\nposition = [20, 20]\n{rest}"
    );
    Scene::parse("guest.toml", &source).unwrap_or_else(|error| panic!("{error}\n{source}"))
}

/// Returns the refusal of a scene, and the line to which it refers.
fn refused(top: &str, rest: &str) -> (String, SceneError) {
    let scene = scene(top, rest);
    let error = BUDGET.check(&scene).expect_err("it asks for too much");
    let line = scene.source.lines().nth(error.line - 1).expect("a line of the file");
    (line.to_owned(), error)
}

#[test]
fn what_fits_the_budget_exactly_is_allowed() {
    assert_eq!(BUDGET.check(&scene("", "")), Ok(()));
    assert_eq!(BUDGET.check(&scene("solver = \"conjugate\"", "")), Ok(()));
}

#[test]
fn each_limit_refuses_with_its_field_and_line() {
    let conjugate = "solver = \"conjugate\"\nconjugate = ";
    let emitter = "[[emitters]]\nrecipe = \"fire\"\nposition = [5, 5]\n";
    for (top, rest, line, field, found) in [
        ("limits = { players = 5, bodies = 100 }", "", "limits", "limits.players", "5 players"),
        (
            "limits = { players = 4, bodies = 101 }",
            "",
            "limits",
            "limits.bodies",
            "101 bodies at a time",
        ),
        (
            "limits = { players = 4, bodies = 100, particles = 501 }",
            "",
            "limits",
            "limits.particles",
            "501 particles at a time",
        ),
        (
            "relaxation = { iterations = 16 }",
            "",
            "relaxation",
            "relaxation.iterations",
            "16 iterations",
        ),
        (
            &format!("{conjugate}{{ sweeps_max = 401 }}"),
            "",
            "conjugate =",
            "conjugate.sweeps_max",
            "401 sweeps",
        ),
        (
            &format!("{conjugate}{{ work_max = 2000001 }}"),
            "",
            "conjugate =",
            "conjugate.work_max",
            "2000001 units of work",
        ),
        (
            &format!("{conjugate}{{ position_passes = 5 }}"),
            "",
            "conjugate =",
            "conjugate.position_passes",
            "5 passes",
        ),
        (
            "",
            "[[springs]]\nbody = \"b\"\nto = [40, 60]\nstiffness = 1\n",
            "[[springs]]",
            "springs",
            "2 springs",
        ),
        ("", "[[rules]]\nevery = 1\nscore = 1\n", "[[rules]]", "rules", "2 rules"),
        (
            "",
            "[[zones]]\nname = \"y\"\narea = [[0, 0], [9, 9]]\nwho = [\"ball\"]\n",
            "[[zones]]",
            "zones",
            "2 zones and up to 100 bodies",
        ),
        (
            "",
            &format!("{emitter}count = 1\nevery = 1\n"),
            "every = 1",
            "emitters[1].every",
            "66 starts of emitters a second",
        ),
        (
            "",
            &format!("{emitter}count = 61\n"),
            "count = 61",
            "emitters[1].count",
            "121 particles a second",
        ),
        (
            "",
            "[[launchers]]\nwhat = \"dumb\"\nevery = 0.5\nposition = [30, 20]\n",
            "every = 0.5",
            "launchers[1].every",
            "3 launches a second",
        ),
    ] {
        let (text, error) = refused(top, rest);
        assert!(text.starts_with(line), "{text:?} of {error}");
        let sentence = format!("guest.toml:{}: {field}: found {found}; ", error.line);
        assert!(error.to_string().starts_with(&sentence), "{error} for {sentence}");
        assert!(error.allowed.starts_with("at most "), "{error}");
    }
}

#[test]
fn a_world_that_is_too_large_is_refused() {
    let source =
        "title = \"Guest\"\n\nsize = [100, 201]\ngroups = [\"wall\"]\nlimits = { players = 1 }\n";
    let scene = Scene::parse("guest.toml", source).expect("a scene");
    let error = BUDGET.check(&scene).expect_err("it is too large");
    let sentence =
        "guest.toml:3: size: found a world of 100 x 201; allowed: at most 200 on each side";
    assert_eq!(error.to_string(), sentence);
}

#[test]
fn without_a_limit_what_brings_most_bodies_is_named() {
    let layout =
        "[[layouts]]\nkind = \"block\"\ngroup = \"ball\"\nradius = 1\narea = [[5, 5], [95, 95]]\n";
    let rest = format!("{layout}count = 4\n{layout}count = 300\n");
    let (line, error) = refused("limits = { players = 4, particles = 1 }", &rest);
    assert_eq!((line.as_str(), error.field.as_str()), ("count = 300", "layouts[1].count"));
    let top = "limits = { players = 4, dumb = 900, particles = 1 }\ntools = [\"dumb\"]";
    let (line, error) = refused(top, &rest);
    assert_eq!((&line[..6], error.field.as_str()), ("limits", "limits.dumb"));
}

#[test]
fn the_worst_tick_is_refused_with_what_costs_most() {
    let dear = Budget { tick_ms: 0.01, ..BUDGET };
    let error = dear.check(&scene("", "")).expect_err("it costs too much");
    assert_eq!(error.field, "limits.particles");
    assert!(error.to_string().contains("found a worst tick of 0.1 ms by its limits"), "{error}");
}
