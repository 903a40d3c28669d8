//! Tests the room through its public interface. All test modules form one program, because linking each one separately
//! takes longer than running it.

mod allocations;
mod crowd;
mod faults;
mod matches;
mod novice;
mod one_hash;
