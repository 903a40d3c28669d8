//! Checks that crates depend only on crates that they may depend on.

use super::finding::Finding;
use crate::workspace::Package;

/// The layers of shipped crates. Each crate, including its tests, may depend only on earlier layers.
const LAYERS: [&[&str]; 7] = [
    &["jostle-sim"],
    &["jostle-game"],
    &["jostle-protocol"],
    &["jostle-room"],
    &["jostle-server", "jostle-client-web"],
    &["jostle-picture"],
    &["jostle-cli"],
];
/// Crates that may depend on all others, but that no shipped crate may depend on.
const TOOLS: [&str; 6] =
    ["jostle-tests", "jostle-fuzz", "jostle-goldens", "jostle-simulation", "xtask", "xtask-web"];
/// Crates for sockets, runtimes and browsers, which the inner crates must not use.
const OUTSIDE: [&str; 7] =
    ["tokio", "tokio-tungstenite", "tungstenite", "hyper", "wgpu", "web-sys", "js-sys"];
const INNER_LAYERS: usize = 4;

pub fn check(packages: &[Package]) -> Vec<Finding> {
    packages.iter().flat_map(|package| check_one(package, packages)).collect()
}

fn check_one(package: &Package, packages: &[Package]) -> Vec<Finding> {
    let name = package.name.as_str();
    if TOOLS.contains(&name) {
        return Vec::new();
    }
    let Some(layer) = LAYERS.iter().position(|layer| layer.contains(&name)) else {
        let text = "not in the table of crates; each has a layer; add it to LAYERS in xtask/src/tidy/arrows.rs";
        return vec![Finding::of(&manifest(name), text)];
    };
    let mut findings = Vec::new();
    for dependency in package.dependencies.iter().map(|dependency| dependency.name.as_str()) {
        let ours = packages.iter().any(|package| package.name == dependency);
        let below = LAYERS[..layer].iter().any(|layer| layer.contains(&dependency));
        if ours && !below {
            let allowed = LAYERS[..layer].concat().join(", ");
            let text = format!(
                "depends on {dependency}; allowed of ours: {allowed}; move what both need below them"
            );
            findings.push(Finding::of(&manifest(name), text));
        }
        if layer < INNER_LAYERS && OUTSIDE.contains(&dependency) {
            let text = format!(
                "depends on {dependency}; inner crates know neither sockets nor pages; move that code up"
            );
            findings.push(Finding::of(&manifest(name), text));
        }
    }
    findings
}

/// The path of a crate's manifest; the folder follows from the crate's name.
fn manifest(name: &str) -> String {
    format!("{}/Cargo.toml", name.trim_start_matches("jostle-"))
}

#[cfg(test)]
mod tests {
    use super::check;
    use crate::workspace::{Dependency, Package};

    fn package(name: &str, dependencies: &[&str]) -> Package {
        let dependencies =
            dependencies.iter().map(|name| Dependency { name: name.to_string() }).collect();
        let manifest_path = super::manifest(name).into();
        Package { name: name.into(), manifest_path, dependencies }
    }

    fn messages(packages: &[Package]) -> Vec<String> {
        check(packages).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn an_arrow_backwards_is_found_and_one_forwards_is_not() {
        let protocol = package("jostle-protocol", &["jostle-sim", "jostle-game", "thiserror"]);
        let game = package("jostle-game", &["jostle-sim"]);
        assert_eq!(check(&[protocol, game, package("jostle-sim", &["glam"])]), []);
        let sim = package("jostle-game", &["jostle-room"]);
        let said = messages(&[sim, package("jostle-room", &[])]);
        assert!(said[0].starts_with("game/Cargo.toml: depends on jostle-room;"), "{said:?}");
        assert!(said[0].contains("allowed of ours: jostle-sim;"), "{said:?}");
    }

    #[test]
    fn server_and_page_do_not_know_each_other_and_nobody_knows_the_tools() {
        let server = || package("jostle-server", &["jostle-client-web"]);
        let page = package("jostle-client-web", &["jostle-server"]);
        assert_eq!(messages(&[server(), page]).len(), 2);
        let cli = package("jostle-cli", &["jostle-server", "jostle-client-web", "xtask"]);
        let page = package("jostle-client-web", &[]);
        let said = messages(&[cli, server(), page, package("xtask", &["jostle-cli"])]);
        assert_eq!(said.len(), 2, "{said:?}");
        assert!(said[0].starts_with("cli/Cargo.toml: depends on xtask"), "{said:?}");
        assert!(said[1].starts_with("server/Cargo.toml: depends on jostle-client-web"), "{said:?}");
    }

    #[test]
    fn sockets_in_the_room_and_unknown_crates_are_found() {
        assert!(messages(&[package("jostle-room", &["tokio"])])[0].contains("tokio"));
        assert_eq!(check(&[package("jostle-client-web", &["wgpu"])]), []);
        assert!(messages(&[package("jostle-extra", &[])])[0].contains("LAYERS"));
    }
}
