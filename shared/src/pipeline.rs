//! Scans in, packets out: the signal path of the wearable, without input or output of its own.
