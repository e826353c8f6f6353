//! From raw sEMG to envelopes, activation and signal quality.
