//! Builds a world's networks, which are its connected components of bodies and springs. They are rebuilt when springs
//! or bodies change.

use super::link::{LinkEnd, NetworkLink};
use super::{Network, NetworkNode};
use crate::forces::air::Drag;
use crate::forces::elimination::{Elimination, EliminationOrder};
use crate::forces::springs::{Spring, SpringEnd};
use crate::solver::islands;
use glam::DVec2;

/// A body on springs: its slot and drag.
type Sprung = (u32, Drag);

/// Builds the networks of these bodies, given in ascending slot order, and of all springs attached to them.
pub(in crate::forces) fn networks(bodies: &[Sprung], springs: &[Spring]) -> Vec<Network> {
    let mut parent: Vec<u32> = (0..bodies.len() as u32).collect();
    // The upper half is the owner of the entry, first a node and then a component, and the lower half is a node or
    // a spring. Plain numbers sort faster.
    let mut nodes: Vec<u64> = (0..bodies.len() as u64).map(|node| node << 32 | node).collect();
    let mut touching = Vec::new();
    for (index, spring) in (0u64..).zip(springs) {
        let mut ends = spring.slots().filter_map(|slot| index_of(bodies, slot));
        let Some(node) = ends.next() else { continue };
        ends.for_each(|other| islands::join(&mut parent, node, other));
        touching.push(u64::from(node) << 32 | index);
    }
    for entries in [&mut nodes, &mut touching] {
        for entry in entries.iter_mut() {
            let component = islands::root(&mut parent, (*entry >> 32) as u32);
            *entry = u64::from(component) << 32 | u64::from(*entry as u32);
        }
        entries.sort_unstable();
    }
    let (mut networks, mut nodes, mut touching) = (Vec::new(), &nodes[..], &touching[..]);
    while let Some(&first) = nodes.first() {
        let is_of = |entry: &u64| entry >> 32 == first >> 32;
        let (own, others) = nodes.split_at(nodes.partition_point(is_of));
        let (joined, left) = touching.split_at(touching.partition_point(is_of));
        (nodes, touching) = (others, left);
        let own: Vec<Sprung> = own.iter().map(|&node| bodies[node as u32 as usize]).collect();
        let springs = joined.iter().map(|&spring| &springs[spring as u32 as usize]);
        networks.push(Network::new(&own, &springs.collect::<Vec<&Spring>>()));
    }
    networks
}

/// Returns the index of the body in a slot, if it is among these.
fn index_of(bodies: &[Sprung], slot: u32) -> Option<u32> {
    bodies.binary_search_by_key(&slot, |body| body.0).ok().map(|at| at as u32)
}

impl Network {
    /// Builds the network of these bodies, given in ascending slot order, and of the springs attached to them.
    fn new(bodies: &[Sprung], springs: &[&Spring]) -> Network {
        let edge = |spring: &&Spring| match spring.end {
            SpringEnd::Body(other) => {
                index_of(bodies, spring.body.index).zip(index_of(bodies, other.index))
            }
            SpringEnd::Point(_) => None,
        };
        let edges: Vec<(u32, u32)> = springs.iter().filter_map(edge).collect();
        let (mut system, mut order) = (Elimination::default(), EliminationOrder::default());
        system.build(bodies.len(), &edges, &mut order);
        let node = |&node: &u32| {
            let (slot, drag) = bodies[node as usize];
            NetworkNode { slot, drag, ..NetworkNode::default() }
        };
        let end = |slot: u32| match index_of(bodies, slot) {
            Some(node) => LinkEnd::Node(order.index_of[node as usize]),
            None => LinkEnd::Slot(slot),
        };
        let link = |spring: &&Spring| NetworkLink {
            a: end(spring.body.index),
            b: match spring.end {
                SpringEnd::Point(point) => LinkEnd::Point(point.as_dvec2()),
                SpringEnd::Body(id) => end(id.index),
            },
            rest_length: f64::from(spring.rest_length),
            stiffness: f64::from(spring.stiffness),
            damping: f64::from(spring.damping),
        };
        Network {
            nodes: order.nodes.iter().map(node).collect(),
            links: springs.iter().map(link).collect(),
            system,
            residual: vec![DVec2::ZERO; bodies.len()],
            ..Network::default()
        }
    }
}
