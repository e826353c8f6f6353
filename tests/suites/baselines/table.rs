//! The table on the experiments' data.
