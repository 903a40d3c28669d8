//! Sources of the correct answers: closed-form solutions, event-driven simulation, and quadratic programs solved in f64
//! by two methods that share no code.

pub mod closed;
pub mod coulomb;
pub mod events;
pub mod fine;
pub mod moreau;
pub mod program;
