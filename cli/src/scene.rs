//! `jostle scene` lists, checks and explains scenes.

use super::plan;
use crate::output::{Failure, OrFail, json, say};
use crate::rehearsal::Rehearsal;
use crate::scenes::{scene_file, scene_named};
use crate::tiled;
use jostle_game::Scene;
use jostle_game::trial::worst_tick;
use std::path::{Path, PathBuf};

/// List, check and explain scenes
#[derive(clap::Subcommand)]
pub enum SceneCommand {
    /// List the built-in scenes
    List {
        /// Print one JSON object
        #[arg(long)]
        json: bool,
    },
    /// Check a scene file; if it is refused, print one line with the file, line and field, and exit with status 1
    Check {
        /// The TOML file
        file: PathBuf,
    },
    /// Create a scene file from a Tiled map, whose objects become the scene's bodies, zones and launchers
    Import {
        /// The map in Tiled's JSON format (.tmj)
        map: PathBuf,
        /// The file to write; without it, the scene goes to stdout
        #[arg(long, value_name = "FILE.toml")]
        out: Option<PathBuf>,
    },
    /// Let the server's bots play a scene for a minute; exit with status 1 if nobody scores, bodies fall out of the
    /// world or most bots stand about
    Try {
        /// A built-in scene, or the path of a TOML file
        #[arg(value_name = "FILE")]
        scene: String,
        /// Seed for everything random
        #[arg(long, value_name = "S", default_value_t = 1)]
        seed: u64,
        /// Print one JSON object
        #[arg(long)]
        json: bool,
    },
    /// Print the parts that a scene needs, those left out, and the field in the file that decides this
    Plan {
        /// A built-in scene, or the path of a TOML file
        #[arg(value_name = "FILE")]
        scene: String,
        /// Print one JSON object
        #[arg(long)]
        json: bool,
    },
}

impl SceneCommand {
    /// Runs the command.
    pub fn run(self) -> Result<(), Failure> {
        match self {
            SceneCommand::List { json } => list(json),
            SceneCommand::Check { file } => {
                let scene = scene_file(&file)?;
                say(format_args!("{}: ok, scene {:?}", file.display(), scene.name))
            }
            SceneCommand::Import { map, out } => import(&map, out.as_deref()),
            SceneCommand::Try { scene, seed, json } => rehearse(&scene, seed, json),
            SceneCommand::Plan { scene, json: as_json } => {
                let scene = scene_named(&scene)?;
                let tried = worst_tick(&scene);
                match as_json {
                    true => say(plan::as_json(&scene, &tried)),
                    false => say(plan::as_text(&scene, &tried)),
                }
            }
        }
    }
}

fn rehearse(name: &str, seed: u64, as_json: bool) -> Result<(), Failure> {
    let scene = scene_named(name)?;
    let rehearsal = Rehearsal::of(&scene, seed);
    match as_json {
        true => say(json(&rehearsal))?,
        false => say(format_args!("{name}: {}", rehearsal.sentence()))?,
    }
    match rehearsal.problems.is_empty() {
        true => Ok(()),
        false => Err(Failure::Check(format!("{name}: {}", rehearsal.problems.join("; ")))),
    }
}

/// Imports a map. The scene is named after its output file or, if there is none, after the map.
fn import(map: &Path, out: Option<&Path>) -> Result<(), Failure> {
    let file = map.display().to_string();
    let bytes = std::fs::read(map).or_usage(&file)?;
    let stem = out.unwrap_or(map).file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    let text = tiled::import(&file, stem, &bytes);
    let text = text.map_err(|error| Failure::Check(error.to_string()))?;
    match out {
        None => say(text.trim_end()),
        Some(out) => std::fs::write(out, text).or_check(out.display()),
    }
}

fn list(as_json: bool) -> Result<(), Failure> {
    let scenes = Scene::built_in();
    if !as_json {
        let mut lines = scenes.iter().map(|scene| format!("{:<12} {}", scene.name, scene.title));
        return lines.try_for_each(say);
    }
    let entry = |scene: &Scene| {
        serde_json::json!({
            "name": scene.name,
            "title": scene.title,
            "about": scene.about,
            "players_max": scene.players_max,
        })
    };
    say(serde_json::json!({ "scenes": scenes.iter().map(entry).collect::<Vec<_>>() }))
}
