//! A simulated person.
