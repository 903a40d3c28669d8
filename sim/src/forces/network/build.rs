//! The networks of a world: its connected components of bodies and springs. They are built when springs or bodies change.

use super::link::{End, Link};
use super::{Network, Node};
use crate::forces::drag::Drag;
use crate::forces::elimination::{Elimination, EliminationOrder};
use crate::forces::springs::{Spring, SpringEnd};
use crate::solver::islands;
use glam::DVec2;

/// The networks of these slots, ascending, with their drag, and of all springs that touch them.
pub(in crate::forces) fn networks(
    slots: &[u32],
    drag: &[Drag],
    springs: &[Spring],
) -> Vec<Network> {
    let node_of = |slot: u32| slots.binary_search(&slot).ok().map(|at| at as u32);
    let mut edges = Vec::new();
    let mut touching = Vec::new();
    for (index, spring) in (0..).zip(springs) {
        let mut nodes = spring.slots().filter_map(node_of);
        let Some(node) = nodes.next() else { continue };
        edges.extend(nodes.map(|other| (node, other)));
        touching.push((node, index));
    }
    let component = components(slots.len(), &edges);
    // The component in the upper half, and what belongs to it in the lower: a sort of plain numbers.
    let of = |node: u32, what: u32| u64::from(component[node as usize]) << 32 | u64::from(what);
    let mut nodes: Vec<u64> = (0..slots.len() as u32).map(|node| of(node, node)).collect();
    let mut touching: Vec<u64> =
        touching.into_iter().map(|(node, index)| of(node, index)).collect();
    nodes.sort_unstable();
    touching.sort_unstable();
    let (mut networks, mut nodes, mut touching) = (Vec::new(), &nodes[..], &touching[..]);
    while let Some(&first) = nodes.first() {
        let is_of = |entry: &u64| entry >> 32 == first >> 32;
        let (own, others) = nodes.split_at(nodes.partition_point(is_of));
        let (joined, left) = touching.split_at(touching.partition_point(is_of));
        (nodes, touching) = (others, left);
        let of_node = |&node: &u64| (slots[node as u32 as usize], drag[node as u32 as usize]);
        let (slots, drag): (Vec<u32>, Vec<Drag>) = own.iter().map(of_node).unzip();
        let springs: Vec<&Spring> =
            joined.iter().map(|&spring| &springs[spring as u32 as usize]).collect();
        networks.push(Network::new(&slots, &drag, &springs));
    }
    networks
}

impl Network {
    /// Builds the network of these slots, ascending, with their drag, and of the springs that touch them.
    fn new(slots: &[u32], drag: &[Drag], springs: &[&Spring]) -> Network {
        let node_of = |slot: u32| slots.binary_search(&slot).ok().map(|at| at as u32);
        let edge = |spring: &&Spring| match spring.end {
            SpringEnd::Body(other) => node_of(spring.body.index).zip(node_of(other.index)),
            SpringEnd::Point(_) => None,
        };
        let edges: Vec<(u32, u32)> = springs.iter().filter_map(edge).collect();
        let (mut system, mut order) = (Elimination::default(), EliminationOrder::default());
        system.build(slots.len(), &edges, &mut order);
        let index_of = order.index_of;
        let mut order = vec![0; slots.len()];
        for (node, &at) in index_of.iter().enumerate() {
            order[at as usize] = node;
        }
        let node = |&node: &usize| Node {
            slot: slots[node],
            drag: drag[node],
            mass: 1.0,
            gravity_scale: 1.0,
            path: DVec2::ZERO,
            free: DVec2::ZERO,
            resistance: 1.0,
            rate: 0.0,
            decay: 0.0,
            start: DVec2::ZERO,
            before: DVec2::ZERO,
            velocity: DVec2::ZERO,
        };
        let end = |slot: u32| match node_of(slot) {
            Some(node) => End::Node(index_of[node as usize]),
            None => End::Slot(slot),
        };
        let link = |spring: &&Spring| Link {
            a: end(spring.body.index),
            b: match spring.end {
                SpringEnd::Point(point) => End::Point(point.as_dvec2()),
                SpringEnd::Body(id) => end(id.index),
            },
            rest_length: f64::from(spring.rest_length),
            stiffness: f64::from(spring.stiffness),
            damping: f64::from(spring.damping),
        };
        Network {
            nodes: order.iter().map(node).collect(),
            links: springs.iter().map(link).collect(),
            system,
            residual: vec![DVec2::ZERO; slots.len()],
            ..Network::default()
        }
    }
}

/// For each node, the smallest one of its connected component.
fn components(count: usize, edges: &[(u32, u32)]) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..count as u32).collect();
    edges.iter().for_each(|&(a, b)| islands::join(&mut parent, a, b));
    (0..count as u32).map(|at| islands::root(&mut parent, at)).collect()
}
