//! The live program as a whole: engine, simulated devices, recording and a person who presses the buttons, in virtual
//! time; and the program itself as a newcomer meets it.

mod aborted;
mod after;
mod back;
mod clocks;
mod covered;
mod elsewhere;
mod ended;
mod faced;
mod lagging;
mod left_out;
mod link;
mod long;
mod newcomer;
mod nobodys;
mod played;
mod recalled;
mod slow;
mod stalled;
mod stamped;
mod story;
mod taught;
mod terminal;
mod waiting;
mod world;
