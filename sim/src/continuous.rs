//! Continuous collision keeps bodies that move by more than their size within a step from tunnelling through or
//! missing each other. Only the conjugate solver uses it; with the relaxation solver, `speed_max` has to be low
//! enough.

pub(crate) mod crowd;
pub(crate) mod impact_prediction;
pub(crate) mod impact_queue;
pub(crate) mod late_pairs;
pub(crate) mod paths;
pub(crate) mod static_clamp;
