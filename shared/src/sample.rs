//! Device time, one multichannel scan, and the scale from converter counts to volts.
