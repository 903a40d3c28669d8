//! The room as its users see it, in one program: linking each subject by itself takes longer than running it.

mod allocations;
mod crowd;
mod faults;
mod one_hash;
