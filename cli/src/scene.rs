//! `jostle scene`: what scenes there are, whether one is right, and what it holds.

use super::plan::Told;
use crate::output::{Failure, json, say};
use crate::scenes::{scene_file, scene_named};
use jostle_game::Scene;
use serde::Serialize;
use std::path::PathBuf;

/// List, check and explain scenes
#[derive(clap::Subcommand)]
pub enum SceneCommand {
    /// List the built-in scenes
    List {
        /// Print one JSON object
        #[arg(long)]
        json: bool,
    },
    /// Check a scene file; status 1 and one line with file, line and field when it is refused
    Check {
        /// The TOML file
        file: PathBuf,
    },
    /// Print what a scene needs, what is left out, and which field of the file decides
    Plan {
        /// A built-in scene, or the path of a TOML file
        #[arg(value_name = "FILE")]
        scene: String,
        /// Print one JSON object
        #[arg(long)]
        json: bool,
    },
}

#[derive(Serialize)]
struct List {
    scenes: Vec<Entry>,
}

#[derive(Serialize)]
struct Entry {
    name: String,
    title: String,
    about: String,
    players_max: u16,
}

impl SceneCommand {
    /// Does it.
    pub fn run(self) -> Result<(), Failure> {
        match self {
            SceneCommand::List { json } => list(json),
            SceneCommand::Check { file } => {
                let scene = scene_file(&file)?;
                say(format_args!("{}: ok, scene {:?}", file.display(), scene.name))
            }
            SceneCommand::Plan { scene, json: as_json } => {
                let plan = Told::of(scene_named(&scene)?);
                if as_json { say(json(&plan)) } else { say(plan) }
            }
        }
    }
}

fn list(as_json: bool) -> Result<(), Failure> {
    let entry = |scene: Scene| Entry {
        name: scene.name,
        title: scene.title,
        about: scene.about,
        players_max: scene.players_max,
    };
    let list = List { scenes: Scene::built_in().into_iter().map(entry).collect() };
    if as_json {
        return say(json(&list));
    }
    for scene in &list.scenes {
        say(format_args!("{:<12} {}", scene.name, scene.title))?;
    }
    Ok(())
}
