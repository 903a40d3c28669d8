//! The broad phase determines which pairs of bodies may come into contact.

pub(crate) mod pairs;
mod static_grid;
