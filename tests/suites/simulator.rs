//! The simulator is honest before it is used.
