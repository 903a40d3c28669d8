//! The room through its public interface. All subjects are one program, because linking each separately takes longer
//! than running it.

mod allocations;
mod crowd;
mod faults;
mod one_hash;
