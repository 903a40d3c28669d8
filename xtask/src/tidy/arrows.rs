//! The direction of the arrows between crates: who may depend on whom.

use super::Finding;
use crate::workspace::Package;

/// Every crate of the workspace and those of ours that it may depend on, tests included.
const ARROWS: [(&str, &[&str]); 9] = [
    ("jostle-sim", &[]),
    ("jostle-protocol", &["jostle-sim"]),
    ("jostle-room", &["jostle-sim", "jostle-protocol"]),
    // It draws pictures of replays with the page's renderer.
    ("jostle-server", &["jostle-sim", "jostle-protocol", "jostle-room", "jostle-client-web"]),
    ("jostle-client-web", &["jostle-sim", "jostle-protocol", "jostle-room"]),
    (
        "jostle-tests",
        &["jostle-sim", "jostle-protocol", "jostle-room", "jostle-server", "jostle-client-web"],
    ),
    ("jostle-fuzz", &["jostle-sim", "jostle-protocol", "jostle-room", "jostle-server"]),
    ("jostle-report", &["jostle-protocol", "jostle-room", "jostle-sim"]),
    (
        "xtask",
        &["jostle-sim", "jostle-protocol", "jostle-room", "jostle-server", "jostle-client-web"],
    ),
];
/// Sockets, runtimes and pages, of which the first three crates know nothing.
const OUTSIDE: [&str; 6] = ["tokio", "tokio-tungstenite", "hyper", "wgpu", "web-sys", "js-sys"];
const INSIDE: [&str; 3] = ["jostle-sim", "jostle-protocol", "jostle-room"];

pub fn check(packages: &[Package]) -> Vec<Finding> {
    packages.iter().flat_map(|package| check_one(package, packages)).collect()
}

fn check_one(package: &Package, packages: &[Package]) -> Vec<Finding> {
    let name = package.name.as_str();
    let Some((_, allowed)) = ARROWS.iter().find(|(from, _)| *from == name) else {
        return vec![format!("crate {name} is not in the table of arrows of xtask's tidy")];
    };
    let mut findings = Vec::new();
    for dependency in package.dependencies.iter().map(|dependency| dependency.name.as_str()) {
        let ours = packages.iter().any(|package| package.name == dependency);
        if ours && !allowed.contains(&dependency) {
            findings.push(format!("crate {name} depends on {dependency}, against the arrows"));
        }
        if INSIDE.contains(&name) && OUTSIDE.contains(&dependency) {
            findings.push(format!("crate {name} depends on {dependency}: it must not know of it"));
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::check;
    use crate::workspace::{Dependency, Package};

    fn package(name: &str, dependencies: &[&str]) -> Package {
        let dependencies =
            dependencies.iter().map(|name| Dependency { name: name.to_string() }).collect();
        Package { name: name.into(), dependencies, targets: Vec::new() }
    }

    #[test]
    fn an_arrow_backwards_is_found_and_one_forwards_is_not() {
        let room = package("jostle-room", &["jostle-sim", "thiserror"]);
        assert_eq!(check(&[room, package("jostle-sim", &["glam"])]).len(), 0);
        let sim = package("jostle-sim", &["jostle-room"]);
        assert_eq!(check(&[sim, package("jostle-room", &[])]).len(), 1);
    }

    #[test]
    fn sockets_in_the_room_and_unknown_crates_are_found() {
        assert_eq!(check(&[package("jostle-room", &["tokio"])]).len(), 1);
        assert_eq!(check(&[package("jostle-server", &["tokio"])]).len(), 0);
        assert_eq!(check(&[package("jostle-extra", &[])]).len(), 1);
    }
}
