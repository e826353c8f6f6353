//! Recordings: programs that are killed, disks that are full, and readers by others.

mod child;
mod demonstrated;
mod exported;
mod full;
mod killed;
mod outside;
mod sent;
