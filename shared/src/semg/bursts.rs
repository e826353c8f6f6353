//! Bursts: when a muscle is active, from its envelope alone.
