//! The live program as a whole, in virtual time.

mod story;
